#!/usr/bin/python3
"""Output twist behind twist_mux, where a joystick takes the motors and gives them back. Argument: what shows the controller that,
cmd_drive, mux or nothing."""

import sys

import rospy
from geometry_msgs.msg import Twist
from jackal_aic.msg import ControllerState
from jackal_msgs.msg import Drive

from simulated_robot import RADIUS, RobotTest, advertise, run_test

TOLD = sys.argv[1]
SPEED, TRACK = 0.5, 0.5621  # m/s, m
MUX_TIMEOUT = 0.5  # s for which a silent joystick keeps its priority
STOP_TIMEOUT = 0.25  # s without a twist after which the stock velocity controller stops the wheels


class Mux:
    """twist_mux and the stock velocity controller: hands the robot a joystick's wish (forward, yaw rate) or the controller's."""

    def __init__(self):
        self.joystick, self.until, self.last, self.last_time, self.wheels, self.largest_step = None, 0.0, (0.0, 0.0), 0.0, (0.0, 0.0), 0.0
        self.output, self.drive = advertise('jackal_velocity_controller/cmd_vel', Twist), advertise('cmd_drive', Drive)
        self.subscriber = rospy.Subscriber('cmd_vel', Twist, self.take, tcp_nodelay=True)

    def give_back(self, gap):
        self.joystick, self.until = None, rospy.get_time() + gap

    def take(self, twist):
        now, joystick = rospy.get_time(), self.joystick
        if joystick or now >= self.until:
            self.last, self.last_time = joystick or (twist.linear.x, twist.angular.z), now
            shown = Twist()
            shown.linear.x, shown.angular.z = self.last
            self.output.publish(shown)
        if now - self.last_time > STOP_TIMEOUT:
            self.last = (0.0, 0.0)
        forward, turn = self.last[0] / RADIUS, 0.5 * TRACK * self.last[1] / RADIUS
        wheels = (forward - turn, forward + turn)
        self.largest_step = max([self.largest_step] + [abs(a - b) for a, b in zip(wheels, self.wheels)])
        self.wheels = wheels
        self.drive.publish(Drive.MODE_VELOCITY, list(wheels))


class TwistMux(RobotTest):

    def setUp(self):
        super().setUp()
        if self._testMethodName == 'test_0_without_a_multiplexer_nobody_listens':
            return
        self.mux = Mux()
        self.addCleanup(self.mux.subscriber.unregister)
        self.robot.rest()
        self.robot.command(SPEED)
        self.robot.run(3.0)
        self.assertAlmostEqual(self.robot.speed(), SPEED, delta=0.05 * SPEED)
        self.robot.clear()

    def uninterrupted(self):
        self.assertEqual({state.status for state in list(self.robot.states)}, {ControllerState.DRIVING})

    def joystick_drives(self, forward, yaw_rate, gap):
        """While the set point goes on; then the robot takes it up by itself, without a jump or an overshoot."""
        self.mux.joystick = forward, yaw_rate
        self.robot.run(3.0)
        self.uninterrupted()
        if TOLD != 'nothing':
            self.assertAlmostEqual(self.robot.speed(), forward, delta=0.05)
            self.assertIn('another source', self.robot.states[-1].reason)
        self.mux.largest_step = 0.0
        self.robot.clear()
        self.mux.give_back(gap)
        self.robot.run(4.0 + 2.0 * gap)
        self.uninterrupted()
        self.assertAlmostEqual(self.robot.speed(), SPEED, delta=0.05 * SPEED, msg=self.robot.states[-1].reason)
        self.assertAlmostEqual(self.robot.yaw_rate(), 0.0, delta=0.05)
        self.assertLessEqual(max(self.robot.series('forward')[1]), 1.3 * SPEED)
        if TOLD != 'nothing':
            self.assertEqual(self.robot.states[-1].reason, '')

    def test_0_without_a_multiplexer_nobody_listens(self):
        """The first: wheels that stand although they are commanded look like those of a robot that another node drives."""
        self.robot.rest()
        self.robot.command(SPEED)
        self.robot.run(2.0)
        self.assertAlmostEqual(self.robot.speed(), 0.0, delta=0.02)
        self.robot.clear()
        self.robot.run(1.0)
        self.assertEqual({(state.status, state.reason, state.driven_by) for state in list(self.robot.states)},
                         {(ControllerState.DRIVING, 'no subscriber on /cmd_vel: is twist_mux running?', ControllerState.BY_NOBODY)})

    def test_drives_on_when_a_joystick_gives_the_motors_back(self):
        self.joystick_drives(0.2, 0.6, 0.0)
        self.assertLessEqual(self.mux.largest_step, 20.1 * 0.02 / RADIUS, 'no jump beyond the limit of the acceleration')

    def test_drives_on_after_the_silence_of_the_joystick(self):
        self.joystick_drives(-0.3, 0.0, MUX_TIMEOUT)

    def test_a_second_publisher_is_named_and_left_the_motors(self):
        """The multiplexer cannot tell the two apart: both have the motors in turns."""
        intruder = advertise('cmd_vel', Twist)
        self.robot.wait(lambda: self.robot.state().status == ControllerState.FAULTED, 'the controller to notice', 30.0)
        self.assertIn(rospy.get_name() + ' on /cmd_vel', self.robot.states[-1].reason)
        intruder.unregister()
        self.robot.command(0.0)
        self.robot.wait(lambda: self.robot.state().status == ControllerState.DRIVING, 'its acknowledgement', 30.0)


if __name__ == '__main__':
    run_test(**{TOLD: TwistMux})
