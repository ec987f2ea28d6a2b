#!/usr/bin/python3
"""The excitation of identify.launch with another publisher of commands, an emergency stop, and its recorder."""

import pathlib
import subprocess
import tempfile

import rospy
import rostest
from geometry_msgs.msg import Twist
from jackal_msgs.msg import Drive
from std_msgs.msg import Bool

from simulated_robot import Process, RADIUS, RobotTest, advertise, configure

CONTROLLER = '/excitation_controller'
TRACK = 0.563385  # m, of the stock controller


class Excitation(RobotTest):

    def wait_until_ready(self):
        self.robot.wait(lambda: self.robot.now() > 0.0, 'the clock')

    def start(self, name, *arguments, output='cmd_drive'):
        if rospy.has_param(CONTROLLER):
            rospy.delete_param(CONTROLLER)
        configure(CONTROLLER[1:], 'advanced', 'diff_drive')
        rospy.set_param(CONTROLLER + '/deadlines/set_point', 0.5)
        rospy.set_param(CONTROLLER + '/output', output)
        controller = Process(CONTROLLER[1:])
        self.addCleanup(controller.__exit__)
        process = Process(name, 'excitation', '--countdown', '0', *arguments)
        self.addCleanup(process.__exit__)
        return process

    def driven(self):
        return any(drive.drivers[0] != 0.0 for drive in list(self.robot.drives))

    def begun(self):
        self.robot.wait(self.driven, 'the excitation to begin', 120.0)

    def expect_end(self, process, said):
        self.robot.wait(process.ended, 'the excitation to give up', 60.0)
        self.assertEqual(process.process.returncode, 1)
        self.assertIn(said, process.errors())

    def another(self):
        intruder = advertise('cmd_drive', Drive)
        self.addCleanup(intruder.unregister)
        return 'another node publishes commands: {} on /cmd_drive'.format(rospy.get_name())

    def emergency_stop(self):
        stop = advertise('e_stop', Bool, latch=True)
        self.addCleanup(stop.unregister)
        stop.publish(True)
        return 'emergency stop'

    def test_refuses_to_drive_beside_another_or_under_an_emergency_stop(self):
        for name, disturb in (('beside', self.another), ('under', self.emergency_stop)):
            self.expect_end(self.start(name), disturb())
            self.assertFalse(self.driven())
            self.doCleanups()
            self.setUp()

    def test_ends_with_an_emergency_stop_or_another_publisher(self):
        for name, disturb in (('exciter', self.another), ('stopped', self.emergency_stop)):
            process = self.start(name)
            self.begun()
            said = disturb()
            self.expect_end(process, said)
            if name == 'stopped':
                self.assertIn('was not driven to its end: ' + said, process.errors())
                self.robot.wait(lambda: self.robot.drives[-1].drivers[0] == 0.0, 'the robot to stand', 2.0)
            self.doCleanups()
            self.setUp()

    def test_waits_for_confirmation_and_keeps_its_acceleration(self):
        process = self.start('confirmed', '--confirm', 'true')
        self.robot.run(6.0)
        self.assertFalse(self.driven(), 'not confirmed yet')
        self.assertFalse(process.ended(), process.errors())
        process.confirm()
        self.begun()
        self.robot.wait(process.ended, 'the excitation to end', 60.0)
        self.assertEqual(process.process.returncode, 0, process.errors())
        speeds = [drive.drivers[0] for drive in self.robot.drives]
        largest, step = max(abs(b - a) for a, b in zip(speeds, speeds[1:])), 0.02 * 20.0 / RADIUS  # by 20 m/s^2 in a period
        self.assertTrue(0.5 * step < largest <= 1.01 * step, largest)
        self.assertEqual(speeds[-1], 0.0)

    def test_refuses_to_ask_where_nobody_answers(self):
        process = self.start('unanswered', '--confirm', 'true')
        process.process.stdin.close()
        self.expect_end(process, 'confirm:=false does not ask')
        self.assertFalse(self.driven())

    def test_drives_by_body_velocities_until_another_set_point(self):
        wheels = advertise('cmd_drive', Drive)  # the stock velocity controller's
        follow = rospy.Subscriber('cmd_vel', Twist, lambda twist: wheels.publish(Drive.MODE_VELOCITY, [
            (twist.linear.x + side * twist.angular.z) / RADIUS for side in (-0.5 * TRACK, 0.5 * TRACK)]), tcp_nodelay=True)
        self.addCleanup(wheels.unregister)
        self.addCleanup(follow.unregister)
        process = self.start('twister', '--commands', 'cmd_vel', output='twist')
        self.robot.wait(lambda: any(drive.drivers[0] > 0.59 / RADIUS for drive in list(self.robot.drives)), 'the full speed', 60.0)
        self.robot.set_point.publish(Twist())
        self.expect_end(process, 'more than one node publishes set points')

    def test_drives_only_while_its_bag_is_written(self):
        with tempfile.TemporaryDirectory() as directory:
            for name, bag in (('unwritten', directory + '/none/drive.bag'), ('abandoned', directory + '/drive.bag')):
                if name == 'abandoned':
                    pathlib.Path(bag).write_text('an earlier drive')
                    pathlib.Path(bag + '.1').write_text('the first drive')
                process = self.start(name, '--bag', bag)
                with Process('record_of_' + name, 'record', bag, '--only', 'cmd_drive'):
                    if name == 'unwritten':
                        self.expect_end(process, 'nothing is recorded into ' + bag)
                        self.assertFalse(self.driven())
                        continue
                    self.begun()
                    subprocess.check_output(['rosnode', 'kill', '/record_of_abandoned'])
                    self.expect_end(process, 'was not driven to its end: nothing is recorded into ' + bag)
                    self.robot.wait(lambda: self.robot.drives[-1].drivers[0] == 0.0, 'the last command', 10.0)
            self.assertEqual(pathlib.Path(bag).read_bytes()[:13], b'#ROSBAG V2.0\n')
            self.assertEqual([pathlib.Path(bag + end).read_text() for end in ('.1', '.2')], ['the first drive', 'an earlier drive'])


if __name__ == '__main__':
    rospy.init_node('excitation_test')
    rostest.rosrun('jackal_aic', 'excitation', Excitation)
