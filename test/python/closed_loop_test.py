#!/usr/bin/python3
"""The closed loop of presets and simulated robots: timing, limits, rest, slip, and robots that are not their model."""

import math
import unittest

import jackal_aic
import numpy
import rosunit

from drives import drive, drives
import engine
import metrics
import motions
import robots
import stops

HALF = (0.5, 0.0)  # m/s, rad/s
LIMITS = {'limits.linear_acceleration': 20.0, 'limits.angular_acceleration': 25.0}  # of the drive gate


def points(*changes, until):
    """Set points (time, speed, yaw rate) in force until a time [s]."""
    return motions.Motion(changes, until)


def response(controller, plant, motion, overrides=None):
    return metrics.response(drive(controller, plant, motion, overrides), motion)


def with_step(motion, time, set_point, duration=4.0):
    """A motion that ends with a step from rest, which is assessed."""
    channel = 'speed' if set_point[0] else 'yaw_rate'
    return motions.Motion((*motion.set_points, (time, *set_point)), time + duration, channel, time, time + duration)


class Stamps(jackal_aic.VelocityController):
    """Commands the stamp of the last measurement."""

    def act(self, set_point, observation):
        return observation.stamp, observation.stamp


class Loop(unittest.TestCase):

    def test_phase_is_the_age_of_a_measurement_at_an_action(self):
        for phase in (0.0, 0.001, 0.013, 0.019):
            found = drive(Stamps(), 'box', motions.step(0.5, duration=1.0), {'loop.phase': phase, 'plant.encoder_noise': 0.0})
            actions = slice(20, None, 20)
            numpy.testing.assert_allclose(found.command_left[actions], found.time[actions], atol=1e-9)
        step, phase = motions.step(0.5), {'loop.phase': 0.013}
        self.assertAlmostEqual(response('diff_drive', 'box', step)['settling_s'], response('diff_drive', 'box', step, phase)['settling_s'],
                               delta=1e-6, msg='the open loop does not measure')
        self.assertGreater(response('improved', 'box', step, {'loop.phase': 0.019})['overshoot_pct'],
                           2.0 * response('improved', 'box', step)['overshoot_pct'])

    def test_limits_hold_the_action_without_wind_up(self):
        wave = points((0.5, 0.1, 0.0), (2.5, 0.6, 0.0), (4.5, 0.1, 0.0), until=6.5)
        found = drive('improved', 'ground', wave, {'limits.linear_speed': 0.3})
        self.assertAlmostEqual(found.speed.max(), 0.3, delta=0.01)
        self.assertAlmostEqual(found.speed[6000], 0.1, delta=0.01, msg='a wound-up action would still be above')


class RealRobot(unittest.TestCase):

    def test_none_winds_up_and_none_runs_back_after_a_stop(self):
        """Patches of friction change a turn at once by a fifth, and a load off centre takes the point about which it turns aside."""
        tyres, wanted = {'robot.wheel_radius': 0.097}, ((1.0, 0.0), (0.5, 0.5), (0.0, 1.0))  # m, their mean
        begins = [2.0 + 7.5 * i for i in range(len(wanted))]
        motion = points(*(point for begin, set_point in zip(begins, wanted) for point in ((begin, *set_point), (begin + 3.0, 0.0, 0.0))), until=24.5)
        for controller, step_pct, arc_pct in (('predictive', 5.0, 8.0), ('standard', 12.0, 12.0), ('improved', 10.0, 10.0)):
            found = drive(controller, 'real', motion, {**LIMITS, **tyres})
            for begin, (forward, yaw_rate) in zip(begins, wanted):
                drives_on, stopped = (slice(int(1e3 * (begin + start)), int(1e3 * (begin + end))) for start, end in ((0.0, 3.0), (3.0, 5.5)))
                speed, rate, case = found.speed[drives_on], found.yaw_rate[drives_on], (controller, forward, yaw_rate)
                turn_pct = arc_pct + 35.0 if forward else step_pct + 15.0
                self.assertAlmostEqual(speed[-500:].mean(), forward, delta=0.05 if forward else 0.15, msg=case)
                self.assertAlmostEqual(rate[-500:].mean(), yaw_rate, delta=0.25, msg=case)
                if forward:
                    self.assertLessEqual(speed.max(), (1.0 + 0.01 * step_pct) * forward + 0.01, case)
                if yaw_rate:
                    self.assertLessEqual(rate.max(), (1.0 + 0.01 * turn_pct) * yaw_rate + 0.02, case)
                speed, rate = found.speed[stopped], found.yaw_rate[stopped]
                self.assertLessEqual(-speed.min(), 0.04 if forward else 0.15, case)
                self.assertLessEqual(-rate.min(), 0.07, case)
                self.assertAlmostEqual(speed[-1], 0.0, delta=0.02, msg=case)
                self.assertAlmostEqual(rate[-1], 0.0, delta=0.04, msg=case)


class Standstill(unittest.TestCase):
    """At a set point of zero the command becomes exactly zero, and the next start is as fast as without it."""

    def assert_stands(self, found, begin, end, case):
        stands = (found.time > begin) & (found.time < end)
        self.assertEqual((found.command_left[stands] != 0.0).sum() + (found.command_right[stands] != 0.0).sum(), 0, case)

    def test_the_command_stays_zero_after_a_stop_by_any_encoder(self):
        cases = []
        for step, noise, rest in ((0.0, 0.03, 3.0), (0.0, 0.0, 3.0), (0.06, 0.03, 3.0), (0.06, 0.003, 7.0)):
            # Between two steps of an encoder without noise a wheel creeps unseen; the rest of that fades.
            for forward, yaw_rate in (HALF, (0.0, 1.0), (1.5, 0.5)):
                cases.append(('predictive', 'ground', motions.stop(forward, yaw_rate, 3.0, rest + 15.0),
                              {'plant.encoder_step': step, 'plant.encoder_noise': noise}))
        for case, found in drives(cases):
            self.assert_stands(found, case[2].duration - 14.0, math.inf, case)

    def test_the_command_of_a_preset_stays_zero_and_starts_at_once(self):
        motion = points((0.5, 0.5, 0.5), (3.0, 0.0, 0.0), (20.0, 0.5, 0.0), until=22.0)
        # Motors with a dead zone that the controller does not know: that command is released slowly.
        dead_zone = {'plant.wheel_offset': 0.5, 'plant.wheel_breakaway': 0.5}
        cases = [(controller, plant, motion, overrides) for controller in ('standard', 'improved', 'tuned', 'predictive')
                 for plant, overrides in (('ground', {}), ('box', {}), ('ground', dead_zone), ('real', {}))]
        for case, found in drives(cases):
            self.assert_stands(found, 8.0, 19.99, case)
            self.assertTrue((found.command_left[found.time > 20.05] != 0.0).all(), case)
            self.assertAlmostEqual(found.speed[-1], 0.5, delta=0.03, msg=case)

    def test_a_start_is_as_fast_as_without_standstill(self):
        stood = drive('predictive', 'ground', points((5.5, *HALF), until=6.1))
        restless = drive('predictive', 'ground', points((0.5, 1e-4, 0.0), (5.5, *HALF), until=6.1))
        self.assertEqual(stood.command_left[5490], 0.0)
        self.assertNotEqual(restless.command_left[5490], 0.0)
        numpy.testing.assert_allclose(stood.speed[5500:6000:100], restless.speed[5500:6000:100], atol=0.01)


class Slip(unittest.TestCase):
    """The slip of a skid-steer robot comes out of its contacts; its true effective track in place is 0.547 m."""

    def test_a_change_of_friction_is_learned_within_three_seconds(self):
        for friction in (0.25, 1.0):
            for forward, yaw_rate in ((0.0, 0.5), (0.5, 0.5)):
                motion = motions.step(forward, yaw_rate, 6.0)._replace(faults=(jackal_aic.Fault('friction', 3.5, value=friction),))
                self.assertAlmostEqual(drive('predictive', 'ground', motion).yaw_rate[-500:].mean(), yaw_rate, delta=0.02 * yaw_rate)

    def test_ten_minutes_straight_teach_no_turn(self):
        cases = []
        for end in (4.51, 604.5):
            for step, noise, speed in ((0.3, 0.03, 0.1), (0.153, 0.15, 0.5)):
                motion = points((0.5, 0.3, 0.5), (3.5, 0.0, 0.0), (4.5, speed, 0.0), until=end)
                cases.append(('predictive', 'ground', motion, {'plant.encoder_step': step, 'plant.encoder_noise': noise}))
        tracks = [found.effective_track for _, found in drives(cases, samples_only=True)]
        for before, after in zip(tracks[:2], tracks[2:]):
            self.assertAlmostEqual(after, before, delta=0.01 * before)

    def test_a_turn_in_place_after_joystick_driving_settles_at_once(self):
        cases = []
        for seed in range(1, 7):
            joystick = motions.joystick(seed, 60.0)
            motion = with_step(points(*joystick.set_points, (60.0, 0.0, 0.0), until=63.0), 63.0, (0.0, 0.8))
            cases.append(('predictive', 'ground', motion, {'plant.seed': seed}))
        for case, found in drives(cases):
            self.assertLessEqual(metrics.response(found, case[2])['settling_s'], 0.3, case[3])

    def test_a_turn_on_a_ramp_is_bounded_and_reported(self):
        """On a ramp of 12 degrees a turn slides the robot sideways: its wheels keep their range, and a fault is reported."""
        for preset in ('predictive', 'improved'):
            for friction in (0.5, 0.3):
                found = drive(preset, 'ground', points((2.0, 0.0, 0.8), until=10.0), {'plant.slope': 12.0, 'plant.friction': friction},
                              monitor=True)
                geometry = engine.settings('ground', preset)['geometry']
                asked = 0.5 * 0.8 * geometry['effective_track'] / geometry['wheel_radius']
                self.assertLessEqual(abs(found.command_left).max(), 1.5 * asked + 0.5, (preset, friction))
                self.assertEqual(found.fault.any(), friction < 0.5, (preset, friction))


class Offset(unittest.TestCase):
    """Motors that turn slower than commanded by an offset (clearpath_robot#280), and controllers whose model knows it."""

    OFFSET = 0.5  # rad/s
    KNOWN = {'plant.wheel_offset': OFFSET, 'plant_model.offset': OFFSET}

    def stop(self, set_point, overrides):
        """Mean speeds and errors of the belief before the stop, and stops.assess(); an arc is driven twice, to learn its slip first."""
        once = motions.stop(*set_point, 4.0, 3.0)
        begin = once.duration if set_point[1] else 0.0
        motion = motions.Motion(once.set_points + tuple((begin + time, *rest) for time, *rest in once.set_points if begin), begin + once.duration)
        found = drive('predictive', 'ground', motion, dict(LIMITS, **overrides))
        late = found.time >= begin - 1e-9
        found.time, found.command_left, found.command_right = found.time[late] - begin, found.command_left[late], found.command_right[late]
        found.speed, found.yaw_rate = found.speed[late], found.yaw_rate[late]
        end = (found.time > 4.0) & (found.time < 4.5)
        means = [values[end].mean() for values in (found.speed, found.yaw_rate, found.believed_speed[late] - found.speed,
                                                   found.believed_yaw_rate[late] - found.yaw_rate)]
        return means, stops.assess(found, *set_point, 4.0)

    def assert_as_without(self, set_point, overrides):
        """Within 2 % of the set point as motors without an offset, settled in 1.25 times the time."""
        (nominal, quick), (known, figures) = self.stop(set_point, {}), self.stop(set_point, overrides)
        slack = [max(0.02 * abs(set_point[0]), 1e-3), max(0.02 * abs(set_point[1]), 2e-3)]
        for ours, wanted, delta in zip(known, nominal, slack + slack):
            self.assertAlmostEqual(ours, wanted, delta=delta, msg=set_point)
        self.assertLessEqual(figures['settling_s'], 1.25 * quick['settling_s'], set_point)
        self.assertLessEqual(figures['overshoot_pct'], max(5.0, quick['overshoot_pct'] + 2.0), set_point)

    def test_known_to_the_model_it_disturbs_no_drive(self):
        for set_point in ((0.1, 0.0), HALF, (1.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.3, 0.3), (0.5, -0.5), (1.0, 1.0)):
            self.assert_as_without(set_point, self.KNOWN)

    def test_known_to_the_model_it_is_no_fault(self):
        wanted = ((0.1, 0.0), (1.0, 0.0), (-0.5, 0.0), (0.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.05, -0.3), (0.0, 0.0), (0.03, 0.0), (0.0, 0.0))
        motion = points(*((0.5 + 3.0 * i, *set_point) for i, set_point in enumerate(wanted)), until=0.5 + 3.0 * len(wanted))
        for seed, known in enumerate((0.35, 0.5, 0.65, 0.5)):
            found = drive('predictive', 'ground', motion, {**LIMITS, **self.KNOWN, 'plant_model.offset': known, 'plant.seed': 1 + seed},
                          monitor={'offset': known}, samples_only=True)
            self.assertEqual([text for _, text, _ in found.findings if text], [], (known, seed))

    def identified(self, overrides):
        """What `identify` finds in steps of half and full speed, straight and turning."""
        parts = [(1.2, part * speed, part * turn) for speed, turn in ((0.6, 0.0), (0.0, 1.0)) for part in (0.5, -0.5, 1.0, -1.0)]
        motion = motions.segments([rest for part in parts for rest in (part, (0.8, 0.0, 0.0))])
        found = drive('diff_drive', 'ground', motion, overrides)
        columns = numpy.column_stack((found.time, found.command_left, found.command_right, found.measured_left, found.measured_right))
        return jackal_aic.identify(columns[::20, :3], columns[::20, (0, 3, 4)])

    def test_it_is_identified_and_driven_by(self):
        robot = {'plant.wheel_offset': self.OFFSET, 'plant.wheel_gain': 0.9}
        found = self.identified(robot)
        self.assertGreater(found.offset.half_width, 0.0)
        self.assertAlmostEqual(found.offset.value, 0.9 * self.OFFSET, delta=found.offset.half_width)
        model = {'plant_model.' + key: getattr(found, key).value for key in ('dead_time', 'lag', 'gain', 'offset', 'acceleration_limit')}
        for speed in (0.1, 0.5):
            self.assert_as_without((speed, 0.0), dict(robot, **model))
        self.assertLess(self.identified({}).offset.value, 0.05)


class Unidentified(unittest.TestCase):
    """Robots that were not identified, driven with the assumed model; `experiments unidentified` drives all of them."""

    ASKED = 1.65  # m/s^2, the assumed limit

    def response(self, robot, set_point, preset='predictive'):
        model = {'plant_model.' + key: value for key, value in robots.assumed_model().items()}
        plant = engine.settings('ground', preset)['plant']
        motion = motions.Motion(((1.0, *set_point),), 6.0, 'speed', 1.0, 6.0)
        scaled = {'plant.' + key: plant[key] * ratio for key, ratio in robot.items() if key != 'seed'}
        return response(preset, 'ground', motion, {**model, **scaled, 'plant.seed': robot.get('seed', 1)})

    def test_the_assumed_model_is_stable_on_every_robot_within_the_range(self):
        assumed, parameters = robots.assumed_model(), jackal_aic.Parameters('predictive', 'assumed')
        for dead_time in (0.5, 1.0, 2.0):
            for lag in (0.5, 1.0, 2.0):
                for gain in (0.8, 1.0, 1.2):
                    robot = {'dead_time': dead_time * assumed['dead_time'], 'lag': lag * assumed['lag'], 'gain': gain * assumed['gain']}
                    self.assertLess(jackal_aic.certify(parameters, robot).loop_spectral_radius, 0.98, robot)

    def test_wheels_reach_their_goal_together(self):
        """A belief that takes motors of a lower gain for weak ones leaves one wheel below its goal until it notices, before the other."""
        for gain in (0.9, 1.0):
            for set_point, fastest_wheel in (((1.5, 0.0), 1.5), ((1.0, -1.0), 1.22), ((0.5, 0.5), 0.61)):
                for seed in (1, 2, 3):
                    found = self.response({'wheel_gain': gain, 'seed': seed}, set_point)
                    self.assertLess(found['settling_s'], fastest_wheel / self.ASKED + 0.65, (gain, set_point, seed))

    def test_a_wrong_gain_is_made_up_for_in_the_first_motion(self):
        for gain in (0.8, 0.84, 0.87, 0.9):
            for set_point, settles in ((HALF, 0.64), ((1.0, 0.0), 0.85)):
                found = self.response({'wheel_gain': gain, 'seed': 2}, set_point)
                self.assertLess(found['settling_s'], settles, (gain, set_point))
                self.assertLess(found['overshoot_pct'], 3.0, (gain, set_point))

    def test_it_accelerates_more_in_the_first_acceleration(self):
        """The wheels follow the assumed limit, so more is tried. Weaker motors do not wind up."""
        for limit, settles in ((0.5, 1.45), (1.0, 0.85), (2.5, 0.65)):
            found = self.response({'acceleration_limit': limit}, (1.0, 0.0))
            self.assertLess(found['settling_s'], settles, limit)
            self.assertLess(found['overshoot_pct'], 5.0, limit)

    def test_the_thesis_action_does_not_wind_up_with_weaker_motors(self):
        """Without its bound while a wheel is under way it overshoots by 8 to 37 %."""
        for preset in ('standard', 'improved', 'tuned'):
            for robot in ({'acceleration_limit': 0.5}, {'acceleration_limit': 0.6, 'dead_time': 2.0}):
                for set_point in (HALF, (1.0, 0.0)):
                    self.assertLess(self.response(robot, set_point, preset)['overshoot_pct'], 5.0, (preset, robot, set_point))


class UnknownDriveTrain(unittest.TestCase):
    """Robots whose dead time or gain is configured wrong: `predictive` learns them in ten seconds at a joystick."""

    OFF = 0.08  # s, by which the configured dead time is wrong
    OPEN = {'predictive.learn_drive_train': False}

    @staticmethod
    def joystick(seed, step=None):
        """Ten seconds at a joystick, a pause of three, and a step that is assessed."""
        driving = points(*motions.joystick(seed, 10.5).set_points, (10.5, 0.0, 0.0), until=13.5)
        return with_step(driving, 13.5, step) if step else driving

    @staticmethod
    def settings(plant, overrides=None):
        return engine.settings(plant, 'predictive', overrides)

    def wrong(self, plant, off, robot):
        return dict(robot, **{'plant_model.dead_time': max(0.0, self.settings(plant)['plant_model']['dead_time'] + off)})

    def learned(self, plant, motion, robot, wrongs, slack=0.0):
        """The models learned from wrong ones, whose last step is as fast as that of a controller that knows the robot."""
        cases = [('predictive', plant, motion, overrides) for overrides in (dict(robot, **self.OPEN), *wrongs)]
        best, *found = (found for _, found in drives(cases))
        bar = metrics.response(best, motion)
        for one in found:
            step = metrics.response(one, motion)
            self.assertLessEqual(step['settling_s'], 1.25 * bar['settling_s'] + slack, (plant, robot))
            self.assertLessEqual(step['overshoot_pct'], max(10.0 if slack else 5.0, bar['overshoot_pct'] + 2.0), (plant, robot))
        return [one.plant_model for one in found]

    def test_the_dead_time_is_learned(self):
        soft = {'plant.velocity_loop_stiffness': 3.5, 'plant.velocity_loop_integral': 8.0}  # lags at first and then runs ahead
        late = {'plant.encoder_step': 0.1, 'plant.stamp_jitter': 0.008}
        for plant, step, robot, delay, tolerance in (
                ('ground', HALF, {}, 0.0, 0.01), ('box', HALF, {}, 0.0, 0.01), ('ground', (0.1, 0.0), {}, 0.0, 0.01),
                ('ground', (1.5, 0.0), {}, 0.0, 0.01), ('ground', (0.0, 0.5), {}, 0.0, 0.01), ('ground', HALF, late, 0.004, 0.01),
                ('ground', HALF, {'plant.acceleration_limit': 4.0}, 0.0, 0.01), ('ground', HALF, {'plant.acceleration_limit': 0.825}, 0.0, 0.01),
                ('box', HALF, {'plant.acceleration_limit': 12.5}, 0.0, 0.01), ('ground', HALF, {'plant.wheel_gain': 0.8}, 0.0, 0.01),
                ('ground', HALF, soft, 0.0, 0.02)):
            truth = self.settings(plant, robot)['plant']['dead_time'] + delay
            for seed in (1, 2) if (plant, step, robot) == ('ground', HALF, {}) else (1,):
                wrongs = [self.wrong(plant, off, robot) for off in (-self.OFF, self.OFF)]
                for model in self.learned(plant, self.joystick(seed, step), robot, wrongs):
                    self.assertAlmostEqual(model['dead_time'], truth, delta=tolerance, msg=(plant, step, robot, seed))

    def test_the_gain_is_learned(self):
        for plant in ('ground', 'box'):
            truth = self.settings(plant)['plant_model']['gain']
            for step in (HALF, (1.5, 0.0), (0.0, 0.8)):
                wrongs = [{'plant_model.gain': share * truth} for share in (0.8, 1.25)]
                for model in self.learned(plant, self.joystick(1, step), {}, wrongs, 0.05):
                    self.assertAlmostEqual(model['gain'], truth, delta=0.03 * truth, msg=(plant, step))

    def test_it_includes_all_delays_of_the_real_robot(self):
        # 0.08 s of the motors, 10 ms of the network to them, 10 ms for which the newest feedback waits for its joint states,
        # 2.5 ms of their stamps, 10 ms of the network from them; a lag of 6 ms of the motors and 20 ms of the encoders.
        for seed in (1, 2, 3, 4):
            cases = [('predictive', 'real', self.joystick(seed), self.wrong('real', off, {})) for off in (-self.OFF, 0.0, self.OFF)]
            delays = [found.plant_model['dead_time'] + found.plant_model['lag'] for _, found in drives(cases)]
            self.assertLess(max(delays) - min(delays), 0.01, seed)
            for delay in delays:
                self.assertAlmostEqual(delay, 0.1389, delta=0.016, msg=seed)

    def test_it_stays_without_excitation_or_when_disabled(self):
        cases = [('predictive', plant, points((0.5, *wanted), until=until), {}) for plant, wanted in (('box', (0.3, 0.5)), ('real', HALF))
                 for until in (10.0, 200.0)]
        box, box_later, real, real_later = [found.plant_model for _, found in drives(cases, samples_only=True)]
        self.assertEqual(box['dead_time'], self.settings('box')['plant_model']['dead_time'])
        self.assertEqual((box, real), (box_later, real_later))
        disabled = drive('predictive', 'ground', self.joystick(1), dict(self.wrong('ground', self.OFF, {}), **self.OPEN))
        self.assertAlmostEqual(disabled.plant_model['dead_time'], 0.16)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'closed_loop', '__main__')
