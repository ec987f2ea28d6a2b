#!/usr/bin/python3
"""The studies beyond the thesis: stops, drawn robots, detection, odometry, recordings, baselines."""

import functools
import os
import pathlib
import tempfile
import unittest

import drives  # finds the modules of the lab
import baselines
import detection
import engine
import metrics
import motions
import numpy
import odometry
import recordings
import robots
import robustness
import rosunit
import stops


class Stops(unittest.TestCase):

    def hard(self, case):
        """The arcs and turns on motors a little slower than the model's, and the fastest turns, which failed once."""
        controller, plant, factor, forward, yaw_rate = case
        arc, fast = yaw_rate == 0.5 and forward > 0.0, yaw_rate >= 1.5 and forward < 1.0
        if controller == 'predictive':
            return (plant == 'box' and fast) or (factor == 0.5 and arc)
        return plant == 'ground' and factor < 1.0 and arc

    def test_no_preset_winds_up_or_runs_back(self):
        chosen, others = [], 0
        for case in stops.cases():
            if (case[1] == 'ground' and case[2] == 1.0) or self.hard(case):
                chosen.append(case)
                continue
            if others % 10 == 0:
                chosen.append(case)
            others += 1
        found = stops.table(chosen)
        self.assertGreater(len(found), 150)
        self.assertEqual([row for row in found if not row['kept']], [])


class Robustness(unittest.TestCase):

    def test_predictive_settles_nearly_always_and_is_always_stable(self):
        sums = robustness.summary(engine.parallel(robustness.drawn, [('predictive', 1 + i) for i in range(20)]))
        self.assertEqual((sums['runs'], sums['unstable']), (20, 0))
        self.assertGreaterEqual(sums['settled'], 19)


class Detection(unittest.TestCase):

    def test_every_fault_is_found_in_time_for_what_it_is(self):
        bars, cases = engine.bars()['detection'], detection.cases() + detection.cases(True)
        self.assertEqual(len(cases), 225)
        for row in engine.parallel(detection.detect, cases):
            self.assertEqual(row['found'], row['expected'], row)
            self.assertLessEqual(row['delay_s'], bars['delay_on_real' if row['plant'] == 'real' else 'delay'] + 1e-9, row)

    def test_ordinary_driving_raises_no_alarm(self):
        for row in engine.parallel(ordinary, detection.ordinary_cases()):
            self.assertEqual(row['fault'], '', row)
            self.assertLessEqual(row['outliers'], 0.002 * row['samples'], row)

    def test_quiet_drives_raise_no_alarm(self):
        drives = [(20, number, 240.0, number % 3 != 2) for number in range(20)]
        drives += [(1, number, 600.0, True, True) for number in (0, 1, 6, 16)]
        for item, alarms in zip(drives, engine.parallel(detection.quiet, drives)):
            self.assertEqual(alarms['fault'], '', robots.quiet_drive(*item))
            self.assertGreater(alarms['samples'], 25000 / 600.0 * item[2])

    def test_a_door_sill_is_no_fault_of_the_gyro(self):
        items = [(controller, speed, seed) for controller in ('predictive', 'improved', 'diff_drive') for speed in (0.5, 1.0, 1.5)
                 for seed in (1, 3, 4, 6)]
        for item, alarms in zip(items, engine.parallel(over_the_sill, items)):
            self.assertEqual(alarms['fault'], '', item)

    def test_unidentified_robots_neither_oscillate_nor_are_called_faulty(self):
        corners = ((1.0, 1.0, 1.0, 1.0), (0.5, 0.5, 1.2, 3.0), (2.0, 2.0, 1.2, 3.0), (2.0, 2.0, 1.2, 0.5), (0.5, 2.0, 0.8, 0.5),
                   (2.0, 0.5, 0.8, 1.0), (0.075, 0.33, 1.0, 9.7))  # the last as in Gazebo
        for row in engine.parallel(detection.unidentified, [('predictive', ratios, 60.0, 5) for ratios in corners]):
            self.assertLessEqual(row['swings'], detection.MOST_SWINGS, row)
            self.assertEqual(row['faults'], 0, row)


def ordinary(case):
    """Five minutes as calibrated, and two under every other condition."""
    return detection.ordinary(case, 300.0 if case[0] == 'predictive' and case[2] == 'as calibrated' else 120.0)


def over_the_sill(item):
    controller, speed, seed = item
    motion = motions.Motion(((motions.REST, speed, 0.0),), motions.REST + 11.0 / speed)
    return detection.alarms(engine.drive('real', controller, motion, {'plant.seed': seed}, monitor=True, samples_only=True))


class Odometry(unittest.TestCase):

    def test_it_drifts_less_than_the_stock_controller(self):
        items = [(controller, name, '') for controller in ('predictive', 'improved') for name in odometry.DRIVES if name != 'straight line']
        found = engine.parallel(odometry.row, items)
        self.assertEqual(len(found), 8)
        for row in found:
            self.assertGreater(row['way_m'], 5.0)
            self.assertLess(row['heading_error_rad'], 0.1)
            self.assertLess(row['heading_error_rad'], row['stock_heading_error_rad'] + 0.03)
        self.assertLess(sum(row['drift_m_per_m'] for row in found), 0.5 * sum(row['stock_drift_m_per_m'] for row in found))

    def covariance(self, controller, plant, motion, overrides=None, since=505):
        """Normalised squared error of the odometry's motion, and the share within its 95 % bounds, since a millisecond."""
        drive = engine.drive(plant, controller, motion, overrides, odometry=True)
        nees = metrics.normalised_error(drive.odometry_speed - drive.speed, drive.odometry_yaw_rate - drive.yaw_rate, drive.odometry_speed_variance,
                                        drive.odometry_covariance, drive.odometry_yaw_rate_variance)[since::10]
        return numpy.mean(nees), numpy.mean(nees < metrics.INSIDE_95)

    def test_its_covariance_is_that_of_the_errors(self):
        for controller, plant in (('predictive', 'ground'), ('predictive', 'box'), ('improved', 'ground'), ('improved', 'box')):
            nees, inside = numpy.mean([self.covariance(controller, plant, motions.cycle(seed, 10, 0.8, 0.8, 2.0, 4.0), {'plant.seed': seed})
                                       for seed in range(1, 5)], axis=0)
            self.assertGreaterEqual(inside, 0.95, (controller, plant))
            self.assertTrue(0.5 <= nees <= 2.5, (controller, plant, nees))

    def test_its_covariance_is_not_that_of_a_slower_robot(self):
        """Motors that follow at once, driven with the assumed model: what was learned of their delay is most of that model's."""
        model = {'plant_model.' + key: value for key, value in robots.assumed_model().items()}
        motors = {'plant.dead_time': 0.006, 'plant.motor_lag': 0.01, 'plant.acceleration_limit': 16.0, 'limits.linear_acceleration': 20.0,
                  'limits.angular_acceleration': 25.0}
        nees, inside = self.covariance('predictive', 'ground', motions.joystick(3, 60.0), {**model, **motors}, 20000)
        self.assertGreaterEqual(inside, 0.95)
        self.assertGreaterEqual(nees, 0.1)

    def test_the_belief_is_within_its_bounds_in_every_phase(self):
        for plant in ('box', 'ground', 'real'):
            # beyond the seeds of the table, by which the constants of the covariance were chosen
            for row in odometry.consistency_rows(plant, range(odometry.SEEDS + 1, odometry.SEEDS + 5)):
                self.assertGreater(row['samples'], 1000)
                self.assertGreaterEqual(row['inside_95'], 0.95, row)
                self.assertTrue(0.5 <= row['nees'] <= 2.5, row)


class RecordingFiles(unittest.TestCase):

    def written(self, name, text):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        path = pathlib.Path(directory.name, name)
        path.write_text(text)
        return str(path)

    def log(self, *rows):
        return '\n'.join([','.join(recordings.LOG)] + list(rows)) + '\n'

    def test_a_log_knows_the_command_while_it_calibrates(self):
        recording = recordings.read(self.written('husky_floor.csv', self.log(
            '0.00,idle,0,0,1,2,0.1,0.2,0.3,9.8,0,0,0', '0.05,calib,0.5,1.0,1,2,0.1,0.2,0.3,9.8,0,0,0',
            '0.10,calib,0.5,1.0,1,2,0.1,0.2,0.3,9.8,0,0,0', '0.15,calib,0.5,0.0,1,2,0.1,0.2,0.3,9.8,0,0,0')))
        self.assertEqual((recording.name, recording.has_imu), ('husky_floor', True))
        self.assertEqual(recording.starts.tolist(), [True, True, False, False])
        self.assertEqual(recording.step.tolist(), [-1, 0, 0, 1])
        self.assertTrue(numpy.isnan(recording.commands[0]).all())
        self.assertAlmostEqual(recording.commands[1, 0], (0.5 - 0.5 * 0.5708) / 0.1651)

    def test_other_files_are_refused_in_one_line(self):
        row = '0.00,idle,0,0,{},2,0.1,0.2,0.3,9.8,0,0,0'
        for name, text, complaint in (
            ('husky_x.csv', self.log(row.format('x')), "husky_x.csv': could not convert string to float: 'x'"),
            ('husky_x.csv', self.log(row.format('1'), row.format('1')), 'line 3: time_s = 0: must be above 0'),
            ('husky_x.csv', self.log('1,2'), 'line 2: has 2 values'), ('husky_x.csv', self.log(), 'has no rows'),
            ('husky_x.csv', 'a,b\n', 'columns of no known kind'),
            ('segway.csv', self.log(), 'begins with the name of no known robot; known: husky, warthog')):
            with self.assertRaisesRegex(ValueError, complaint):
                recordings.read(self.written(name, text))


DATA = os.environ.get('JACKAL_AIC_REAL_DATA', '')


def part(samples, begin, end):
    """A part of the samples, by shares of their number."""
    samples = samples[int(begin * len(samples)):int(end * len(samples))]
    samples[0, 9] = 1.0  # a stretch starts
    return samples


def changed(samples, columns, change):
    samples[:, columns] = change(samples[:, columns])
    return samples


def noisy(deviation):
    return lambda values: values + deviation * numpy.random.RandomState(1).randn(*values.shape)


def exchanged(samples, sign, negated):
    """The sides and their commands exchanged, with another sign, and that of some columns changed."""
    samples[:, [1, 2, 7, 8]] = sign * samples[:, [2, 1, 8, 7]]
    samples[:, negated] *= -1.0
    return samples


ALTERED = {
    'first half': lambda s: part(s, 0.0, 0.5),
    'second half': lambda s: part(s, 0.5, 1.0),
    'last eighth': lambda s: part(s, 0.875, 1.0),
    'mirrored': lambda s: exchanged(s, 1.0, [3, 5]),
    'turned round': lambda s: exchanged(s, -1.0, [4, 5]),
    'encoder steps of 0.2 rad/s': lambda s: changed(s, [1, 2], lambda v: 0.2 * numpy.round(v / 0.2)),
    'encoder noise of 0.05 rad/s': lambda s: changed(s, [1, 2], noisy(0.05)),
    'gyro steps of 0.01 rad/s': lambda s: changed(s, [3], lambda v: 0.01 * numpy.round(v / 0.01)),
    'gyro noise of 0.02 rad/s': lambda s: changed(s, [3], noisy(0.02)),
    'gyro bias of 0.04 rad/s': lambda s: changed(s, [3], lambda v: v + 0.04),
    'gyro two samples late': lambda s: changed(s, [3], lambda v: numpy.concatenate([v[:2], v[:-2]])),
    'accelerometer off by 0.8 m/s^2': lambda s: changed(s, [4], lambda v: v + 0.8),
}


@functools.lru_cache(maxsize=None)
def read(path):
    """A recording and what its software makes of commands."""
    recording = recordings.read(path)
    return recording, recordings.fit_path(recording)


def replayed(item):
    """Figures of a recording; item: path, whether the model is identified, and how it is altered, or ''."""
    path, identified, alteration = item
    return recordings.replay(*read(path), identified, ALTERED.get(alteration))


@unittest.skipUnless(DATA, 'JACKAL_AIC_REAL_DATA is not set')
class Recordings(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        for path in recordings.paths(DATA):
            read(path)  # once, for all processes

    def replays(self, items):
        return zip(items, engine.parallel(replayed, items))

    def test_raise_no_alarm_and_show_the_turn_with_either_model(self):
        ratios = []
        for item, figures in self.replays([(path, identified, '') for path in recordings.paths(DATA) for identified in (False, True)]):
            self.assertEqual((figures['alarms'], figures['refusal']), ([], ''), item)
            if figures['yaw_error'] is not None:
                ratios.append(recordings.ratio(figures))
                self.assertLessEqual(ratios[-1], 0.65 if 'asphalt' in item[0] else 1.05, item)
        self.assertEqual(len(ratios), 6)

    def test_raise_no_alarm_when_altered(self):
        for item, figures in self.replays([(path, False, alteration) for alteration in ALTERED for path in recordings.paths(DATA)]):
            self.assertEqual(figures['alarms'], [], item)

    def test_a_reversed_gyro_is_reported_and_not_learned_from(self):
        for path in recordings.paths(DATA):
            recording, command_path = read(path)
            if not recording.has_imu:
                continue
            commands = recordings.applied_commands(recording, command_path)
            loop = recordings.recorded_loop(recording, recordings.known_model(recording, commands, False)[0])
            _, _, told = recordings.watched(loop, recording, changed(recordings.samples_of(recording, commands), [3], numpy.negative))
            self.assertIsNotNone(told, path)
            speed = 0.5 / recording.wheel_radius  # of wheels, rad/s
            configured = 1.0 / (1.5 * recording.wheel_distance)
            for share in (0.0, 1.0, -1.0):
                learned = loop.usual_yaw_rate((share - 1.0) * speed, (share + 1.0) * speed)  # sides 1 m/s apart
                self.assertAlmostEqual(learned, configured, delta=0.04 * configured)


def searched_from_kept(item):
    """Largest excess of the kept gains over their bounds, and what a short search from them gains (logarithms)."""
    values = baselines.kept(*item)
    found = baselines.tune(*item, values, (0.2,), 40)
    return max(baselines.excess(baselines.figures(*item, values))), baselines.cost(*item, values) - baselines.cost(*item, found)


class Baselines(unittest.TestCase):

    def start(self, name):
        return [tunable.start for tunable in baselines.STRUCTURES[name].tuned]

    def test_every_structure_is_stable_and_settles_a_disturbance(self):
        for plant in engine.PLANTS:
            for name in baselines.STRUCTURES:
                found = baselines.figures(name, plant, self.start(name))
                self.assertTrue(found['stable'], (name, plant))
                self.assertGreaterEqual(found['iae'], found['least_iae'], (name, plant))

    def test_the_kept_gains_are_those_that_the_search_finds(self):
        """They keep the bounds, and a search from them gains at most 1 % of IAE."""
        items = [(name, plant) for plant in engine.PLANTS for name in baselines.STRUCTURES if name != 'predictive_preset']
        self.assertEqual(len(items), 14)
        for item, (excess, gain) in zip(items, engine.parallel(searched_from_kept, items)):
            self.assertLessEqual(excess, 0.0, item)
            self.assertLessEqual(gain, 0.01, item)

    def test_a_step_on_its_own_model_is_the_same_for_all_regulators(self):
        motion = motions.step(0.5)
        settling = [metrics.response(engine.drive('ground', baselines.controller(name, 'ground', self.start(name)), motion,
                                                  {'plant.noise_scale': 0.0}), motion)['settling_s']
                    for name in ('simc_pi', 'pid', 'smith_pi', 'lqg', 'active_inference', 'unbiased_active_inference')]
        self.assertLess(max(settling) - min(settling), 0.01)
        self.assertLess(max(settling), 0.41)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'studies', '__main__')
