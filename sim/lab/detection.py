"""Faults that the fault detection finds, their delay, and false alarms in hours of driving without a fault."""

import jackal_aic
import numpy

import engine
import metrics
import motions
import robots

FAULT_TIME, WATCHED = 3.0, 1.0  # s
ORDINARY_SEED, ORDINARY_TIME = 7, 600.0  # s
QUIET_TIME = 1800.0  # s
MOTIONS = {'0.5 m/s': (0.5, 0.0), '1 m/s': (1.0, 0.0), '-0.5 m/s': (-0.5, 0.0), '0.5 rad/s': (0.0, 0.5),
           '0.5 m/s, 0.5 rad/s': (0.5, 0.5)}
_LEFT, _RIGHT = 'left wheels do not follow their command', 'right wheels do not follow their command'
_GYRO = 'gyro disagrees with the wheels'
# Fault: kind, channel, value; what it is called, and on the box, where the gyro cannot tell a dead encoder from a blocked wheel.
FAULTS = {'left encoder frozen': (('freeze', 'left', 0.0), 'left encoder frozen', None),
          'right encoder frozen': (('freeze', 'right', 0.0), 'right encoder frozen', None),
          'left encoder dead': (('set', 'left', 0.0), 'left encoder wrong', _LEFT),
          'gyro bias 0.2 rad/s': (('bias', 'gyro', 0.2), _GYRO, None),
          'gyro bias -0.2 rad/s': (('bias', 'gyro', -0.2), _GYRO, None),
          'gyro frozen': (('freeze', 'gyro', 0.0), 'gyro frozen', None),
          'IMU upside down': (('upside_down', 'all', 0.0), 'IMU upside down', None),
          'left motor blocked': (('blocked', 'left', 0.0), _LEFT, None),
          'right motor blocked': (('blocked', 'right', 0.0), _RIGHT, None)}
CONDITIONS = {'as calibrated': {}, 'noise x 5': {'plant.noise_scale': 5.0}, 'no noise': {'plant.noise_scale': 0.0},
              '10 % of the samples lost': {'plant.measurement_loss': 0.1}, 'friction 0.25': {'plant.friction': 0.25},
              'friction 1': {'plant.friction': 1.0}, '5 deg uphill': {'plant.slope': 5.0}, '10 deg downhill': {'plant.slope': -10.0},
              'payload 8 kg': {'plant.payload': 8.0}}
ON_BOX = ('as calibrated', 'noise x 5', 'no noise', '10 % of the samples lost')
DETECTION_COLUMNS = ('controller', 'plant', 'motion', 'fault', 'expected', 'found', 'delay_s')
ALARM_COLUMNS = ('controller', 'plant', 'condition', 'duration_s', 'samples', 'outliers', 'fault')


def cases(real=False):
    loops = (('predictive', 'real'), ('improved', 'real')) if real else (('predictive', 'ground'), ('predictive', 'box'),
                                                                          ('improved', 'ground'))
    return [(controller, plant, motion, fault) for controller, plant in loops for motion in MOTIONS for fault in FAULTS]


def detect(case):
    """A row: name and delay of a found fault [s]. Raises ValueError for an earlier finding."""
    controller, plant, motion, fault = case
    (kind, channel, value), on_ground, on_box = FAULTS[fault]
    expected = on_box if plant == 'box' and on_box else on_ground
    injected = jackal_aic.Fault(kind, FAULT_TIME, channel, value)
    drive = engine.drive(plant, controller, motions.Motion(((motions.REST, *MOTIONS[motion]),), FAULT_TIME + WATCHED, faults=(injected,)),
                         monitor=True, samples_only=True)
    row = {'controller': controller, 'plant': plant, 'motion': motion, 'fault': fault, 'expected': expected, 'found': '', 'delay_s': None}
    for time, text, faulty in drive.findings:
        if not faulty:
            continue
        if time < FAULT_TIME - 1e-9:
            raise ValueError('fault reported before there is one: {} at {:.6f} s'.format(text, time))
        return dict(row, found=text, delay_s=time - FAULT_TIME)
    return row


def alarms(drive):
    """Numbers of samples, of samples with an excluded channel and of findings, and the text of the first finding."""
    found = [(time, text) for time, text, _ in drive.findings if text]
    return {'samples': len(drive.time), 'outliers': int(numpy.sum(drive.counted == 0)), 'faults': len(found),
            'fault': '{1} at {0:.6f} s'.format(*found[0]) if found else ''}


def ordinary_cases(real=False):
    if real:
        return [(controller, 'real', 'as configured') for controller in ('predictive', 'improved')]
    return ([('predictive', 'ground', name) for name in CONDITIONS] + [('predictive', 'box', name) for name in ON_BOX] +
            [('improved', plant, 'as calibrated') for plant in ('ground', 'box')])


def ordinary(case, duration=ORDINARY_TIME):
    """A row: false alarms of ordinary driving under a condition."""
    controller, plant, condition = case
    drive = engine.drive(plant, controller, motions.ordinary(ORDINARY_SEED, duration), CONDITIONS.get(condition), monitor=True,
                         samples_only=True)
    return {'controller': controller, 'plant': plant, 'condition': condition, 'duration_s': duration, **alarms(drive)}


def write(out, jobs=0, real=False):
    engine.save(out, 'alarms.csv', engine.parallel(ordinary, ordinary_cases(real), jobs, 'alarms'), ALARM_COLUMNS)
    engine.save(out, 'detection.csv', engine.parallel(detect, cases(real), jobs, 'detection'), DETECTION_COLUMNS)


# ---- hours without a fault

def quiet(item):
    """False alarms of a robots.quiet_drive(), by its arguments."""
    drive = robots.quiet_drive(*item)
    plant = engine.settings(drive.plant, drive.controller, drive.overrides)['plant']
    overrides = dict(drive.overrides, **robots.scaled(plant, drive.ratios))
    return alarms(engine.drive(drive.plant, drive.controller, drive.motion, overrides, monitor={'identified': drive.identified},
                               samples_only=True))


def quiet_hours(hours, seed, real=False, jobs=0):
    """Prints each drive with an alarm and, as the last line, "false alarms: K in N hours"; returns K."""
    drives = hours * 3600.0 / QUIET_TIME
    if not 1.0 <= drives <= 1e6 or drives != int(drives):
        raise ValueError('quiet-hours = {:g}: must be a multiple of 0.5 and at most 500000 h'.format(hours))
    items = [(seed, number, QUIET_TIME, True, real) for number in range(int(drives))]
    found = engine.parallel(quiet, items, jobs, 'quiet hours')
    for item, alarm in zip(items, found):
        if alarm['faults']:
            print('{}: {}: {} alarms, first {}'.format(item[1], robots.quiet_drive(*item), alarm['faults'], alarm['fault']))
    total = sum(alarm['faults'] for alarm in found)
    print('false alarms: {} in {:g} hours'.format(total, hours))
    return total


# ---- robots without identification

ASSUMED = str(engine.PACKAGE / 'config/jackal_model.yaml')  # the robot that equals its assumed model
ARRIVAL = 2.0  # s after a change of the set point that belong to its step response
SWINGS = {'speed': 0.05, 'yaw_rate': 0.15}  # m/s, rad/s
MOST_SWINGS = 3  # of a robot that does not oscillate
UNIDENTIFIED_COLUMNS = ('controller', 'dead_time', 'lag', 'gain', 'acceleration_limit', 'duration_s', 'swings', 'faults', 'first')


def most_swings(drive):
    """Most turning points of speed or yaw rate between two changes of the set point, after its step response."""
    most, begins = 0, [0, *metrics.set_point_changes(drive).tolist(), len(drive.time)]
    for begin, end in zip(begins, begins[1:]):
        late = slice(begin + int(numpy.searchsorted(drive.time[begin:end], drive.time[begin] + ARRIVAL)), end)
        for channel, threshold in SWINGS.items():
            values = getattr(drive, channel)[late]
            most = max(most, metrics.swings(values, threshold))
    return most


def unidentified(item):
    """A row: a robot with multiples of the assumed drive train, driven with the assumed model."""
    controller, ratios, duration, seed = item
    overrides = dict(robots.scaled(engine.settings(ASSUMED, controller)['plant'], ratios),
                     **{'plant.seed': seed, 'limits.linear_acceleration': 20.0, 'limits.angular_acceleration': 25.0})
    drive = engine.drive(ASSUMED, controller, motions.joystick(seed, duration), overrides, monitor=robots.assumed_model(), samples_only=True)
    faults, before = [], False
    for time, text, faulty in drive.findings:
        if faulty and not before:
            faults.append('{} at {:.6f} s'.format(text, time))
        before = faulty
    return {'controller': controller, **dict(zip(UNIDENTIFIED_COLUMNS[1:5], ratios)), 'duration_s': duration,
            'swings': most_swings(drive), 'faults': len(faults), 'first': faults[0] if faults else ''}


def write_unidentified(out, controller, minutes, seed, jobs=0):
    engine.require_range('minutes', minutes, 0.01, 10000)
    items = [(controller, ratios, 60.0 * minutes, seed + i) for i, ratios in enumerate(robots.unidentified())]
    rows = engine.parallel(unidentified, items, jobs, 'unidentified robots')
    engine.save(out, 'unidentified.csv', rows, UNIDENTIFIED_COLUMNS)
    print('oscillating: {}, with faults: {} of {} robots in {:g} minutes each'.format(
        sum(r['swings'] > MOST_SWINGS for r in rows), sum(r['faults'] > 0 for r in rows), len(rows), minutes))
