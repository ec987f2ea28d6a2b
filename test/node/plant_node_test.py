#!/usr/bin/python3
"""The simulated robot as a node: rates, commands, an IMU that is pulled, reset, and how it waits for its controller."""

import math
import time
import unittest

import rospy
from jackal_aic.msg import ControllerState
from jackal_msgs.msg import Drive, Feedback
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock, Log as Line
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Empty, SetBool
from tf2_msgs.msg import TFMessage

from simulated_robot import Log, PATIENCE, RADIUS, advertise, call, run_test


PERIOD = 20  # ms, parameter lockstep


def gaps(messages, stamp=lambda message: message.header.stamp):
    """Between consecutive stamps, without jumps back [ms]."""
    times = [stamp(message).to_sec() for message in messages]
    return {round(1e3 * (b - a)) for a, b in zip(times, times[1:]) if b > a}


class Plant(unittest.TestCase):

    def wait(self, condition, what=''):
        end = time.monotonic() + PATIENCE
        while not condition() and time.monotonic() < end:
            time.sleep(0.002)
        self.assertTrue(condition(), what)


class PlantNode(Plant):

    @classmethod
    def setUpClass(cls):
        cls.clock, cls.truth = Log('/clock', Clock), Log('/ground_truth/odom', Odometry)
        cls.joints, cls.imu, cls.feedback = Log('/joint_states', JointState), Log('/imu/data', Imu), Log('/feedback', Feedback)
        cls.transforms, cls.lines = Log('/tf', TFMessage), Log('/rosout', Line)
        cls.drive_topic = advertise('/cmd_drive', Drive)

    def setUp(self):
        self.wait(lambda: self.drive_topic.get_num_connections() > 0 and self.truth and self.joints and self.imu and
                  self.feedback and self.transforms)
        self.reset()

    def now(self):
        return self.clock[-1].clock.to_sec()

    def run_for(self, seconds):
        end = self.now() + seconds
        self.wait(lambda: self.now() >= end and self.truth[-1].header.stamp.to_sec() >= end - 0.02)

    def reset(self):
        self.clock.clear()
        call('/plant/reset', Empty)
        self.wait(lambda: self.clock and self.now() < 0.5 and self.truth[-1].header.stamp.to_sec() <= self.now() + 0.02)
        self.run_for(0.1)

    def drive(self, left, right, mode=Drive.MODE_VELOCITY):
        self.drive_topic.publish(mode, [left, right])

    def speed(self):
        return self.truth[-1].twist.twist.linear.x

    def yaw_rate(self):
        return self.truth[-1].twist.twist.angular.z

    def test_keeps_its_rates_on_its_own_clock(self):
        self.run_for(1.0)
        self.assertEqual(min(gaps(self.clock, lambda message: message.clock)), 5)
        for log, gap in ((self.joints, 20), (self.imu, 20), (self.feedback, 20), (self.truth, 10)):
            self.assertEqual(gaps(log), {gap})
        self.assertEqual(gaps(self.transforms, lambda message: message.transforms[0].header.stamp), {20})
        self.assertEqual(self.joints[-1].name, ['front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel'])

    def test_the_imu_states_its_noise(self):
        self.addCleanup(rospy.set_param, '/plant/plant/noise_scale', 0)
        rospy.set_param('/plant/plant/noise_scale', 2.0)
        self.reset()
        self.imu.clear()
        self.wait(lambda: self.imu)
        message = self.imu[0]
        for name, covariance in (('gyro', message.angular_velocity_covariance), ('accelerometer', message.linear_acceleration_covariance)):
            variance = (2.0 * rospy.get_param('/plant/plant/{}_noise'.format(name))) ** 2
            for i, value in enumerate(covariance):
                self.assertAlmostEqual(value, variance if i % 4 == 0 else 0.0)
        self.assertEqual(message.header.frame_id, 'imu_link')
        self.assertAlmostEqual(message.linear_acceleration.z, 9.81, delta=0.5)
        self.assertAlmostEqual(abs(message.orientation.w), 1.0, delta=0.01)

    def test_drives_by_velocity_commands_until_none_comes(self):
        self.drive(0.3 / RADIUS, 0.3 / RADIUS)
        self.drive(-1.0, -1.0, Drive.MODE_PWM)
        self.drive(math.nan, 3.0)
        self.run_for(1.5)
        self.assertAlmostEqual(self.speed(), 0.3, delta=1e-3)
        self.assertAlmostEqual(self.joints[-1].velocity[0], 0.3 / RADIUS, delta=1e-3)
        self.assertEqual((self.feedback[-1].commanded_mode, self.feedback[-1].actual_mode), (Drive.MODE_VELOCITY, Drive.MODE_VELOCITY))
        self.assertAlmostEqual(self.feedback[-1].drivers[1].measured_velocity, 0.3 / RADIUS, delta=1e-3)
        self.run_for(7.5)
        self.assertAlmostEqual(self.speed(), 0.0, delta=1e-3, msg='command_timeout is 8 s')
        self.drive(-0.1 / RADIUS, 0.1 / RADIUS)
        self.run_for(1.5)
        self.assertGreater(self.yaw_rate(), 0.2)
        self.assertAlmostEqual(self.imu[-1].angular_velocity.z, self.yaw_rate(), delta=1e-2)
        self.drive(5.0, 5.0, Drive.MODE_NONE)
        self.run_for(1.5)
        self.assertAlmostEqual(self.yaw_rate(), 0.0, delta=1e-3)
        self.assertEqual(self.feedback[-1].commanded_mode, Drive.MODE_NONE)

    def test_pulls_the_imu(self):
        call('/plant/pull_imu', SetBool, True)
        self.run_for(0.1)
        self.imu.clear()
        self.run_for(0.5)
        self.assertFalse(self.imu)
        call('/plant/pull_imu', SetBool, False)
        self.run_for(0.5)
        self.assertGreater(len(self.imu), 10)

    def test_reset_puts_everything_back_and_takes_parameters_anew(self):
        self.drive(3.0, 3.0)
        self.run_for(1.5)
        self.assertGreater(self.truth[-1].pose.pose.position.x, 0.1)
        rospy.set_param('/plant/plant/encoder_step', 0.5)
        self.reset()
        self.assertAlmostEqual(self.truth[-1].pose.pose.position.x, 0.0, delta=1e-6)
        self.drive(3.2, 3.2)
        self.joints.clear()
        self.run_for(1.5)
        for sample in self.joints:
            self.assertAlmostEqual(math.remainder(sample.velocity[0], 0.5), 0.0)
        rospy.set_param('/plant/plant/encoder_step', -1.0)
        before = self.now()
        with self.assertRaises(rospy.ServiceException, msg='out of range'):
            call('/plant/reset', Empty)
        self.run_for(0.1)
        self.assertGreaterEqual(self.now(), before, 'and the robot is left as it is')
        rospy.delete_param('/plant/plant/encoder_step')

    def test_reset_names_a_parameter_that_nobody_knows(self):
        for name in ('plant/fricton', 'lockstop'):
            rospy.set_param('/plant/' + name, 0.2)

            def told():  # again until the plant's log is connected
                with self.assertRaises(rospy.ServiceException):
                    call('/plant/reset', Empty)
                return any(name.split('/')[-1] in line.msg for line in self.lines)

            self.wait(told)
            rospy.delete_param('/plant/' + name)


class Lockstep(Plant):
    """The simulation waits for its controller: the test is one that is as late as it likes."""

    @classmethod
    def setUpClass(cls):
        cls.clock, cls.drive = Log('/clock', Clock), advertise('/cmd_drive', Drive)
        cls.state = advertise('/jackal_AIC/state', ControllerState)

    def setUp(self):
        self.wait(lambda: self.clock and self.drive.get_num_connections() > 0 and self.state.get_num_connections() > 0, 'the plant')

    def now(self):
        """[ms]"""
        return round(1e3 * self.clock[-1].clock.to_sec())

    def command(self):
        self.drive.publish(Drive.MODE_VELOCITY, [0.0, 0.0])

    def acted(self, ms):
        """Says that the last action was at this time."""
        state = ControllerState()
        state.header.stamp = rospy.Time.from_sec(1e-3 * ms)
        self.state.publish(state)

    def standstill(self):
        """Where the clock stands, once it does [ms]."""
        last, since = None, time.monotonic()

        def stands():
            nonlocal last, since
            if last != self.now():
                last, since = self.now(), time.monotonic()
            return time.monotonic() - since > 0.2

        self.wait(stands, 'the clock goes on')
        return self.now()

    def expect(self, ms, what):
        self.wait(lambda: self.now() >= ms, what)
        self.assertEqual(self.standstill(), ms, what)

    def test_the_clock_comes_with_every_sample_and_hardly_else(self):
        joints, truth = Log('/joint_states', JointState), Log('/ground_truth/odom', Odometry)
        self.clock.clear()
        self.wait(lambda: len(joints) + len(truth) > 300 and len(self.clock) > 10, 'samples')
        clocks = [message.clock for message in list(self.clock)]
        for sample in list(joints) + list(truth):
            if clocks[0] <= sample.header.stamp <= clocks[-1]:
                self.assertIn(sample.header.stamp, clocks)
        self.assertLess(len(clocks), 160.0 * (clocks[-1] - clocks[0]).to_sec(), 'ground truth at 100 Hz, the others at 50')

    def test_each_command_lets_one_period_pass_and_silence_all(self):
        start = self.now()
        self.wait(lambda: self.now() > start + 10 * PERIOD, 'waits for a controller that never spoke')
        self.command()
        self.command()
        held = self.standstill()
        for i in range(1, 6):
            self.command()
            self.expect(held + i * PERIOD, i)
        self.wait(lambda: self.now() > held + 20 * PERIOD, 'waits for ever for a controller that fell silent')

    def test_when_it_acted_counts_and_not_when_its_command_came(self):
        """The last one: before it the plant has heard of no action."""
        self.wait(lambda: self.now() > 2000, 'a time to look back to')
        self.command()
        self.command()
        held = self.standstill()
        for late in (7, 7, 0, 15):
            self.acted(held - late)
            self.command()
            held += PERIOD - late
            self.expect(held, late)
        # Neither another clock's time nor one to come is an action's; after them the command counts again.
        self.acted(held - 1000)
        self.acted(held + 10)
        self.assertEqual(self.standstill(), held)
        self.command()
        self.expect(held + PERIOD, 'the command')


if __name__ == '__main__':
    run_test(plant_node=PlantNode, lockstep=Lockstep)
