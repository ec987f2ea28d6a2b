#!/usr/bin/python3
"""Who may command a running controller and as what: enable and reset, set points, gains, the wheel topics of Gazebo."""

import xmlrpc.client

import rosgraph
import rospy
from dynamic_reconfigure.srv import Reconfigure
from dynamic_reconfigure.msg import Config, DoubleParameter
from geometry_msgs.msg import TwistStamped
from jackal_aic.msg import ControllerState
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log as Line
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger

from simulated_robot import Log, Process, RADIUS, RobotTest, advertise, call, command, configure, run_test


class Base(RobotTest):

    def setUp(self):
        self.lines = Log('/rosout', Line)
        super().setUp()

    def expect_logged(self, words, meanwhile=lambda: None):
        def told():
            meanwhile()
            return any(words in line.msg for line in list(self.lines))
        self.robot.wait(told, words, 30.0)

    def drive(self, forward, seconds=2.5):
        self.robot.command(forward)
        self.robot.run(seconds)
        self.assertAlmostEqual(self.robot.speed(), forward, delta=0.02, msg=self.robot.state().reason)


class Services(Base):

    def test_disabled_it_stands_until_it_is_enabled_and_told_to_anew(self):
        way = Log('odom', Odometry)
        self.robot.rest()
        self.drive(0.5)
        self.assertFalse(call('/controller/reset', Trigger).success, 'on the move')
        self.assertTrue(call('/controller/enable', SetBool, False).success)
        self.robot.run(1.0)
        state = self.robot.states[-1]
        self.assertEqual((state.status, state.reason, state.command_left), (ControllerState.STOPPED, 'disabled', 0.0))
        before = way[-1].pose.pose.position.x
        self.assertTrue(call('/controller/reset', Trigger).success)
        self.assertTrue(call('/controller/enable', SetBool, True).success)
        self.robot.run(1.0)
        self.assertAlmostEqual(self.robot.speed(), 0.0, delta=0.02)
        self.assertIn('zero set point', self.robot.states[-1].reason)
        self.assertAlmostEqual(way[-1].pose.pose.position.x, before, delta=0.01, msg='an odometry frame does not jump')
        self.robot.command(0.0)
        self.robot.run(0.5)
        self.drive(0.5)
        self.robot.rest()
        saved = call('/controller/save_learned_model', Trigger)
        self.assertFalse(saved.success)
        self.assertIn('slip.file is not set', saved.message)

    def test_a_dead_publisher_that_the_master_lists_does_not_count(self):
        self.robot.rest()
        self.drive(0.5)
        self.robot.clear()
        master = xmlrpc.client.ServerProxy(rosgraph.get_master_uri())
        uri = 'http://127.0.0.1:1/'  # nothing answers there
        master.registerPublisher('/dead', '/cmd_drive', 'jackal_msgs/Drive', uri)
        for _ in range(8):
            self.robot.run(1.0)  # the controller looks every 0.5 s of wall time
        master.unregisterPublisher('/dead', '/cmd_drive', uri)
        self.assertEqual({state.status for state in list(self.robot.states)}, {ControllerState.DRIVING})


class SetPoints(Base):
    """The robot's own publisher is on jackal_AIC/set_point, which the controller does not know here: it obeys /wanted."""

    def wait_until_ready(self):
        self.robot.wait(lambda: self.robot.now() > 0.0 and self.robot.states and self.robot.truth, 'the controller')

    def drives(self):
        state = self.robot.states[-1]
        return state.status == ControllerState.DRIVING and state.driven_by == ControllerState.BY_US

    def test_stamped_ones_are_obeyed_unless_old_or_of_another_clock(self):
        self.robot.run(1.0)
        topic, message = advertise('/wanted_stamped', TwistStamped), TwistStamped()
        self.robot.wait(lambda: topic.get_num_connections() > 0, 'the controller')
        message.twist.linear.x = 0.3

        def send(age):
            message.header.stamp = rospy.Time.now() - rospy.Duration(age)
            topic.publish(message)
            self.robot.run(0.05)

        for _ in range(20):
            send(0.0)
        self.assertTrue(self.drives(), self.robot.states[-1].reason)
        self.assertEqual(self.robot.states[-1].set_point_forward, 0.3)
        for _ in range(40):
            send(1.0)
        state = self.robot.states[-1]
        self.assertEqual((state.status, state.driven_by, state.reason), (ControllerState.STOPPED, ControllerState.BY_NOBODY, 'set point too old'))
        self.expect_logged('Set points on /wanted_stamped are stamped 1000 s ahead of this node\'s clock', lambda: send(-1000.0))
        self.expect_logged('Set points on /wanted_stamped are stamped 3 s behind this node\'s clock', lambda: send(3.0))
        self.assertFalse(self.drives())

    def test_two_nodes_are_refused_with_their_names(self):
        self.robot.run(1.0)
        publish = "rostopic pub -r 20 /wanted geometry_msgs/Twist '{linear: {x: 0.2}}' __name:="
        with command(publish + 'first_driver'):
            self.robot.wait(self.drives, 'to drive by the first', 60.0)
            with command(publish + 'second_driver'):
                self.robot.wait(lambda: self.robot.states[-1].status == ControllerState.STOPPED and
                                'more than one node publishes set points' in self.robot.states[-1].reason, 'to stop between the two', 60.0)
                self.assertEqual(self.robot.states[-1].driven_by, ControllerState.BY_NOBODY)
                for name in ('/first_driver', '/second_driver', '/wanted'):
                    self.assertIn(name, self.robot.states[-1].reason)
            self.robot.wait(self.drives, 'to drive by the first alone', 60.0)


class Gains(Base):

    def request(self, **wanted):
        answer = call('/controller/controller/set_parameters', Reconfigure, Config(doubles=[DoubleParameter(*item) for item in wanted.items()]))
        return {number.name: number.value for number in answer.config.doubles}

    def setUp(self):
        super().setUp()
        self.robot.wait(lambda: self.lines or not self.request(kappa_a=8.001) or not self.request(kappa_a=8.0), 'the log of the controller')
        self.drive(0.5, 3.0)
        self.robot.clear()

    def expect_steady(self):
        self.robot.run(1.0)
        commands = [state.command_left for state in self.robot.states]
        self.assertLess(max(abs(b - a) for a, b in zip(commands, commands[1:])), 0.1, 'of 5.1 rad/s')
        self.assertAlmostEqual(self.robot.speed(), 0.5, delta=0.02)

    def test_stable_ones_take_over_without_a_jump(self):
        answer = self.request(kappa_a=5.0, tau=0.003)
        self.assertEqual((answer['kappa_a'], answer['tau'], answer['kappa_mu']), (5.0, 0.003, 0.1))
        self.expect_steady()
        self.expect_logged('Changed tau 0.001 -> 0.003, kappa_a 8 -> 5')
        self.request(kappa_a=25.0, tau=0.001)
        self.expect_logged('Stable, but with a thin margin (below 1.5 or 0.03 s)')
        self.request(kappa_a=8.0)

    def test_others_are_refused_with_the_reason_and_change_nothing(self):
        for wanted, words in (({'kappa_a': 60.0}, 'kappa_a = 60 is too large: stable below'),
                              ({'kappa_a': 0.0, 'tau': 0.002}, 'kappa_a = 0 never corrects the action: raise it'),
                              ({'kappa_a': -1.0}, 'Refused kappa_a 8 -> -1: controller.kappa_a = -1'),
                              ({'kappa_a': 5.0, 'tau': 11.0}, 'Refused tau 0.001 -> 11, kappa_a 8 -> 5: controller.tau = 11'),
                              ({'tau': float('nan')}, 'controller.tau = nan')):
            answer = self.request(**wanted)
            self.assertEqual((answer['kappa_a'], answer['tau']), (8.0, 0.001), wanted)
            self.expect_logged(words)
        self.assertEqual(rospy.get_param('/controller/controller/kappa_a'), 8.0)
        self.expect_steady()

    def test_certifying_does_not_hold_the_loop(self):
        before, meanwhile = len(self.robot.states), 0
        for _ in range(20):
            before = len(self.robot.states)
            self.request(kappa_a=60.0)
            meanwhile += len(self.robot.states) - before
        self.assertGreater(meanwhile, 20, 'certified in the thread of the actions, a request would see one action at most')


class Gazebo(Base):

    def test_the_robot_is_driven_through_the_wheel_topics(self):
        wheels = [Log('jackal_{}_wheel/command'.format(side), Float64) for side in ('left', 'right')]
        self.drive(0.5, 4.0)
        for wheel in wheels:
            self.assertAlmostEqual(wheel[-1].data, 0.5 / RADIUS, delta=0.5)
        self.robot.rest()
        self.robot.command(0.0, 0.5)
        self.robot.run(3.0)
        self.assertLess(wheels[0][-1].data, -1.0)
        self.assertGreater(wheels[1][-1].data, 1.0)
        self.assertGreater(self.robot.yaw_rate(), 0.4)
        self.assertFalse(self.robot.drives)

    def test_it_ends_on_a_robot_that_publishes_feedback(self):
        """Nothing would stop the wheels of a robot if the node dies."""
        configure('on_robot', 'improved')
        rospy.set_param('/on_robot/output', 'gazebo')
        with Process('on_robot', 'controller_node', 'jackal_left_wheel/command:=l', 'jackal_right_wheel/command:=r') as process:
            self.robot.wait(process.ended, 'the node to end', 60.0)
            self.assertEqual(process.process.returncode, 1)
            self.assertIn('output = gazebo: for simulations only', process.errors())


if __name__ == '__main__':
    run_test(services=Services, set_points=SetPoints, gains=Gains, gazebo_output=Gazebo)
