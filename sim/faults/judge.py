"""The verdict on one run of the fault campaign, from what was recorded of it."""

import math
import pathlib
import typing

import numpy
import yaml

CONFIG = pathlib.Path(__file__).resolve().parents[2] / 'config'
MARGIN = 1.2  # on configured times
STILL = numpy.array([0.02, 0.05])  # m/s and rad/s, below which the robot stands
WINDOW = 0.4  # s, over which a speed is averaged
ROUNDING = 1e-3  # relative: commands travel as float32
SMALLEST = 0.2  # m/s and rad/s, below which the tolerance at the end is absolute

COLUMNS = ('scenario', 'faults', 'expected', 'distance_m', 'standstill_s', 'allowed_s', 'command_step_radps', 'acceleration_use',
           'limit_use', 'overspeed_mps', 'yaw_overspeed_radps', 'detected_s', 'told', 'result', 'failures', 'history')


class Truth(typing.NamedTuple):
    """True motion of the robot: [s], [m/s], [rad/s]."""

    time: float
    forward: float
    yaw_rate: float


class Command(typing.NamedTuple):
    """A drive command as the controller sent it [rad/s]. fresh_start: the first of a new controller process after an end we asked for,
    or since a new start of the world: the robot is at rest there, and the command has to be zero."""

    time: float
    left: float
    right: float
    fresh_start: bool = False


class State(typing.NamedTuple):
    """What the controller says about itself: status and reason, and what it has rejected since its start."""

    time: float
    driving: bool
    text: str
    rejected_set_points: int = 0
    rejected_measurements: int = 0


class Record:
    """All that was recorded of a run, in the order of its times; breakdown: why it could not be completed."""

    def __init__(self):
        self.truth, self.commands, self.states, self.breakdown = [], [], [], ''


class Limits(typing.NamedTuple):
    """What robot and controller are configured for. gate: limits.* and brake.* of the node by key; the rest of robot and motors."""

    gate: dict
    wheel_radius: float = 0.098  # m
    effective_track: float = 0.5621  # m
    action_period: float = 0.02  # s
    robot_dead_time: float = 0.08  # s
    robot_acceleration: float = 1.65  # m/s^2, of the wheel circumference

    def body(self, wheels):
        """Speeds and yaw rates of wheel speeds, shapes (n, 2)."""
        left, right = self.wheel_radius * wheels.T
        return numpy.stack([0.5 * (left + right), (right - left) / self.effective_track], axis=1)


def limits_of(plant):
    """Limits of a node as it is shipped, on the robot of a file with plant.*."""
    values = {}
    for path in (CONFIG / 'advanced.yaml', CONFIG / 'jackal.yaml', pathlib.Path(plant)):
        for section, node in yaml.safe_load(path.read_text()).items():
            values.update({'{}.{}'.format(section, key): value for key, value in node.items()} if isinstance(node, dict) else {})
    return Limits(values, effective_track=values['robot.effective_track'], robot_dead_time=values['plant.dead_time'],
                  robot_acceleration=values['plant.acceleration_limit'])


def allowed_standstill(expectation, limits, onset):
    """Longest time from the onset to standstill [s]: 1.2 x (configured time until the brake begins + time to brake, the gate's or the
    robot's own where its motors are slower), plus the robot's dead time, which no controller can shorten."""
    gate = min(limits.gate['brake.time'], max(abs(onset.forward) / limits.gate['brake.linear_deceleration'],
                                              abs(onset.yaw_rate) / limits.gate['brake.angular_deceleration']))
    robot = (abs(onset.forward) + 0.5 * limits.effective_track * abs(onset.yaw_rate)) / limits.robot_acceleration
    return MARGIN * (expectation.within + max(gate, robot)) + limits.robot_dead_time


class Verdict:
    """Figures of a run, and `failures`: what was not as it has to be."""

    def __init__(self, scenario, record, limits):
        self.scenario, self.record, self.limits = scenario, record, limits
        self.failures, self.figures = [], dict.fromkeys(COLUMNS[3:13])
        if record.breakdown:
            self._fail(False, record.breakdown)
        if not (record.truth and record.commands and record.states):
            self._fail(False, 'nothing was recorded')
            return
        self._motion()
        self._commands()
        self._detection()
        self._outcome()

    def row(self):
        """A row of the table."""
        history = [state for before, state in zip([None] + self.record.states, self.record.states) if before is None or before.text != state.text]
        cells = dict({name: '' if value is None else value if isinstance(value, str) else '{:.3f}'.format(value)
                      for name, value in self.figures.items()},
                     scenario=self.scenario.name, faults='; '.join(str(fault) for fault in self.scenario.faults),
                     expected=self.scenario.expectation.outcome, result='failed' if self.failures else 'passed',
                     failures='; '.join(self.failures), history=', '.join('{:.2f} s {}'.format(s.time, s.text) for s in history))
        return {name: ' '.join(cells[name].split()) for name in COLUMNS}  # one line: the file is read while it grows

    def _fail(self, good, words, *values):
        if not good:
            self.failures.append(words.format(*values))

    def _motion(self):
        run, expectation, truth = self.scenario, self.scenario.expectation, numpy.array(self.record.truth)
        onset = self.record.truth[max(0, numpy.count_nonzero(truth[:, 0] <= run.onset) - 1)]
        later = truth[truth[:, 0] > run.onset]
        over = numpy.max([numpy.zeros(2), *(abs(later[:, 1:]) - numpy.maximum(numpy.abs(onset[1:]), numpy.abs(run.set_point)))], axis=0)
        until = later[later[:, 0] <= run.clear()]
        moves = numpy.flatnonzero((abs(until[:, 1:]) >= STILL).any(axis=1))
        first = moves[-1] + 1 if len(moves) else 0  # sample at which it stands for good
        standstill = until[first, 0] - run.onset if first < len(until) else None
        distance = numpy.sum((abs(until[:, 1]) * numpy.diff(until[:, 0], prepend=onset.time))[:first + 1])
        allowed = allowed_standstill(expectation, self.limits, onset)
        self.figures.update(distance_m=distance, standstill_s=standstill, overspeed_mps=over[0], yaw_overspeed_radps=over[1],
                            allowed_s=allowed if expectation.outcome == 'stops' else None)
        self._speed('at the onset', run.onset, run.set_point)
        self._fail(over[0] <= expectation.overspeed, 'overspeed {:.2f} m/s, allowed {:.2f}', over[0], expectation.overspeed)
        turn = 2.0 * expectation.overspeed / self.limits.effective_track
        self._fail(over[1] <= turn, 'yaw rate {:.2f} rad/s too high, allowed {:.2f}', over[1], turn)
        if expectation.outcome == 'stops':
            self._fail(standstill is not None, 'the robot does not stop')
            self._fail(standstill is None or standstill <= allowed, 'standstill after {:.2f} s, allowed {:.2f}', standstill or 0.0, allowed)

    def _commands(self):
        commands, gate = numpy.array(self.record.commands, float), self.limits.gate
        wheels, fresh = commands[:, 1:3], commands[:, 3] > 0.0
        if not numpy.isfinite(wheels).all():
            return self._fail(False, 'a drive command is not finite')
        self._fail(not wheels[fresh].any(), 'an old motion goes on after a fresh start')
        body = self.limits.body(wheels)
        limit_use = max(numpy.max(abs(body) / [gate['limits.linear_speed'], gate['limits.angular_speed']]),
                        numpy.max(abs(wheels)) / gate['limits.wheel_speed'])
        # Periods in which nothing was sent (a stall) may be made up for.
        periods = numpy.maximum(1.0, numpy.round(numpy.diff(commands[:, 0]) / self.limits.action_period))[:, None]
        steps, changes = (abs(numpy.diff(values, axis=0) / periods)[~fresh[1:]] for values in (wheels, body))
        bounds = self.limits.action_period * numpy.array([gate['limits.linear_acceleration'] or math.inf,
                                                          gate['limits.angular_acceleration'] or math.inf])
        step, acceleration_use = numpy.max(steps, initial=0.0), numpy.max(changes / bounds, initial=0.0)
        self.figures.update(command_step_radps=step, acceleration_use=acceleration_use, limit_use=limit_use)
        self._fail(limit_use <= 1.0 + ROUNDING, 'a drive command is {:.2f} of the limits', limit_use)
        self._fail(acceleration_use <= 1.0 + ROUNDING, 'drive command steps by {:.2f} rad/s in one period, {:.2f} of the limit', step,
                   acceleration_use)

    def _detection(self):
        expectation, onset, states = self.scenario.expectation, self.scenario.onset, self.record.states
        if expectation.detected_by == 'tolerated':
            self.figures['told'] = 'tolerated'
            return
        before = next((state for state in reversed(states) if state.time <= onset), states[0])

        def told(state):
            if expectation.detected_by == 'state':
                return state.text if any(reason in state.text for reason in expectation.reasons) else ''
            name = 'rejected_' + expectation.detected_by
            more = getattr(state, name) - getattr(before, name)
            return '{} {} rejected'.format(more, expectation.detected_by.replace('_', ' ')) if more > 0 else ''

        first = next((state for state in states if state.time > onset and told(state)), None)
        if first is None:
            last = next((state.text for state in reversed(states) if state.time <= self.scenario.clear()), '')
            return self._fail(False, "undetected; the controller last said '{}'", last)
        after = first.time - onset
        self.figures.update(detected_s=after, told=told(first))
        self._fail(not 0.0 < expectation.detected_within < after, 'told after {:.2f} s, allowed {:.2f}', after, expectation.detected_within)

    def _outcome(self):
        run, states = self.scenario, [state for state in self.record.states if state.time > self.scenario.onset]
        stays = run.expectation.outcome == 'stops' and not run.expectation.recovers
        if run.expectation.outcome == 'drives':
            stopped = next((state.text for state in states if not state.driving), None)
            self._fail(stopped is None, "the drive is interrupted: '{}'", stopped)
        if run.expectation.outcome == 'resumes':  # a fault stays until it is acknowledged, also one that came and went at rest
            latched = next((state.text for state in states if state.text.startswith('faulted')), None)
            self._fail(latched is None, "latched: '{}'", latched)
            self._fail(self.record.states[-1].driving, "does not drive at the end: '{}'", self.record.states[-1].text)
        self._speed('at the end', self.record.truth[-1].time, (0.0, 0.0) if stays else run.set_point)

    def _speed(self, when, end, expected):
        """The mean motion over a window that ends at a time [s]."""
        window = numpy.array([sample for sample in self.record.truth if end - WINDOW <= sample.time <= end])
        if not len(window):
            return self._fail(False, 'nothing was recorded {}', when)
        for mean, wanted, unit in zip(window[:, 1:].mean(axis=0), expected, ('m/s', 'rad/s')):
            self._fail(abs(mean - wanted) <= self.scenario.expectation.tolerance * max(abs(wanted), SMALLEST),
                       '{:.2f} {}, expected {:.2f}, {}', mean, unit, wanted, when)
