"""The panels of a drive."""

import math
import os
import sys

# Okabe and Ito's palette, as in the demo: distinct for every kind of colour vision.
BLACK, ORANGE, SKY, BLUE, VERMILION, GREY = '#000000', '#E69F00', '#56B4E9', '#0072B2', '#D55E00', '#999999'
DRIVING = 1  # ControllerState.DRIVING


def first(value):
    """A number; order 0 of a generalised quantity, NaN if there is none."""
    return value if isinstance(value, float) else value[0] if value else math.nan


def start(program, **options):
    """rospy as a node of this name. Exits with one line if there is no master."""
    import rosgraph
    import rospy
    if not rosgraph.is_master_online():
        sys.exit(f'{program}: no ROS master at {os.environ.get("ROS_MASTER_URI", "")}; start the controller first')
    rospy.init_node(program, **options)
    return rospy


class Drive:
    """A drive over time: states of a controller (jackal_aic/ControllerState), and the true motion if known."""

    QUANTITIES = ('set_point_forward', 'set_point_yaw_rate', 'measured_forward', 'measured_yaw_rate', 'belief_forward',
                  'belief_yaw_rate', 'command_left', 'command_right', 'free_energy')

    def __init__(self):
        self.states = []   # (time, why the robot does not drive, *QUANTITIES)
        self.truth = []    # (time, forward speed, yaw rate)
        self.summary = ''  # of the last state

    def add_state(self, state):
        """Adds a ControllerState. Starts again after the clock jumped back."""
        time = state.header.stamp.to_sec()
        if self.states and time < self.states[-1][0]:
            self.__init__()
        self.summary = state.summary
        reason = '' if state.status == DRIVING and not state.reason else state.reason or 'idle'
        self.states.append((time, reason, *(first(getattr(state, name)) for name in self.QUANTITIES)))

    def add_truth(self, odometry):
        """Adds a nav_msgs/Odometry of the true motion, twist in the robot's frame."""
        time, speed = odometry.header.stamp.to_sec(), odometry.twist.twist
        if not self.truth or time >= self.truth[-1][0]:
            self.truth.append((time, speed.linear.x, speed.angular.z))

    def stops(self):
        """(begin, end, reason) of each stretch in which the robot was kept from driving."""
        changes = [row[:2] for before, row in zip([(0.0, None), *self.states], self.states) if row[1] != before[1]]
        ends = [begin for begin, _ in changes[1:]] + [row[0] for row in self.states[-1:]]
        return [(begin, end, reason) for (begin, reason), end in zip(changes, ends) if reason]


def plain(axes):
    """Removes from an axis what carries no data."""
    axes.grid(color='0.9')
    for side in ('top', 'right'):
        axes.spines[side].set_visible(False)


def draw_velocity(axes, time, states, truth, name, label):
    """Set point, measured, true and believed velocity. truth: (time, velocity) of each."""
    axes.step(time, states['set_point_' + name], where='post', color=BLACK, lw=1.2, ls='--', label='set point')
    axes.plot(time, states['measured_' + name], color=SKY, ls='', marker='.', ms=3, label='measured')
    if truth:
        axes.plot(*zip(*truth), color=BLUE, lw=1.8, label='true')
    axes.plot(time, states['belief_' + name], color=VERMILION, lw=1.4, label='believed')
    axes.set_ylabel(label)


CHARACTER = 0.0062  # mean width of a character of a reason, of the width of the axes
LEAST_LABELLED = 0.08  # of the time shown


def label_stops(axes, drive, origin):
    """Writes the reasons above the grey areas: within the axes, without repetition or overlap."""
    low, high = axes.get_xlim()
    free, said = 0.0, ''
    for begin, end, reason in drive.stops():
        if reason == said or end - begin < LEAST_LABELLED * (high - low):
            continue
        width = CHARACTER * len(reason)
        at = min((begin - origin - low) / (high - low), 1.0 - width)
        if at >= free:
            axes.annotate(reason, (at, 1.02), xycoords='axes fraction', fontsize=8, color='0.3', annotation_clip=False)
            free, said = at + width, reason


# Least span of an axis: noise at rest is not drawn as large as a drive.
LEAST_SPAN = (0.4, 0.4, 4.0, 1.0)  # m/s, rad/s, rad/s, free energy


def widen(axes, span):
    """Gives a vertical axis at least this span."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim(0.5 * (low + high - span), 0.5 * (low + high + span))


def draw(figure, drive, title=''):
    """Draws a drive on an empty figure, from its first state on."""
    states = dict(zip(('time', 'reason', *drive.QUANTITIES), zip(*drive.states)))
    origin = states['time'][0]
    time = [t - origin for t in states['time']]
    grid = figure.subplots(4, 1, sharex=True, gridspec_kw={'height_ratios': [3, 3, 2, 1.5]})
    draw_velocity(grid[0], time, states, [(t - origin, v) for t, v, _ in drive.truth], 'forward', 'forward speed [m/s]')
    draw_velocity(grid[1], time, states, [(t - origin, v) for t, _, v in drive.truth], 'yaw_rate', 'yaw rate [rad/s]')
    grid[2].step(time, states['command_left'], where='post', color=ORANGE, lw=2.2, label='command, left wheels')
    grid[2].step(time, states['command_right'], where='post', color=BLACK, lw=1.0, ls=(0, (4, 3)), label='command, right wheels')
    grid[2].set_ylabel('wheel speed [rad/s]')
    grid[3].plot(time, states['free_energy'], color=VERMILION, lw=1.2)
    grid[3].set_ylabel('free energy')
    grid[3].set_xlabel('time [s]')
    for axes, span in zip(grid, LEAST_SPAN):
        plain(axes)
        widen(axes, span)
        for begin, end, _ in drive.stops():
            axes.axvspan(begin - origin, end - origin, color=GREY, alpha=0.2, lw=0)
    label_stops(grid[0], drive, origin)
    handles, labels = (a + b for a, b in zip(grid[0].get_legend_handles_labels(), grid[2].get_legend_handles_labels()))
    figure.suptitle(title, x=0.09, y=0.985, ha='left', fontsize=11)
    figure.legend(handles, labels, loc='upper left', bbox_to_anchor=(0.08, 0.965), ncol=len(labels), frameon=False, fontsize=9)
    figure.align_ylabels(grid)
    figure.subplots_adjust(left=0.09, right=0.98, top=0.90, bottom=0.07, hspace=0.12)
