#!/usr/bin/python3
"""Identification of drive trains from recorded drives: estimates, intervals, flaws of a recording, refusals, and what `identify` writes."""

import importlib.machinery
import math
import multiprocessing
import os
import pathlib
import tempfile
import typing
import unittest

import jackal_aic
import numpy
import rosunit
import yaml
from jackal_aic import Estimate

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = importlib.machinery.SourceFileLoader('identify', str(SOURCE / 'src/tools/identify')).load_module()
RADIUS, TRACK = 0.098, 0.6  # m; the track is that of drive()
TRIALS = int(os.environ.get('JACKAL_AIC_INTERVAL_TRIALS', 200))  # robots over which the intervals are counted


class Recording(typing.NamedTuple):
    """Rows (time, left, right) of commands and wheels, and (time, yaw rate)."""
    commands: numpy.ndarray
    wheels: numpy.ndarray
    yaw: numpy.ndarray

    def changed(self, change):
        """A copy that was changed in place, or what `change` returns."""
        copy = Recording(*(rows.copy() for rows in self))
        return change(copy) or copy

    def scaled(self, series, *factors):
        return self._replace(**{series: getattr(self, series) * factors})

    def identified(self, **options):
        return jackal_aic.identify(*self, RADIUS, **options)


def wheel_speeds(speed, turn):
    return (speed - 0.5 * 0.5621 * turn) / RADIUS, (speed + 0.5 * 0.5621 * turn) / RADIUS


class Draws:
    """Random numbers as std::mt19937 and the distributions of libstdc++ draw them, so that the robots are those of the first count."""

    def __init__(self, raw):
        self.raw = iter(raw)

    def between(self, low, high):
        lower, upper = next(self.raw), next(self.raw)
        return low + (high - low) * (lower + 2.0 ** 32 * upper) / 2.0 ** 64

    def one(self, *values):
        return values[next(self.raw) % len(values)]


class Excitation(jackal_aic.VelocityController):
    """The motion of identify.launch, recorded as the topics would. Commands come late by up to a delay [s], at random."""

    rate = 1000.0
    duration = 16.8  # s

    def __init__(self, draws, network_delay, imu_late):
        self.draws, self.network_delay, self.imu_late = draws, network_delay, imu_late
        self.k, self.last, self.stamp, self.driven, self.under_way = 0, 0, None, (0.0, 0.0), []
        self.commands, self.wheels, self.yaw = [], [], []

    def act(self, set_point, observation):
        if self.k % 20 == 7:
            step, since = divmod(self.k * 1e-3, 2.0)
            part = (0.5, -0.5, 1.0, -1.0)[int(step) % 4] if 0.8 <= since and step < 8 else 0.0
            command = wheel_speeds(0.6 * part, 0.0) if step < 4 else wheel_speeds(0.0, part)
            self.commands.append((1e-3 * (self.k + 1), *command))  # what act() returns is driven in the next step
            self.last = max(self.last, self.k + (round(1e3 * self.network_delay * self.draws.between(0.0, 1.0)) if self.draws else 0))
            self.under_way.append((self.last, command))
        while self.under_way and self.under_way[0][0] <= self.k:
            self.driven = self.under_way.pop(0)[1]
        if observation.stamp != self.stamp:
            self.stamp = observation.stamp
            self.wheels.append((self.stamp, observation.wheel_left, observation.wheel_right))
            self.yaw.append((self.stamp + self.imu_late, observation.yaw_rate))
        self.k += 1
        return self.driven


def record(robot='ground', draws=None, network_delay=0.0, imu_late=0.0, **plant):
    """The excitation on the simulated robot; plant: of plant.*."""
    excitation = Excitation(draws, network_delay, imu_late)
    overrides = dict({'plant.velocity_loop_integral': 0.0}, **{'plant.' + key: value for key, value in plant.items()})
    jackal_aic.simulate(robot, excitation, [(0.0, 0.0, 0.0)], duration=Excitation.duration, monitor=False, overrides=overrides)
    return Recording(*(numpy.array(rows) for rows in (excitation.commands, excitation.wheels, excitation.yaw)))


def recorded(**plant):
    """The same of a robot that nothing slows."""
    return record(**dict({'dead_time': 0.1, 'motor_lag': 0.05, 'acceleration_limit': 10.0}, **plant))


def drive(dead_time=0.1, lag=0.05, gain=1.0, limit=10.0, offset=0.0, wheel_rate=50.0, imu_rate=50.0, imu_stamp=0.0, noise=0.03,
          right_gain=1.0, backward_gain=1.0, right_later=0.0, hold=0.0, duration=20.0, command=None):
    """A recording of a known drive train without the simulated robot: steps of 0.8 s, drawn at random, turns included.

    hold: between two measurements of the wheels [s]; command: wheel speeds at a time, instead of the steps.
    """
    random, steps = numpy.random.RandomState(7), round(1000 * duration)
    time = 1e-3 * numpy.arange(steps)
    drawn = random.uniform(-8.0, 8.0, steps // 800)
    drawn = numpy.column_stack((drawn, drawn[::-1]))  # equally fast on both sides, so that no offset stands for a difference of their gains
    values = numpy.repeat(numpy.vstack(((0.0, 0.0), drawn)), 800, axis=0)[:steps]
    sent = (values if command is None else numpy.array([command(t) for t in time]))[::20]

    def due(rate):
        return numpy.diff(numpy.floor(1e-3 * numpy.arange(-1, steps) * rate + 1e-9)) > 0

    speeds, largest, share = [], 1e-3 * limit / RADIUS, 1.0 - math.exp(-1e-3 / lag)
    for side, late, factor in ((0, dead_time, gain), (1, dead_time + right_later, gain * right_gain)):
        newest = numpy.floor((time - late) / 0.02 + 1e-9).astype(int)
        applied = numpy.where(newest < 0, 0.0, sent[numpy.maximum(newest, 0), side])
        factor = factor * numpy.where(applied < 0.0, backward_gain, 1.0)
        speed, column = 0.0, []
        for target in numpy.sign(applied) * numpy.maximum(0.0, factor * abs(applied) - offset):
            speed += min(max(share * (target - speed), -largest), largest)
            column.append(speed)
        speeds.append(column)
    speeds = numpy.array(speeds).T
    is_measured = due(1.0 / hold if hold else wheel_rate)
    is_measured[0] = True
    measured = (speeds + noise * random.normal(size=speeds.shape))[is_measured][numpy.cumsum(is_measured) - 1]
    yaw = RADIUS * (speeds[:, 1] - speeds[:, 0]) / TRACK
    return Recording(numpy.column_stack((time[::20], sent)), numpy.column_stack((time + 1e-3, measured))[due(wheel_rate)],
                     numpy.column_stack((time + 1e-3 + imu_stamp, yaw))[due(imu_rate)])


def covers(estimate, truth):
    return estimate.known and abs(estimate.value - truth) <= estimate.half_width


class Case(unittest.TestCase):

    def assert_found(self, estimate, truth, tolerance):
        self.assertTrue(estimate.known, estimate.unknown)
        self.assertAlmostEqual(estimate.value, truth, delta=tolerance)

    def assert_remarked(self, found, text, is_there=True):
        self.assertEqual(any(remark.startswith(text) for remark in found.remarks), is_there, (text, found.remarks))


class Estimates(Case):

    def test_finds_the_drive_train_through_the_noise(self):
        found = record(dead_time=0.12, motor_lag=0.06, wheel_gain=0.9, acceleration_limit=4.0).identified()
        self.assert_found(found.dead_time, 0.12, 0.005)
        self.assert_found(found.lag, 0.06, min(0.006, 3 * found.lag.half_width + 0.002))
        self.assert_found(found.gain, 0.9, 0.005)
        self.assert_found(found.acceleration_limit, 4.0, 0.3)
        self.assertAlmostEqual(found.residual, 0.03, delta=0.002, msg='the noise of the encoders remains')
        unlimited = record(dead_time=0.1, motor_lag=0.2, acceleration_limit=100.0).identified()
        self.assertFalse(unlimited.acceleration_limit.known)
        self.assertGreater(unlimited.acceleration_limit.value, 1.0)
        self.assert_found(unlimited.lag, 0.2, 0.02)

    def test_fits_a_limit_that_few_seconds_reach(self):
        """Commands of a joystick, which change with each sample."""
        def joystick(time):
            speed = 0.7 * math.sin(0.7 * time) + 0.2 * math.sin(2.3 * time)
            return wheel_speeds(speed, 0.8 * math.sin(0.31 * time + 1.0)) if time % 20.0 < 17.0 else (0.0, 0.0)
        found = drive(duration=45.0, command=joystick).identified()
        self.assert_found(found.dead_time, 0.1, 0.002)
        self.assert_found(found.lag, 0.05, 0.002)

    def test_finds_the_effective_track_of_each_direction(self):
        excited, slow, track = recorded(), 0.12, 0.547  # rad/s of each wheel, m
        time = excited.wheels[-1, 0] + 0.02 * numpy.arange(1, 501)
        turn = numpy.column_stack((time, numpy.full(500, -slow), numpy.full(500, slow)))
        yaw = numpy.column_stack((time, numpy.full(500, RADIUS * 2.0 * slow / track)))  # no bias of the gyro
        slow_turn = Recording(*(numpy.vstack(rows) for rows in zip(excited, (turn, turn, yaw))))
        for recording in (excited, slow_turn):
            found = recording.identified()
            self.assert_found(found.track_left, track, 0.03 * track)
            self.assert_found(found.track_right, track, 0.03 * track)
            self.assert_found(found.track_left, found.track_right.value, 0.03 * track)

    def test_the_track_is_that_of_the_given_slip_factor(self):
        """theta_dot = r alpha (w_R - w_L) / b_hat (3-1)"""
        recording = drive()
        for slip_factor in (0.8, 1.0, 1.2):
            found = recording.identified(slip_factor=slip_factor)
            for estimate in (found.track_left, found.track_right):
                self.assert_found(estimate, slip_factor * TRACK, 0.005 * slip_factor * TRACK)

    def test_the_imu_may_come_at_other_times_than_the_wheels(self):
        for late in (0.003, -0.003, 0.009):
            for imu_rate in (20.0, 50.0, 80.0):
                for wheel_rate in (20.0, 50.0):
                    with self.subTest(late=late, imu_rate=imu_rate, wheel_rate=wheel_rate):
                        found = drive(imu_stamp=late, imu_rate=imu_rate, wheel_rate=wheel_rate).identified()
                        self.assert_found(found.track_left, TRACK, 0.03)
                        self.assert_found(found.track_right, TRACK, 0.03)
                        self.assert_found(found.dead_time, 0.1, 0.01)

    def test_models_the_offset_of_the_motors(self):
        found = drive(offset=0.5, gain=0.95).identified()
        self.assert_found(found.gain, 0.95, 0.005)
        self.assert_found(found.offset, 0.5, 0.03)
        self.assertTrue(found.offset.significant)
        self.assert_remarked(found, 'offset: ')
        self.assertGreater(found.r_squared, 0.999)

    def test_intervals_cover_sides_and_directions_that_differ(self):
        sides, directions = 'left and right differ', 'forward and backward differ'
        for change, quantity, truths, remark in (({'right_gain': 0.8}, 'gain', (1.0, 0.8), sides + r': gain (1\.0|0\.99)'),
                                                 ({'right_later': 0.1}, 'dead_time', (0.1, 0.2), sides + r': dead time 0\.10'),
                                                 ({'backward_gain': 0.8}, 'gain', (1.0, 0.8), directions + r': gain (1\.0|0\.99)'),
                                                 ({}, 'offset', (0.0,), ''), ({'offset': 0.5}, 'offset', (0.5,), '')):
            with self.subTest(change=change):
                found = drive(**change).identified()
                estimate = getattr(found, quantity)
                for truth in truths:  # the common offset moves the gains of both sides by some thousandths
                    self.assertLessEqual(abs(estimate.value - truth), estimate.half_width + (0.005 if 'right_gain' in change else 0.0))
                self.assertTrue(estimate.known, estimate)
                if remark:
                    self.assertRegex('\n'.join(found.remarks), '(?m)^' + remark)
                else:
                    self.assert_remarked(found, sides, False)
                    self.assert_remarked(found, directions, False)
                if 'backward_gain' in change:
                    self.assertFalse(found.offset.known)
                    self.assert_remarked(found, 'offset: ', False)

    def test_a_held_wheel_speed_is_one_measurement(self):
        for rate, hold in ((50.0, 0.1), (20.0, 0.1), (50.0, 0.07)):
            with self.subTest(rate=rate, hold=hold):
                found = drive(wheel_rate=rate, hold=hold).identified()
                self.assert_remarked(found, 'held: the wheel speeds are renewed every 0.{}'.format(round(1e3 * hold) // 100))
                for estimate, truth in ((found.dead_time, 0.1), (found.lag, 0.05), (found.gain, 1.0)):
                    self.assertTrue(covers(estimate, truth), estimate)
                self.assertEqual(found.sensor_rate, rate)
        for step in (0.0065, 0.1, 0.3):  # coarse encoders repeat, too
            for noise in (0.0, 0.03):
                found = record(dead_time=0.1, motor_lag=0.1, encoder_step=step, encoder_noise=noise).identified()
                self.assert_remarked(found, 'held', False)
                self.assertEqual(found.sensor_rate, 50.0)


RAW = 1703  # 32-bit numbers of a trial: 23 for the robot and 2 for each command


def random_trial(raw):
    """(estimate, truth) by quantity, of a random robot with sensors as real ones are."""
    draws = Draws(raw.tolist())
    between, one = draws.between, draws.one
    plant = {'dead_time': round(between(0.03, 0.20), 3), 'motor_lag': between(0.02, 0.15), 'wheel_gain': between(0.8, 1.2),
             'acceleration_limit': between(1.5, 20.0), 'friction': between(0.3, 1.0), 'encoder_step': one(0.0, 0.0065, 0.06, 0.1),
             'stamp_jitter': one(0.0, 0.004, 0.008), 'gyro_noise': between(0.005, 0.02), 'accelerometer_noise': between(0.05, 2.0),
             'measurement_loss': one(0.0, 0.02), 'sensor_rate': one(20.0, 50.0, 80.0), 'seed': one(*range(100000))}
    offset, network_delay, imu_late = one(0.0, 0.5), one(0.0, 0.01, 0.02), between(-0.005, 0.005)
    plant['wheel_offset'] = offset / plant['wheel_gain']
    found = record(draws=draws, network_delay=network_delay, imu_late=imu_late, **plant).identified()
    # From ground truth, turning in place at the fastest turn of the excitation.
    quiet = {'plant.' + key: value for key, value in dict(plant, noise_scale=0.0, encoder_step=0.0, stamp_jitter=0.0).items()}
    truth = jackal_aic.simulate('ground', 'diff_drive', (0.0, 1.0), overrides=quiet)
    track = RADIUS * (truth.wheel_right[-1] - truth.wheel_left[-1]) / truth.yaw_rate[-1]
    # A command's way through the network and a sample's lateness are dead time, too; a late sample comes with the next step of the
    # simulation.
    late = 0.5 * network_delay + (0.5 * (plant['stamp_jitter'] + 0.001) if plant['stamp_jitter'] else 0.0)
    return {'dead time': (found.dead_time, plant['dead_time'] + late), 'lag': (found.lag, plant['motor_lag']),
            'gain': (found.gain, plant['wheel_gain']), 'offset': (found.offset, offset), 'track, left': (found.track_left, track),
            'track, right': (found.track_right, track), 'acceleration limit': (found.acceleration_limit, plant['acceleration_limit'])}


class Intervals(unittest.TestCase):

    def test_hold_the_truth_nineteen_times_of_twenty(self):
        telling, inside, known = 30, 0, 0  # trials in which a quantity is known; of fewer, chance decides its share
        with multiprocessing.get_context('fork').Pool() as pool:
            raw = numpy.random.RandomState(2022).randint(0, 2 ** 32, (TRIALS, RAW), numpy.uint32)
            trials = pool.map(random_trial, raw, chunksize=1)
        for name in trials[0]:
            pairs = [trial[name] for trial in trials if trial[name][0].known]
            covered = sum(covers(*pair) for pair in pairs)
            print('{:<20} {:3d} of {:3d} in the interval ({:.1f} %), mean half width {:.4f}'.format(
                name, covered, len(pairs), 100.0 * covered / max(1, len(pairs)),
                numpy.mean([estimate.half_width for estimate, _ in pairs])))
            if len(pairs) >= telling:
                self.assertGreaterEqual(covered / len(pairs), 0.90, name)
            inside, known = inside + covered, known + len(pairs)
        print('{:<20} {:3d} of {:3d} ({:.1f} %)'.format('all', inside, known, 100.0 * inside / known))
        self.assertGreaterEqual(len(pairs), TRIALS // 8, 'the acceleration limit is known')
        self.assertGreaterEqual(inside / known, 0.90)
        self.assertLessEqual(inside / known, 0.99)


class Flaws(Case):

    def test_spikes_change_little(self):
        """A bit that flips on a bus, or a counter that wraps."""
        clean = recorded(wheel_gain=0.95, acceleration_limit=3.0)
        expected = clean.identified()
        self.assert_remarked(expected, 'spikes', False)
        for spike in (4000.0, -60.0, 5.0):
            def change(recording):
                recording.wheels[[150, 151, 420, 700], 2] += spike
                recording.yaw[[300, 600], 1] += 0.1 * spike
            found = clean.changed(change).identified()
            for quantity, tolerance in (('dead_time', 1e-3), ('lag', 3e-3), ('gain', 1e-3), ('track_left', 1e-3)):
                self.assert_found(getattr(found, quantity), getattr(expected, quantity).value, tolerance)
            self.assertEqual(found.fitted.shape, (len(clean.wheels), 2))
            # Next to two in a row on a ramp another value may count as one.
            self.assertRegex(found.remarks[0], '^spikes: [456] of {} wheel speeds left out'.format(2 * len(clean.wheels)))
            self.assertEqual(found.remarks[1], 'spikes: 2 of {} yaw rates left out'.format(len(clean.yaw)))

    def test_remarks_on_what_was_clipped_cut_or_missing(self):
        excited, known = recorded(), drive()
        # The first two pieces after the rest: half speed forward, rest.
        one_sided = Recording(*(rows[rows[:, 0] <= 2.7] for rows in excited))
        gap = Recording(*(rows[(rows[:, 0] <= 9.0) | (rows[:, 0] >= 10.3)] for rows in known))
        for rows in gap:
            rows[rows[:, 0] > 9.5, 0] += 3600.0

        def push(recording):
            recording.wheels[(recording.wheels[:, 0] > 8.0) & (recording.wheels[:, 0] < 12.0), 1:] = -6.0, 6.0
        for recording, remark, tolerance in (  # of dead time [s] and gain
                (recorded(speed_limit=0.45), '^clipped: ', 0.02), (one_sided, '^one-sided: ', 1.0),
                (gap, '^cut: 1 gap of more than 0.5 s', 0.005),
                (known.changed(push), '^cut: .* of driving that the commands do not explain', 0.005)):
            found = recording.identified()
            self.assertRegex(found.remarks[0], remark)
            self.assert_found(found.dead_time, 0.1, tolerance)
            self.assert_found(found.gain, 1.0, tolerance)
        self.assertGreater(found.r_squared, 0.99)

    def test_says_why_there_is_no_track(self):
        on_blocks = recorded(robot='box').identified()
        self.assert_found(on_blocks.dead_time, 0.1, 0.01)
        self.assertIn('blocks', on_blocks.track_left.unknown)
        good, degrees, out_of_range = drive(), math.degrees(1.0), r'^{:.3g}\d* m, must be within 0.196 to 1.96 m'.format
        for changed, unknown in ((good._replace(yaw=good.yaw + (100.0, 0.0)), 'wheel speeds and IMU data do not overlap'),
                                 (good._replace(yaw=good.yaw[[0, -1]]), 'no IMU data within'), (good._replace(yaw=None), 'no IMU data'),
                                 (good.scaled('yaw', 1.0, -1.0), 'upside down'),
                                 (good.scaled('yaw', 1.0, degrees), out_of_range(0.0104)),
                                 (good.scaled('yaw', 1.0, 0.2), r'^(2\.99|3)[\d.]* m, must be within 0.196 to 1.96 m')):
            found = changed.identified()
            for estimate in (found.track_left, found.track_right):
                self.assertRegex(estimate.unknown, unknown)


class Refusals(Case):

    def test_are_one_line_that_names_the_reason(self):
        excited, known = recorded(), drive()

        def put(series, index, value):
            def change(recording):
                getattr(recording, series)[index] = value
            return excited.changed(change)
        for recording, message in (
                (excited._replace(commands=excited.commands[:0]), 'wheel commands: 0 samples'),
                (excited._replace(wheels=excited.wheels[:20]), 'wheel speeds: 20 samples'),
                (excited._replace(yaw=excited.wheels), r'yaw rate: must have the shape \(n, 2\)'),
                (drive(dead_time=0.55), 'dead time: the estimate is at the end of the range'),
                (drive(wheel_rate=20.0, hold=0.25), 'the wheel speeds are renewed every 0.250 s only'),
                (put('wheels', (100, 1), 1e300), r'wheel speeds = 1e\+300 rad/s at 2.0\d0 s: must be within \+-10000 rad/s'),
                (put('yaw', (100, 1), -2e3), r'yaw rate = -2000 rad/s at 2.0\d0 s: must be within \+-1000 rad/s'),
                (put('commands', (100, 2), 3e38), r'wheel commands = 3e\+38 rad/s at 2.00\d s: must be within \+-10000 rad/s'),
                (put('wheels', (50, 0), 0.0), 'not monotonic'),
                (put('wheels', (50, 0), math.inf), 'wheel speeds: a stamp is not finite'),
                (put('wheels', (10, 1), math.nan), r'wheel speeds at 0.2\d0 s: a value is not finite'),
                (excited.scaled('commands', 1.0, 0.0, 0.0),
                 r'wheel commands: no excitation \(0 steps of 0.5 rad/s or more, at least 2 are needed\)'),
                (excited.scaled('commands', 1.0, 0.0, 1.0), r'no excitation of the left wheels \(0 steps'),
                (excited._replace(wheels=excited.wheels + (3600.0, 0.0, 0.0)),
                 r'wheel speeds and commands do not overlap in time \(3600.0\d0 to '),
                (known.scaled('wheels', 1.0, 0.0, 0.0), 'the wheels never turn'),
                (known.scaled('wheels', 1.0, 1.0, 0.0), 'the right wheels never turn'),
                (known.scaled('commands', 1.0, -1.0, -1.0), 'the wheels turn against their commands'),
                (known.scaled('wheels', 1.0, -1.0, 1.0), 'the left wheels turn against'),
                (known._replace(wheels=known.wheels[:, [0, 2, 1]]), 'left and right are exchanged'),
                (known._replace(wheels=known.wheels - (0.15, 0.0, 0.0)), 'the wheels answer before their commands')):
            with self.assertRaisesRegex(ValueError, message) as refused:
                recording.identified()
            self.assertNotIn('\n', str(refused.exception))


class Report(Case):
    """What `identify` prints and writes."""

    FOUND = jackal_aic.Identification(
        dead_time=Estimate(0.12, 0.001), lag=Estimate(0.05, 0.00001), gain=Estimate(0.97, 0.003), offset=Estimate(0.48, 0.02),
        acceleration_limit=Estimate(3.2, math.inf, 'never reached; at least the largest acceleration seen'),
        track_left=Estimate(0.55, 0.01), track_right=Estimate(unknown='no turn to the right'), sensor_rate=20.0, residual=0.03,
        r_squared=0.98765, fitted=numpy.empty((0, 2)), remarks=['cut: 2.0 s of driving that the commands do not explain'])

    def written(self, found, source='drive.bag', robot=''):
        text = PROGRAM.plant_model(found, source, 16.8, robot)
        self.assertEqual(list(yaml.safe_load(text)), ['plant_model'])
        return text

    def test_says_where_a_plant_model_comes_from(self):
        text = self.written(self.FOUND, 'drive.bag, recorded 2022-05-17 14:03 UTC', 'my "Jackal"')
        for words in ('drive.bag', '2022-05-17 14:03 UTC', 'robot: "my \\"Jackal\\""', 'R^2 0.9877', '0.4800 +- 0.0200',
                      '# cut: 2.0 s of driving', 'left 0.5500 +- 0.0100, right unknown: no turn to the right'):
            self.assertIn(words, text)
        self.written(self.FOUND, 'of\nlimits: {linear_speed: 9.0}\n.bag')  # its name stays in its comment
        for words in ('R^2', 'no turn to the right', 'never reached; at least the largest acceleration seen (3.2000 m/s^2)'):
            self.assertIn(words, PROGRAM.table(self.FOUND))

    def test_writes_the_estimates_as_the_controller_reads_them(self):
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory, 'robot.yaml')
            path.write_text(self.written(self.FOUND))
            read = jackal_aic.Parameters('predictive', str(path))
        for key, value in (('dead_time', 0.12), ('lag', 0.05), ('gain', 0.97), ('acceleration_limit', 3.2), ('effective_track', 0.55),
                           ('dead_time_half_width', 0.001), ('lag_half_width', 0.00001), ('gain_half_width', 0.003), ('offset', 0.48),
                           ('sensor_rate', 20.0), ('offset_half_width', 0.02), ('identified', True)):
            self.assertEqual(read['plant_model.' + key], value, key)
        with self.assertRaisesRegex(ValueError, 'gain is unknown: the recording does not depend on it'):
            self.written(self.FOUND._replace(gain=Estimate(0.97, 2.0, 'the recording does not depend on it')))

    def test_does_not_write_an_offset_that_may_be_none(self):
        for offset in (Estimate(0.04, 0.05), Estimate(-0.2, 0.05), Estimate(0.2, 0.0, 'the commands are of one speed only')):
            model = yaml.safe_load(self.written(self.FOUND._replace(offset=offset)))['plant_model']
            self.assertEqual((model['offset'], model['offset_half_width']), (0.0, 0.0), offset)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'identification', '__main__')
