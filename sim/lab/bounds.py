"""Every preset relative to a bound that no controller can beat on a robot with this dead time, acceleration limit and
sampling.

Settling to within 5 % of a step of the wheels' circumference speed by dv: nothing happens for the dead time, and after it the speed
changes at most with the acceleration limit a,

    t >= dead_time + 0.95 dv / a.

In a turn on the ground the body follows its wheels with a lag. There the bound is the time until the simulated robot
turns with 95 % of the set point, with both wheels at full throttle in opposite directions.

Integral of the absolute error (IAE) after a disturbance of the motors at time 0. e_0(t) is the error under an unchanged
command. At t_1 the first action after the first sample with the disturbance has an effect. Then

    IAE >= int_0^t1 |e_0| dt + e_0(t_1)^2 / (2 a):

any preparation before t_1 costs as much under the opposite disturbance, and after t_1 the speed changes at most with a.
This table has no noise, which would only add to both sides.
"""

import functools
import math
import typing

import jackal_aic
import numpy

import engine
import metrics
import motions

PERIOD = 0.02  # s, between samples and between actions
BAND = 0.95
SETTLED, DISTURBED = 4.0, 2.0  # s of driving before and after a disturbance
MOMENTS = (0.0, 0.005, 0.010, 0.015)  # s, of a disturbance after a sample
QUIET = {'plant.noise_scale': 0.0}
COLUMNS = ('controller', 'plant', 'case', 'figure', 'value', 'bound', 'of_bound', 'bar')


class Case(typing.NamedTuple):
    """A step from rest, or a fault of the motors ('gain', 'offset') with its value while driving."""

    name: str
    forward: float = 0.0
    yaw_rate: float = 0.0
    fault: typing.Optional[str] = None
    value: float = 0.0


CASES = (Case('0.1 m/s', 0.1), Case('0.5 m/s', 0.5), Case('1 m/s', 1.0), Case('2 m/s', 2.0), Case('0.5 rad/s', 0.0, 0.5),
         Case('1 rad/s', 0.0, 1.0), Case('2 rad/s', 0.0, 2.0), Case('gain 0.8', 0.5, 0.0, 'gain', 0.8),
         Case('gain 1.2', 0.5, 0.0, 'gain', 1.2), Case('load of 0.5 rad/s', 0.5, 0.0, 'offset', 0.5))


class Apart(jackal_aic.VelocityController):
    """Full throttle in opposite directions."""

    rate = 1000.0

    def __init__(self, speed):
        self.speed = speed

    def act(self, set_point, observation):
        return -self.speed, self.speed


def least_turn(plant, yaw_rate):
    """The time at which the body turns with 95 % of a yaw rate at full throttle [s]."""
    values = engine.settings(plant, 'diff_drive', QUIET)
    fastest = math.copysign(values['plant']['speed_limit'] / values['geometry']['wheel_radius'], yaw_rate)
    turn = engine.drive(plant, Apart(fastest), motions.Motion(((0.0, 0.0, yaw_rate),), motions.STEP_TIME), QUIET)
    there, begins = turn.yaw_rate / yaw_rate >= BAND, turn.command_right != 0.0
    return float(turn.time[numpy.argmax(there)] - turn.time[numpy.argmax(begins)])


def least_settling(plant, case):
    values = engine.settings(plant, 'diff_drive', QUIET)
    if case.yaw_rate and plant == 'ground':
        return least_turn(plant, case.yaw_rate)
    change = case.forward or 0.5 * values['geometry']['effective_track'] * case.yaw_rate
    return values['plant']['dead_time'] + BAND * abs(change) / values['plant']['acceleration_limit']


def least_iae(error, t_1, limit):
    """error: e_0 in ticks from the disturbance on [m/s]; limit: a [m/s^2]."""
    end = int(round(t_1 / motions.TICK))
    return metrics.iae(error[:end]) + error[end]**2 / (2.0 * limit)


def error_after(plant, controller, case, start):
    """Forward error from a disturbance on [m/s]."""
    motion = motions.step(case.forward, 0.0, start + DISTURBED - motions.REST)
    motion = motion._replace(faults=(jackal_aic.Fault(case.fault, start, value=case.value),))
    drive = engine.drive(plant, controller, motion, QUIET)
    return (drive.speed - drive.set_speed)[drive.time > start - 1e-9]


def mean_over_moments(figure):
    return sum(figure(motions.REST + SETTLED + moment, moment) for moment in MOMENTS) / len(MOMENTS)


@functools.lru_cache(maxsize=None)
def bound(plant, case):
    if not case.fault:
        return least_settling(plant, case)
    values = engine.settings(plant, 'diff_drive', QUIET)['plant']
    return mean_over_moments(lambda start, moment: least_iae(error_after(plant, 'diff_drive', case, start),
                                                             PERIOD - moment + values['dead_time'], values['acceleration_limit']))


def value(plant, controller, case):
    """Settling time [s], None if it does not settle; or IAE over 2 s [m], mean over the moments. Without noise."""
    if not case.fault:
        motion = motions.step(case.forward, case.yaw_rate)
        return metrics.response(engine.drive(plant, controller, motion, QUIET), motion)['settling_s']
    return mean_over_moments(lambda start, _: metrics.iae(error_after(plant, controller, case, start)))


def bar(case, least):
    """The bar of `predictive`: settling time in multiples of the bound and one action period, IAE in multiples of the bound."""
    bars = engine.bars()['bounds']
    return bars['error_after_disturbance'] * least if case.fault else bars['settling'] * least + PERIOD


def row(item):
    controller, plant, case = item
    found, least = value(plant, controller, case), bound(plant, case)
    return {'controller': controller, 'plant': plant, 'case': case.name, 'figure': 'iae_m' if case.fault else 'settling_s',
            'value': found, 'bound': least, 'of_bound': math.inf if found is None else found / least, 'bar': bar(case, least)}


def table(jobs=0, controllers=engine.CONTROLLERS, cases=CASES, plants=engine.PLANTS):
    return engine.parallel(row, [(c, p, case) for c in controllers for p in plants for case in cases], jobs, 'bounds')


def kept(found):
    return found['value'] is not None and found['value'] <= found['bar']


def write(out, jobs=0):
    rows = table(jobs)
    engine.save(out, 'bounds.csv', rows, COLUMNS)
    print('predictive misses {} bars'.format(sum(not kept(r) for r in rows if r['controller'] == 'predictive')))
