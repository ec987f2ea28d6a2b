"""The closed loop of simulated robot and controller."""

import math
import os
import typing

import numpy

from . import _core

_COLUMNS = ('time set_speed set_yaw_rate speed yaw_rate x y heading wheel_left wheel_right measured_speed measured_yaw_rate measured_left '
            'measured_right believed_speed believed_yaw_rate command_left command_right status cause fault counted').split()
_WHOLE = ('status', 'cause', 'fault', 'counted')
_ODOMETRY = ('odometry_x odometry_y odometry_heading odometry_speed odometry_yaw_rate odometry_speed_variance odometry_covariance '
            'odometry_yaw_rate_variance believed_speed_variance believed_covariance believed_yaw_rate_variance '
            'wheel_position_left wheel_position_right').split()


class Fault(typing.NamedTuple):
    """A fault of the robot or of its sensors, or something that is done to it.

    kind: of a sensor 'freeze', 'bias', 'scale', 'set', 'huge', 'not_a_number', 'infinite', 'upside_down' (the IMU), or 'lost'
          (not measured); of the robot 'blocked' (wheels), 'push', 'lift'; from the start on for good 'friction' (coefficient of
          the ground), 'gain' (of the motors) and 'offset' (by which they turn slower [rad/s]).
    start: [s]
    channel: 'left', 'right', 'gyro', 'acceleration' or 'all' (encoders and gyro); of 'blocked' 'left', 'right' or 'all'; of 'push'
          'forward' [N] or 'yaw_rate' [N m].
    value: of 'bias' and 'set' in the unit of the channel, of 'scale' a factor, of 'push' a force or torque, of 'friction', 'gain'
          and 'offset' the new value.
    duration: [s]
    """

    kind: str
    start: float = 0.0
    channel: str = 'all'
    value: float = 0.0
    duration: float = math.inf


_SENSORS = ('left', 'right', 'gyro', 'acceleration', 'all')
_CHANNELS = dict(dict.fromkeys(('freeze', 'bias', 'scale', 'set', 'huge', 'not_a_number', 'infinite', 'upside_down', 'lost'), _SENSORS),
                 blocked=('left', 'right', 'all'), push=('forward', 'yaw_rate'), lift=('all',), friction=('all',), gain=('all',), offset=('all',))

# Acceleration of the thesis' differential drive [m/s^2], implied by its Table 3-1. On the same ground the active inference controller
# accelerates from 0.1 to 0.9 m/s in 0.45 s, so the motors reach 1.8 m/s^2. The differential drive needs 0.62 s, and 0.35 s from 0.05 to
# 0.45 m/s: 1.3 and 1.1 m/s^2. Its commands are limited to less than the 20 m/s^2 of the published settings of a Jackal
# (config/diff_drive.yaml). The value has the least error over Table 3-1b, of 1.0 to 1.6 in steps of 0.1. The 0.1 m/s row contradicts it:
# 0.04 s are 2 m/s^2.
THESIS_DRIVE_ACCELERATION = 1.2
_PRINTED = {'predictive': {}, 'diff_drive': {'diff_drive.linear_acceleration': THESIS_DRIVE_ACCELERATION}}


def _require(good, words, *values):
    if not good:
        raise ValueError(words.format(*values))


def _check(points, faults, duration):
    """Raises ValueError for what cannot be driven."""
    _require(0.0 < duration <= 3600.0, 'duration = {:g}: must be above 0 and at most 3600 s', duration)
    _require(points, 'set_points = []: must hold at least one')
    before = -math.inf
    for i, (time, speed, yaw_rate) in enumerate(points):
        _require(0.0 <= time < duration, 'set_points[{}]: time = {:g}: must be in [0, {:g}) s, the duration', i, time, duration)
        _require(time > before, 'set_points[{}]: time = {:g}: must be later than that before it, {:g} s', i, time, before)
        _require(abs(speed) <= 10.0, 'set_points[{}]: speed = {:g}: must be within +-10 m/s', i, speed)
        _require(abs(yaw_rate) <= 50.0, 'set_points[{}]: yaw rate = {:g}: must be within +-50 rad/s', i, yaw_rate)
        before = time
    for kind, start, channel, value, length in faults:
        _require(kind in _CHANNELS, "fault '{}': unknown; known: {}", kind, ', '.join(_CHANNELS))
        _require(channel in _CHANNELS[kind], "fault '{}': channel = '{}': must be one of {}", kind, channel, ', '.join(_CHANNELS[kind]))
        _require(start >= 0.0, "fault '{}': start = {:g}: must be 0 s or more", kind, start)
        _require(length > 0.0, "fault '{}': duration = {:g}: must be above 0 s", kind, length)
        _require(math.isfinite(value), "fault '{}': value = {:g}: must be finite", kind, value)
        _require(kind not in ('friction', 'gain', 'offset') or length == math.inf, "fault '{}': duration = {:g}: it lasts", kind, length)


class VelocityController:
    """A controller written in Python: inherit from it and write act().

    rate: calls of act() per second [Hz], a divisor of 1000.
    applied: wheel speeds (left, right) [rad/s] that the robot was really given in the last period, after the limits.
    believed: speed and yaw rate (x_dot, theta_dot) [m/s, rad/s] that act() may set, for the columns of the drive; else None.
    """

    rate = 50.0
    applied = (0.0, 0.0)
    believed = None

    def reset(self):
        """Forgets the motion; called before the first act() of each drive, and after the clock ran back."""

    def act(self, set_point, observation):
        """Wheel speeds (left, right) [rad/s] to drive for 1/rate.

        set_point: SetPoint, the desired velocity. observation: the last Observation; what is not in its `valid` does not count.
        """
        raise NotImplementedError('act(set_point, observation) of a VelocityController')


class StepResponse(typing.NamedTuple):
    """Figures of a step response, as the thesis defines them (chapter 5); without any if it is not bounded.

    settling_time: after the step until the signal stays within 5 % of its final value [s]; None if it never does.
    rise_time: from 10 % to 90 % of the set point [s]; None if 90 % is never reached.
    overshoot: beyond the set point; steady_error: mean of the last 0.5 s, positive if too fast; both in percent of the step.
    bounded: the signal is finite and within three steps of the set point.
    """

    settling_time: typing.Optional[float]
    rise_time: typing.Optional[float]
    overshoot: float
    steady_error: float
    bounded: bool

    def __repr__(self):
        times = ['never' if time is None else '{:.3f} s'.format(time) for time in self[:2]]
        return '<StepResponse settling {}, rise {}, overshoot {:.2f} %, steady error {:.2f} %>'.format(*times, *self[2:4])


_FINAL = 0.5  # s at the end of a response, over which its final value is the mean


def _settling_time(time, error, band):
    """Time [s] from which the error stays within a band, interpolated; None if the error leaves it in the final window."""
    outside = numpy.flatnonzero(numpy.abs(error) > band)
    if not len(outside):
        return 0.0
    last = outside[-1]
    if time[last] >= time[-1] - _FINAL:
        return None
    before, after = abs(error[last]), math.copysign(1.0, error[last]) * error[last + 1]
    return float(time[last] + (before - band) / (before - after) * (time[last + 1] - time[last]))


def _crossing(time, value, level):
    """Time [s] at which a value first reaches a level from below, interpolated."""
    i = int(numpy.argmax(value >= level))
    return time[0] if i == 0 else time[i - 1] + (level - value[i - 1]) / (value[i] - value[i - 1]) * (time[i] - time[i - 1])


def step_response(time, value, step_time, initial, set_point, settling_band=0.05):
    """StepResponse of a step from initial to set_point at step_time [s].

    time: stamps [s], increasing, shape (n,). value: the signal at these times, shape (n,), in the unit of the set points.
    settling_band: share of the final value. Raises ValueError if the series differ in length, span less than 0.5 s after the step, or
    the step is zero.
    """
    time, value = numpy.asarray(time, float), numpy.asarray(value, float)
    _require(len(time) == len(value), 'step response: time and value differ in length')
    _require(set_point != initial, 'step response: the step is zero')
    begin = numpy.searchsorted(time, step_time)
    time, value = time[begin:] - step_time, (value[begin:] - initial) / (set_point - initial)
    _require(len(time) and time[-1] >= _FINAL, 'step response: less than 0.5 s recorded after the step')
    if not numpy.all(numpy.abs(value - 1.0) <= 3.0):
        return StepResponse(None, None, 0.0, 0.0, False)
    final, largest = float(numpy.mean(value[time >= time[-1] - _FINAL])), float(numpy.max(value))
    # The band is relative to the final value, so it needs one beyond the band.
    settling = _settling_time(time, value - final, settling_band * abs(final)) if abs(final) > settling_band else None
    rise = float(_crossing(time, value, 0.9) - _crossing(time, value, 0.1)) if largest >= 0.9 else None
    return StepResponse(settling, rise, 100.0 * max(0.0, largest - 1.0), 100.0 * (final - 1.0), True)


class Drive:
    """A simulated drive: columns of numpy arrays, one value per millisecond, as attributes. Body axes: x forward, y left.

    time [s]; set_speed [m/s], set_yaw_rate [rad/s]: the set point.
    speed, yaw_rate: of the robot, true; on the box, those of its wheels. x, y [m], heading [rad]: its pose, true.
    wheel_left, wheel_right [rad/s]: true mean wheel speeds. command_left, command_right [rad/s]: the command.
    measured_speed, measured_yaw_rate, measured_left, measured_right: by the last sample of wheels and gyro.
    believed_speed, believed_yaw_rate: of the controller; NaN without a belief.
    status, cause, fault: whole numbers, the places of their words in STATUSES, CAUSES and FAULTS.
    counted: 1 where every channel of the last sample counted, else 0.
    With odometry=True: odometry_x, odometry_y [m], odometry_heading [rad], odometry_speed, odometry_yaw_rate, as the node publishes
    them, with the covariance of the motion (odometry_speed_variance, odometry_covariance, odometry_yaw_rate_variance); that of
    `predictive`'s belief (believed_speed_variance, believed_covariance, believed_yaw_rate_variance; else NaN);
    wheel_position_left, wheel_position_right [rad], measured.

    events: a list of (time, text) of each change of status, cause or fault, in the words of the node's log.
    findings: a list of (time, text, whether it is a fault) of each change of what the fault detection finds; '' is nothing.
    set_points: a list of (time, speed, yaw rate), as they were driven.
    effective_track, plant_model: that `predictive` believes in at the end [m], and its model of the drive train, a dict of the keys
    of plant_model.*; None for other controllers.
    """

    def __init__(self, columns, events, set_points, findings=(), effective_track=None, plant_model=None):
        self.__dict__.update(columns)
        self._names = tuple(columns)
        self.events = events
        self.set_points = set_points
        self.findings = findings
        self.effective_track = effective_track
        self.plant_model = plant_model

    def columns(self):
        """The columns by name, as pandas.DataFrame() takes them."""
        return {name: getattr(self, name) for name in self._names}

    def response(self, channel='speed'):
        """StepResponse of the last step of a channel's set point: 'speed' or 'yaw_rate'.

        Raises ValueError if the set point of the channel never changes, or the drive ends within 0.5 s of it.
        """
        places = {'speed': 1, 'yaw_rate': 2}
        if channel not in places:
            raise ValueError("channel = '{}': must be speed or yaw_rate".format(channel))
        before, step = 0.0, None
        for point in self.set_points:
            value = point[places[channel]]
            if value != before:
                step = (point[0], before, value)
            before = value
        if step is None:
            raise ValueError("channel = '{}': its set point never changes".format(channel))
        return step_response(self.time, getattr(self, channel), *step)

    def settling_time(self, channel='speed'):
        """Time after the last step until the channel stays within 5 % of its final value [s]; None if it never does."""
        return self.response(channel).settling_time

    def __repr__(self):
        return '<Drive of {:g} s to {:.3f} m/s and {:.3f} rad/s: {}>'.format(
            len(self.time) * 1e-3, self.speed[-1], self.yaw_rate[-1], '; '.join('{:.2f} s {}'.format(*e) for e in self.events))


def simulate(robot, controller, set_points, *, duration=3.0, faults=(), seed=None, overrides=None, monitor=None, as_printed=False,
             samples_only=False, odometry=False):
    """Drives the simulated robot and returns a Drive. The same arguments give the same drive.

    robot: 'ground', 'box' (wheels in the air), 'real' (with the flaws of a real robot), or the path of a YAML file.
    controller: a name or path of a YAML file, driven without deadlines as in the thesis' experiments ('predictive', 'improved',
        'standard', 'tuned', 'diff_drive'); a VelocityController, driven in the same way; or Parameters, driven as by the node, with its
        deadlines, limits, loss policy and fault detection.
    set_points: (speed, yaw rate) [m/s, rad/s], a step after 0.5 s of rest; or a list of (time, speed, yaw rate) in order of
        time [s], each held until the next. The robot rests before the first.
    duration: of the drive [s], at most 3600.
    faults: a Fault or a list of them; a dict with its fields stands for one.
    seed: of noise and ground, a whole number; None: that of the robot's file.
    overrides: values by key, such as {'plant.payload': 10.0, 'plant.dead_time': 0.12, 'plant.wheel_gain': 0.8}. Keys of
        plant.* change the robot (not what a named controller knows of it); a named controller takes its own, too. Its
        plant_model.* do not change the model of the fault detection.
    monitor: the fault detection watches the drive (True, False); None: if there are faults, and with Parameters as they say. A dict
        such as {'identified': False} watches with these values of its plant model.
    as_printed: True drives the thesis' controllers as it prints them, without a bound of their action, and the open loop as it had it.
    samples_only: True keeps the steps in which a sample came, for long drives.
    odometry: True adds the columns of the odometry.
    Raises ValueError for an unknown name (with the list of names), key, type or value, and what the controller's act() raises.
    """
    points = list(set_points)
    if points and not hasattr(points[0], '__len__'):
        points = [(0.5, *points)]
    for point in points:
        if len(point) != 3:
            raise ValueError('set_points: must be (speed, yaw rate) or a list of (time, speed, yaw rate), not {}'.format(set_points))
    points = [tuple(float(value) for value in point) for point in points]
    faults = [faults] if isinstance(faults, (Fault, dict)) else faults
    faults = [tuple(Fault(**fault) if isinstance(fault, dict) else Fault(*fault)) for fault in faults]
    _check(points, faults, duration)
    overrides = dict(overrides or {})
    if as_printed:
        _require(isinstance(controller, (str, os.PathLike)), 'as_printed = True: needs the name or file of a controller')
        overrides = dict(_PRINTED.get(controller, {'controller.printed': True}), **overrides)
    if seed is not None:
        overrides['plant.seed'] = seed
    if isinstance(controller, os.PathLike):
        controller = os.fspath(controller)
    model = monitor if isinstance(monitor, dict) else {}
    table, estimates, events, findings, track, believed_model = _core.simulate(
        os.fspath(robot), controller, points, float(duration), faults, overrides, True if model else monitor, model, samples_only,
        odometry)
    columns = dict(zip(_COLUMNS, table), **dict(zip(_ODOMETRY, estimates) if odometry else ()))
    columns.update((name, columns[name].astype(int)) for name in _WHOLE)
    return Drive(columns, events, points, findings, track, believed_model)
