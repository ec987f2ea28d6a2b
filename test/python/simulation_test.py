#!/usr/bin/python3
"""jackal_aic.simulate(): the closed loop of robot, sensors and drive loop for Python."""

import concurrent.futures
import math
import pickle
import unittest

import jackal_aic
import numpy
import rosunit


def same(one, other):
    """Whether two drives are exactly equal."""
    return all(numpy.array_equal(value, other.columns()[name], equal_nan=value.dtype.kind == 'f')
               for name, value in one.columns().items())


class Drives(unittest.TestCase):

    def test_three_lines_suffice(self):
        drive = jackal_aic.simulate('ground', 'predictive', (0.5, 0.0), duration=3)
        self.assertAlmostEqual(drive.settling_time('speed'), 0.37, delta=0.05)
        self.assertEqual(len(drive.time), 3000)
        self.assertEqual(drive.set_points, [(0.5, 0.5, 0.0)])
        numpy.testing.assert_array_equal(drive.set_speed, numpy.where(drive.time < 0.5 - 1e-9, 0.0, 0.5))
        self.assertAlmostEqual(drive.x[-1], drive.speed.sum() * 0.001, delta=0.01)
        self.assertEqual(drive.events[-1][1], 'driving')

    def test_are_equal_for_an_equal_seed(self):
        def drive(seed):
            return jackal_aic.simulate('real', 'predictive', [(0.2, 0.5, 0.3), (1.2, 0.0, 0.0)], duration=2.0, seed=seed)
        self.assertTrue(same(drive(3), drive(3)))
        self.assertTrue(same(drive(3), pickle.loads(pickle.dumps(drive(3)))))
        self.assertFalse(same(drive(3), drive(4)))

    def test_in_threads_are_those_one_after_another(self):
        def drive(speed):
            return jackal_aic.simulate('real', Baseline(), (speed, 0.2), duration=2.0)
        speeds = (0.2, 0.4, 0.6, 0.8)
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            together = list(pool.map(drive, speeds))
        self.assertTrue(all(same(drive(speed), one) for speed, one in zip(speeds, together)))

    def test_on_robots_that_differ(self):
        def drive(**overrides):
            return jackal_aic.simulate('ground', 'diff_drive', (0.5, 0.0), overrides={'plant.' + k: v for k, v in overrides.items()})

        def start(drive):
            return drive.time[numpy.argmax(drive.speed > 0.01)]
        nominal = drive()
        self.assertAlmostEqual(start(drive(dead_time=0.16)), start(nominal) + 0.08, delta=0.002)
        self.assertAlmostEqual(drive(wheel_gain=0.8).response().steady_error, -20.0, delta=0.5)
        self.assertFalse(same(drive(payload=10.0), nominal))
        self.assertTrue(numpy.isnan(nominal.believed_speed).all())

    def test_of_a_turn_settle_and_keep_to_the_limits_of_their_parameters(self):
        drive = jackal_aic.simulate('ground', 'predictive', (0.0, 0.5), duration=4.0)
        self.assertLess(drive.settling_time('yaw_rate'), 2.0)
        with self.assertRaisesRegex(ValueError, "channel = 'speed': its set point never changes"):
            drive.settling_time()
        slow = jackal_aic.Parameters('predictive', 'ground', overrides={'limits.linear_speed': 0.3})
        self.assertAlmostEqual(jackal_aic.simulate('ground', slow, (0.5, 0.0)).speed[-1], 0.3, delta=0.02)

    def test_errors_name_value_and_bound(self):
        drive, fault = ('ground', 'predictive', (0.5, 0.0)), jackal_aic.Fault
        for words, arguments, options in (
            (r"plant = 'moon': unknown; known: box, ground, real", ('moon',) + drive[1:], {}),
            (r"controller = 'pid': unknown; known: diff_drive", ('ground', 'pid', (0.5, 0.0)), {}),
            (r'controller = int: must be a VelocityController', ('ground', 3, (0.5, 0.0)), {}),
            (r'duration = 4000: must be above 0 and at most 3600 s', drive, {'duration': 4000}),
            (r'set_points\[0\]: speed = 50: must be within \+-10 m/s', drive[:2] + ((50.0, 0.0),), {}),
            (r'set_points\[1\]: time = 1: must be later than that before it, 1 s', drive[:2] + ([(1, 0.5, 0), (1, 0, 0)],), {}),
            (r'set_points\[0\]: time = 5: must be in \[0, 3\) s', drive[:2] + ([(5, 0.5, 0)],), {}),
            (r'set_points: must be \(speed, yaw rate\) or a list', drive[:2] + ((0.5,),), {}),
            (r'set_points = \[\]: must hold at least one', drive[:2] + ([],), {}),
            (r'plant.dead_time = 3: must be in \[0, 2\] s', drive, {'overrides': {'plant.dead_time': 3}}),
            (r'plant.seed = -1: ', drive, {'seed': -1}),
            (r"plant.support = 'boat': expected one of ground, box", drive, {'overrides': {'plant.support': 'boat'}}),
            (r'plant.mass = 3: unknown key', drive, {'overrides': {'plant.mass': 3}}),
            (r'controller.kappa_a = 3: unknown key for this controller', ('ground', Baseline(), (0.5, 0)),
             {'overrides': {'controller.kappa_a': 3}}),
            (r'controller.kappa_a = 3: unknown key for this controller',
             ('ground', jackal_aic.Parameters('standard', 'ground'), (0.5, 0)), {'overrides': {'controller.kappa_a': 3}}),
            (r"fault 'melt': unknown; known: freeze", drive, {'faults': [fault('melt')]}),
            (r"fault 'push': channel = 'left': must be one of forward, yaw_rate", drive, {'faults': [fault('push', 1.0, 'left', 100.0)]})):
            with self.assertRaisesRegex(ValueError, words):
                jackal_aic.simulate(*arguments, **options)


class StepResponse(unittest.TestCase):
    """Figures of responses with a closed form; the step is at 1 s."""

    def figures(self, response, set_point=1.0, duration=4.0):
        time = numpy.arange(0.0, 1.0 + duration + 5e-4, 0.001)
        return jackal_aic.step_response(time, numpy.where(time < 1.0, 0.0, response(time - 1.0)), 1.0, 0.0, set_point)

    def test_of_a_lag_are_those_of_its_closed_form(self):
        """The band of settling is around the final value, the rise is to 90 % of the set point, which a low gain never reaches."""
        for reached, lag, rise in ((1.0, 0.2, 0.2 * math.log(9.0)), (0.8, 0.1, None)):
            found = self.figures(lambda t: reached * 0.5 * (1.0 - numpy.exp(-t / lag)), 0.5)
            self.assertTrue(found.bounded)
            self.assertAlmostEqual(found.settling_time, lag * math.log(20.0), delta=1e-3)
            self.assertEqual(found.overshoot, 0.0)
            self.assertAlmostEqual(found.steady_error, 100.0 * (reached - 1.0), delta=1e-3)
            self.assertAlmostEqual(found.rise_time or 0.0, rise or 0.0, delta=1e-3)
            self.assertEqual(found.rise_time is None, rise is None)

    def test_ringing_settles_at_the_last_entry_into_the_band(self):
        decay, frequency = 2.0, 8.0

        def ringing(t):
            return 1.0 - numpy.exp(-decay * t) * numpy.cos(frequency * t)
        found, t = self.figures(ringing, duration=6.0), numpy.arange(0.0, 6.0, 0.001)
        self.assertAlmostEqual(found.settling_time, t[abs(ringing(t) - 1.0) > 0.05][-1], delta=2e-3)
        self.assertGreater(found.settling_time, 1.0, 'long after the first crossing')
        self.assertAlmostEqual(found.overshoot, 100.0 * (ringing((math.pi - math.atan(decay / frequency)) / frequency) - 1.0), delta=1e-2)

    def test_of_a_robot_that_stands_swings_on_or_diverges_have_no_settling(self):
        for reached in (0.0, 0.01):
            found = self.figures(lambda t: reached + 0.0 * t)
            self.assertIsNone(found.settling_time)
            self.assertAlmostEqual(found.steady_error, 100.0 * (reached - 1.0), delta=1e-6)
        self.assertIsNone(self.figures(numpy.sin).settling_time)
        for response in (lambda t: 0.1 * numpy.exp(3.0 * t), lambda t: numpy.where(t > 2.0, math.nan, t)):
            self.assertEqual(self.figures(response), (None, None, 0.0, 0.0, False))

    def test_series_that_cannot_be_assessed_are_refused(self):
        for time, values, initial in (([0.0, 1.0], [0.0], 0.0), ([0.0, 0.4], [0.0, 1.0], 0.0), ([0.0, 1.0], [0.0, 1.0], 1.0)):
            with self.assertRaises(ValueError):
                jackal_aic.step_response(time, values, 0.0, initial, 1.0)


class Faults(unittest.TestCase):

    def test_are_named_by_the_monitor(self):
        """Those of the motors here; the others are in the study of the detection."""
        for fault in (dict(kind='blocked', start=2.0, channel='left'), jackal_aic.Fault('blocked', 2.0, 'left')):
            drive = jackal_aic.simulate('ground', 'predictive', (0.5, 0.3), duration=5.0, faults=fault)
            found = [(time, text) for time, text in drive.events if text not in ('driving', 'idle')]
            self.assertTrue(all(time >= 2.0 for time, text in found), found)
            self.assertIn('left wheels do not follow their command', found[-1][1])
        self.assertEqual(jackal_aic.STATUSES[drive.status[-1]], 'faulted')
        self.assertEqual(jackal_aic.FAULTS[drive.fault[-1]], 'left wheels do not follow their command')
        self.assertAlmostEqual(drive.speed[-1], 0.0, delta=0.01)

    def test_end_with_their_duration(self):
        drive = jackal_aic.simulate('ground', 'diff_drive', (0.5, 0.0), duration=4.0, monitor=False,
                                    faults=[jackal_aic.Fault('set', 2.0, 'left', 7.0, duration=0.5)])
        times = drive.time[drive.measured_left == 7.0]
        self.assertAlmostEqual(times[0], 2.0, delta=0.021)
        self.assertAlmostEqual(times[-1], 2.5, delta=0.021)


class Baseline(jackal_aic.VelocityController):
    """The differential drive of config/diff_drive.yaml, in Python."""

    def reset(self):
        self.kinematics = jackal_aic.Kinematics(effective_track=0.563385)
        self.forward = self.yaw_rate = 0.0

    def act(self, set_point, observation):
        def towards(value, wanted, change):
            return value + min(max(wanted - value, -change), change)
        self.forward = towards(self.forward, set_point.forward, 20.0 / self.rate)
        self.yaw_rate = towards(self.yaw_rate, set_point.yaw_rate, 25.0 / self.rate)
        return self.kinematics.wheel_speeds(self.forward, self.yaw_rate)


class OwnControllers(unittest.TestCase):

    def test_equal_to_that_of_the_core_give_the_same_drive(self):
        points = [(0.5, 0.8, 0.0), (1.5, 0.2, 0.9), (2.5, -0.5, 0.0)]
        theirs = jackal_aic.simulate('ground', 'diff_drive', points, duration=3.5)
        own = Baseline()
        for _ in range(2):  # a second drive begins from rest again
            ours = jackal_aic.simulate('ground', own, points, duration=3.5)
            numpy.testing.assert_allclose(ours.command_right, theirs.command_right, rtol=1e-12)
            numpy.testing.assert_allclose(ours.speed, theirs.speed, atol=1e-9)

    def test_see_what_the_loop_sees_at_their_rate(self):
        class Listener(Baseline):
            seen = []

            def act(self, set_point, observation):
                self.seen.append((set_point.forward, observation.stamp, observation.wheel_left, self.applied))
                return super().act(set_point, observation)
        drive = jackal_aic.simulate('ground', Listener(), (0.5, 0.0), duration=2.0)
        self.assertEqual(len(Listener.seen), 99)  # 50 Hz from 0.02 s on
        forward, stamp, left, applied = Listener.seen[-1]
        now = numpy.searchsorted(drive.time, stamp)
        self.assertEqual(forward, 0.5)
        self.assertAlmostEqual(left, drive.measured_left[now])
        self.assertEqual(applied[0], drive.command_left[now - 1])

    def test_raise_through_the_loop(self):
        class Broken(jackal_aic.VelocityController):
            def act(self, set_point, observation):
                raise KeyError('mine')
        with self.assertRaisesRegex(KeyError, 'mine'):
            jackal_aic.simulate('ground', Broken(), (0.5, 0.0))

        class Endless(jackal_aic.VelocityController):
            def act(self, set_point, observation):
                return float('inf'), 0.0
        with self.assertRaisesRegex(ValueError, r'act\(\) = \(inf, 0\) rad/s: must be finite'):
            jackal_aic.simulate('ground', Endless(), (0.5, 0.0))

        class Slow(Baseline):
            rate = 30.0
        with self.assertRaisesRegex(ValueError, r'Slow.rate = 30 Hz: must be in \[1, 1000\] and divide 1000'):
            jackal_aic.simulate('ground', Slow(), (0.5, 0.0))


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'simulation', '__main__')
