"""Trials of gains: margins by the certificate, and drives from rest to a set point and back. On nominal robots, on
robots that differ from their model, and with coarse encoders and late samples."""

import functools
import math
import types
import typing

import jackal_aic

import engine
import motions
import stops
from draws import Draws

SPEED = 0.5  # m/s of the step whose settling time counts
DRIVE, STAND = 4.0, 3.0  # s; half the limit of the ground's motors reaches 2 m/s in 2.5 s
RESERVE = 0.9  # part of a bar above which penalties begin
LIMITS = {'limits.linear_acceleration': 20.0, 'limits.angular_acceleration': 25.0}  # of the robot, which the thesis' runs do not have

# Set points (speed, yaw rate); robots that differ from their model (dead time + s, lag, gain, acceleration limit x); encoders; largest
# delay of a sample [s]. Bars of the nominal robot, and of one that differs from its model.
SET_POINTS = ((0.1, 0.0), (0.3, 0.0), (0.5, 0.0), (1.0, 0.0), (1.5, 0.0), (2.0, 0.0), (0.0, 0.5), (0.0, 2.0), (0.5, 0.5), (1.0, 2.0))
SPREAD = {'dead time + 10 ms': (0.01, 1.0, 1.0, 1.0), 'dead time - 10 ms': (-0.01, 1.0, 1.0, 1.0), 'lag x 1.4': (0.0, 1.4, 1.0, 1.0),
          'lag x 0.7': (0.0, 0.7, 1.0, 1.0), 'gain x 1.05': (0.0, 1.0, 1.05, 1.0), 'gain x 0.95': (0.0, 1.0, 0.95, 1.0),
          'limit x 0.5': (0.0, 1.0, 1.0, 0.5), 'limit x 2': (0.0, 1.0, 1.0, 2.0)}
STEPS, NOISE, LATEST = (0.0065, 0.06, 0.1), (0.0, 0.003, 0.03), 0.010
BARS, SPREAD_BARS = {'beyond_mps': 0.03, 'beyond_radps': 0.05, 'ripple': 0.1}, {'beyond_mps': 0.10, 'beyond_radps': 0.15, 'ripple': 0.1}
MISSED = {'overshoot_pct': 'overshoots by {:.4g} % (at most {:.4g})', 'beyond_mps': 'runs back with {:.4g} m/s after the stop',
          'beyond_radps': 'turns back with {:.4g} rad/s after the stop', 'ripple': 'its command ripples by {:.4g} rad/s'}


class Robot(typing.NamedTuple):
    """A robot for the trials: its name, its argument of simulate(), and its values of plant.*."""

    name: str
    plant: str
    values: dict


class Task(typing.NamedTuple):
    """A search: from a preset or file, on robots, within bars. orders: of the thesis' structure, from and to."""

    start: str
    robots: tuple
    gain_margin: float = 2.0
    delay_margin: float = 0.05
    overshoot: float = 10.0
    orders: tuple = (1, 2)
    linear_evaluations: int = 4000
    evaluations: int = 40
    draws: int = 50
    seed: int = 1
    limits: dict = LIMITS

    def gains(self):
        return engine.settings(self.robots[0].plant, self.start)['controller']

    def predictive(self):
        return 'reference_time' in self.gains()


class Trial(typing.NamedTuple):
    """From rest to a set point and back. nominal: the robot equals its model."""

    robot: Robot
    set_point: tuple
    overrides: dict
    bars: dict
    name: str
    nominal: bool = False

    def searched(self):
        """True for the step whose settling time counts."""
        return self.nominal and self.set_point == (SPEED, 0.0)


class Assessment(typing.NamedTuple):
    """Assessment of gains. robots: figures of each; missed: texts, margins first; worst: failed trials, the worst
    first."""

    gains: dict
    robots: tuple
    missed: tuple
    worst: tuple

    def settling(self):
        return max(robot['settling'][1] for robot in self.robots)


# ---- what is driven

def varied(plant, dead_time=0.0, lag=1.0, gain=1.0, limit=1.0, offset=0.0):
    return {'plant.dead_time': max(0.0, plant['dead_time'] + dead_time), 'plant.motor_lag': plant['motor_lag'] * lag,
            'plant.wheel_gain': plant['wheel_gain'] * gain, 'plant.wheel_offset': max(0.0, plant['wheel_offset'] + offset),
            'plant.acceleration_limit': plant['acceleration_limit'] * limit}


def confidence_box(task, robot):
    """The corners of the confidence box of a robot's model, as SPREAD, with the change of the motors' offset."""
    model, *corners = (loop.robot for loop in jackal_aic.linear_loops(robot.plant, task.start))
    found = {}
    for corner in corners:
        lag, gain = (corner[key] / model[key] if model[key] > 0.0 else 1.0 for key in ('lag', 'gain'))
        found['dead time {dead_time:.3g} s, lag {lag:.3g} s, gain {gain:.3g}, offset {offset:.3g} rad/s'.format(**corner)] = (
            corner['dead_time'] - model['dead_time'], lag, gain, 1.0, corner['offset'] / corner['gain'] - model['offset'] / model['gain'])
    return {name: corner for name, corner in found.items() if corner != (0.0, 1.0, 1.0, 1.0, 0.0)}


def trials(task, robot):
    """Every trial of a robot. Nominal over the phase of the timers; coarse encoders with late samples; its spread and
    the corners of its confidence box at the worst end of the phase; random ones."""
    plant, latest, found = robot.values, 1.0 / robot.values['sensor_rate'] - motions.TICK, []

    def add(set_point, words, overrides, phase=latest, nominal=False, unseen=0.0):
        bars = dict(BARS if nominal else SPREAD_BARS, overshoot_pct=task.overshoot * (1.0 if nominal else 1.5) + unseen)
        point = ''.join(', {:.4g} {}'.format(value, unit) for value, unit in zip(set_point, ('m/s', 'rad/s')) if value)
        found.append(Trial(robot, set_point, dict(overrides, **{'loop.phase': phase}), bars, robot.name + point + ', ' + words, nominal))

    for phase in (latest, 0.0, 0.5 * latest):
        for point in SET_POINTS:
            add(point, 'phase {:.4g} s'.format(phase), {}, phase, True)
    for step in STEPS:
        for point in ((0.1, 0.0), (0.7, 0.0), (0.3, 0.7)):  # the encoder does not resolve a part of the set point
            add(point, 'encoder steps of {:.4g} rad/s, late samples'.format(step), {
                'plant.encoder_step': step, 'plant.encoder_noise': 0.003, 'plant.stamp_jitter': LATEST}, 0.5 * latest,
                unseen=10.0 * step / max(point[0], 0.1))
    for name, variant in {**SPREAD, **confidence_box(task, robot)}.items():
        for point in ((0.3, 0.0), (1.0, 0.0), (0.5, 1.0)):
            add(point, name, varied(plant, *variant))
    draw = Draws(task.seed)
    for i in range(task.draws):
        point, phase, step = draw.one_of(SET_POINTS), draw.between(0.0, latest), draw.one_of((0.0, 0.0131) + STEPS)
        drawn = varied(plant, draw.between(-0.01, 0.01), draw.between(0.7, 1.4), draw.between(0.95, 1.05), 2.0**draw.between(-1.0, 1.0))
        drawn.update({'plant.encoder_step': step, 'plant.encoder_noise': draw.one_of(NOISE),
                      'plant.stamp_jitter': draw.between(0.0, LATEST), 'plant.seed': task.seed + i})
        add(point, 'draw {}, encoder steps of {:.4g} rad/s'.format(i, step), drawn, phase)
    return found


def first_trials(task):
    """First trials of a candidate: the searched step at both ends of the phase, a turn, a fast step on a slower
    motor, and coarse encoders on an arc."""
    chosen = (((SPEED, 0.0), 'phase 0.0'), ((SPEED, 0.0), 'phase 0 '), ((0.0, 2.0), 'phase 0.0'), ((1.0, 0.0), 'lag x 1.4'), ((0.3, 0.7), 'of 0.06'))
    listed = [trials(task._replace(draws=0), robot) for robot in task.robots]
    return [next(trial for trial in of_robot if trial.set_point == point and words in trial.name) for point, words in chosen for of_robot in listed]


def drive(task, gains, trial):
    """Figures of a trial (stops.assess()). `predictive` learns the slip of an arc in a first drive, and is assessed in
    the second."""
    motion = motions.stop(*trial.set_point, DRIVE, STAND)
    begin = motion.duration if task.predictive() and all(trial.set_point) else 0.0
    again = tuple((begin + time, *point) for time, *point in motion.set_points) if begin else ()
    motion = motion._replace(set_points=motion.set_points + again, duration=motion.duration + begin)
    found = engine.drive(trial.robot.plant, task.start, motion, {**task.limits, **gains, **trial.overrides})
    columns = {name: column[found.time >= begin] for name, column in found.columns().items()}
    return stops.assess(types.SimpleNamespace(**dict(columns, time=columns['time'] - begin)), *trial.set_point, DRIVE)


# ---- what gains are worth

def penalty(bars, figures):
    """Penalty [s]: one second for every missed bar, in proportion to its excess, and a small part just below the
    bar."""
    parts = [(figures[name] / (RESERVE * bar), figures[name] <= bar) for name, bar in bars.items()]
    return sum(part - kept for part, kept in parts if part > 1.0) + (2.0 if figures['settling_s'] is None else 0.0)


def missed_bar(bars, figures):
    """Text of the first missed figure; empty if every bar is kept."""
    words = [MISSED[name].format(figures[name], bars[name]) for name in MISSED if not figures[name] <= bars[name]]
    return 'never settles' if figures['settling_s'] is None else words[0] if words else ''


def loops_of(task, robot, gains):
    return jackal_aic.linear_loops(robot.plant, task.start, gains)


def assess(task, gains, run=map):
    """Drives every trial. run: as map()."""
    missed, worst, robots = [], [], []
    for robot in task.robots:
        certificates = [loop.certify() for loop in loops_of(task, robot, gains)]
        margins = [min(getattr(certificate, name) for certificate in certificates) for name in ('gain_margin', 'delay_margin')]
        kept = all(certificate.stable for certificate in certificates) and margins[0] >= task.gain_margin and margins[1] >= task.delay_margin
        listed, failed = trials(task, robot), [] if kept else [robot.name + ': margins']
        driven = list(zip(listed, run(functools.partial(drive, task, gains), listed)))
        for trial, figures in driven:
            words = missed_bar(trial.bars, figures)
            failed += [trial.name + ': ' + words] if words else []
            worst += [(penalty(trial.bars, figures), trial)] if words else []
        settling = [math.inf if f['settling_s'] is None else f['settling_s'] for trial, f in driven if trial.searched()]
        nominal, others = ({name: max(f[name] for trial, f in driven if trial.nominal == kind) for name in MISSED} for kind in (True, False))
        robots.append({'name': robot.name, 'settling': (min(settling), max(settling)), 'nominal': nominal, 'others': others,
                       'gain_margin': margins[0], 'delay_margin': margins[1], 'missed': len(failed)})
        missed += failed
    return Assessment(gains, tuple(robots), tuple(missed), tuple(trial for _, trial in sorted(worst, key=lambda pair: -pair[0])))
