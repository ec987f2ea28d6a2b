"""From rest to a set point and back to rest, also with other motors than the model's: overshoot and running back of
every preset."""

import numpy

import engine
import motions

DRIVE, STAND, STEADY = 5.0, 4.0, 1.0  # s
UNLIMITED = 20.0  # limit factor of motors without a limit
TRACK_MARGIN = 3.0  # percent
SET_POINTS = ((0.1, 0.0), (0.3, 0.0), (0.5, 0.0), (1.0, 0.0), (1.5, 0.0), (2.0, 0.0), (0.0, 0.5), (0.0, 1.0), (0.0, 2.0), (0.5, 0.5),
              (1.0, 0.5), (1.0, 2.0), (0.3, 1.5), (-1.0, 1.0))
FACTORS = (1.0, 0.9, 0.8, 0.7, 0.5, 2.0)  # of the acceleration limit of the model
LIMITS = {'limits.linear_acceleration': 20.0, 'limits.angular_acceleration': 25.0}
COLUMNS = ('controller', 'plant', 'limit_factor', 'forward_mps', 'yaw_radps', 'excess_pct', 'without_limit_pct', 'settling_s',
           'beyond_mps', 'beyond_radps', 'kept')


def channel_figures(drive, values, set_point, stop):
    """Settling [s], excess over the set point [%] and excess beyond zero after the stop, of one channel."""
    steady = values[(drive.time >= stop - STEADY) & (drive.time < stop)]
    end, along, driven = float(numpy.mean(steady)), values / set_point, drive.time <= stop
    late = drive.time[driven & (numpy.abs(values - end) > 0.05 * abs(set_point))]
    settled = float(late[-1]) if len(late) else motions.REST
    largest = float(numpy.max(along[driven]))
    return {'settling_s': settled - motions.REST if settled < stop - STEADY else None,
            'overshoot_pct': max(0.0, 100.0 * (largest - max(1.0, end / set_point))), 'excess_pct': max(0.0, 100.0 * (largest - 1.0)),
            'beyond': max(0.0, float(numpy.max(-along[~driven] * abs(set_point))))}


def worse(one, other):
    """The worse of two figures; None, a response that never settles, is the worst."""
    return None if one is None or other is None else max(one, other)


def ripple(drive, stop):
    """Root mean square of a wheel's command about its mean before the stop and at rest [rad/s]."""
    windows = [(drive.time >= end - STEADY) & (drive.time < end) for end in (stop, float(drive.time[-1]))]
    return max(float(numpy.std(command[window])) for window in windows for command in (drive.command_left, drive.command_right))


def assess(drive, forward, yaw_rate, driven=DRIVE):
    """Figures of a drive to a set point for some time [s] and back to rest, each of the worse channel."""
    stop = motions.REST + driven - 0.5 * motions.TICK
    figures = {'settling_s': 0.0, 'overshoot_pct': 0.0, 'excess_pct': 0.0, 'beyond_mps': 0.0, 'beyond_radps': 0.0}
    for values, set_point, beyond in ((drive.speed, forward, 'beyond_mps'), (drive.yaw_rate, yaw_rate, 'beyond_radps')):
        if set_point != 0.0:
            found = channel_figures(drive, values, set_point, stop)
            figures[beyond] = found.pop('beyond')
            figures.update({name: worse(figures[name], value) for name, value in found.items()})
    return dict(figures, ripple=ripple(drive, stop))


def driven(case, overrides):
    controller, plant, factor, forward, yaw_rate = case
    overrides = dict(LIMITS, **overrides)
    limit = engine.settings(plant, controller, overrides)['plant']['acceleration_limit']
    drive = engine.drive(plant, controller, motions.stop(forward, yaw_rate, DRIVE, STAND),
                         dict(overrides, **{'plant.acceleration_limit': factor * limit}))
    return assess(drive, forward, yaw_rate)


def bars(controller, factor):
    """Bars: largest excess over the set point [%], and running back after the stop [m/s, rad/s]; more on weak
    motors."""
    if factor < 1.0:
        return 15.0, 0.10, 0.15
    return {'predictive': 5.0, 'standard': 12.0}.get(controller, 10.0), 0.03, 0.05


def kept(row):
    excess, beyond_mps, beyond_radps = bars(row['controller'], row['limit_factor'])
    if row['without_limit_pct'] > 0.0:
        excess = max(excess, row['without_limit_pct'] + TRACK_MARGIN)
    return row['excess_pct'] <= excess and row['beyond_mps'] <= beyond_mps and row['beyond_radps'] <= beyond_radps


def row(item):
    case, overrides = item
    controller, plant, factor, forward, yaw_rate = case
    found = dict(zip(COLUMNS, case), without_limit_pct=0.0, **driven(case, overrides))
    if plant == 'ground' and yaw_rate != 0.0:
        found['without_limit_pct'] = driven((controller, plant, UNLIMITED, forward, yaw_rate), overrides)['excess_pct']
    found['kept'] = kept(found)
    return found


def cases():
    return [(controller, plant, factor, *set_point) for controller in ('standard', 'improved', 'tuned', 'predictive')
            for plant in ('ground', 'box') for factor in FACTORS for set_point in SET_POINTS]


def table(chosen=None, overrides=None, jobs=0):
    return engine.parallel(row, [(case, overrides or {}) for case in chosen or cases()], jobs, 'stops')


def write(out, overrides, jobs=0):
    """Returns how many cases do not keep their bars."""
    rows = table(None, overrides, jobs)
    engine.save(out, 'stops.csv', rows, COLUMNS)
    missed = sum(not r['kept'] for r in rows)
    print('{} of {} do not keep their bars'.format(missed, len(rows)))
    return missed
