"""The panels of a drive: recorded or live."""

import math
import operator
import os
import sys

# Okabe and Ito's palette, as in the demo: distinct for every kind of colour vision.
BLACK, ORANGE, SKY, BLUE, VERMILION, GREY = '#000000', '#E69F00', '#56B4E9', '#0072B2', '#D55E00', '#999999'
DRIVING = 1  # ControllerState.DRIVING


def first(orders):
    """Order 0 of a generalised quantity, NaN if there is none."""
    return orders[0] if orders else math.nan


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

    SCALARS = ('set_point_forward', 'set_point_yaw_rate', 'measured_forward', 'measured_yaw_rate', 'command_left',
               'command_right', 'free_energy')
    COLUMNS = {**{name: operator.attrgetter(name) for name in SCALARS},
               'belief_forward': lambda state: first(state.belief_forward),
               'belief_yaw_rate': lambda state: first(state.belief_yaw_rate)}

    def __init__(self, window=math.inf):
        """window: seconds that are kept."""
        self.window = window
        self.time, self.reasons = [], []
        self.summary = ''  # of the last state
        self.columns = {name: [] for name in self.COLUMNS}
        self.true_time, self.true_forward, self.true_yaw_rate = [], [], []

    def add_state(self, state):
        """Adds a ControllerState. Starts again after the clock jumped back."""
        time = state.header.stamp.to_sec()
        if self.time and time < self.time[-1]:
            self.__init__(self.window)
        self.time.append(time)
        self.summary = state.summary
        self.reasons.append('' if state.status == DRIVING and not state.reason else state.reason or 'idle')
        for name, value in self.COLUMNS.items():
            self.columns[name].append(value(state))
        self._forget(self.time, [self.reasons, *self.columns.values()])

    def add_truth(self, odometry):
        """Adds a nav_msgs/Odometry of the true motion, twist in the robot's frame."""
        time = odometry.header.stamp.to_sec()
        if self.true_time and time < self.true_time[-1]:
            return
        self.true_time.append(time)
        self.true_forward.append(odometry.twist.twist.linear.x)
        self.true_yaw_rate.append(odometry.twist.twist.angular.z)
        self._forget(self.true_time, [self.true_forward, self.true_yaw_rate])

    def _forget(self, time, lists):
        """Drops values older than the window, up to a tenth of it late."""
        if time[-1] - time[0] <= 1.1 * self.window:
            return
        keep = next(i for i, t in enumerate(time) if t >= time[-1] - self.window)
        for values in [time, *lists]:
            del values[:keep]

    def stops(self):
        """(begin, end, reason) of each stretch in which the robot was kept from driving."""
        begin = None
        for i, reason in enumerate(self.reasons):
            if begin is not None and reason != self.reasons[begin]:
                yield self.time[begin], self.time[i], self.reasons[begin]
                begin = None
            if reason and begin is None:
                begin = i
        if begin is not None:
            yield self.time[begin], self.time[-1], self.reasons[begin]


def plain(axes):
    """Removes from an axis what carries no data."""
    axes.grid(color='0.9')
    for side in ('top', 'right'):
        axes.spines[side].set_visible(False)


def draw_velocity(axes, drive, origin, name, unit, quantity):
    """Set point, measured, true and believed velocity."""
    time = [t - origin for t in drive.time]
    axes.step(time, drive.columns['set_point_' + name], where='post', color=BLACK, lw=1.2, ls='--', label='set point')
    axes.plot(time, drive.columns['measured_' + name], color=SKY, ls='', marker='.', ms=3, label='measured')
    if drive.true_time:
        truth = drive.true_forward if name == 'forward' else drive.true_yaw_rate
        axes.plot([t - origin for t in drive.true_time], truth, color=BLUE, lw=1.8, label='true')
    axes.plot(time, drive.columns['belief_' + name], color=VERMILION, lw=1.4, label='believed')
    axes.set_ylabel(f'{quantity} [{unit}]')


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


def draw(figure, drive, origin=None, title=''):
    """Draws a drive on an empty figure. origin: time of 0 on the axis [s]; the first state by default."""
    grid = figure.subplots(4, 1, sharex=True, gridspec_kw={'height_ratios': [3, 3, 2, 1.5]})
    origin = origin if origin is not None else (drive.time[0] if drive.time else 0.0)
    draw_velocity(grid[0], drive, origin, 'forward', 'm/s', 'forward speed')
    draw_velocity(grid[1], drive, origin, 'yaw_rate', 'rad/s', 'yaw rate')
    time = [t - origin for t in drive.time]
    grid[2].step(time, drive.columns['command_left'], where='post', color=ORANGE, lw=2.2, label='command, left wheels')
    grid[2].step(time, drive.columns['command_right'], where='post', color=BLACK, lw=1.0, ls=(0, (4, 3)),
                 label='command, right wheels')
    grid[2].set_ylabel('wheel speed [rad/s]')
    grid[3].plot(time, drive.columns['free_energy'], color=VERMILION, lw=1.2)
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
