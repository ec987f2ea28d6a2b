#!/usr/bin/python3
"""The excitation of identify.launch with another publisher of commands, an emergency stop, and its recorder."""

import pathlib
import subprocess
import tempfile
import unittest

import rospy
import rostest
from geometry_msgs.msg import Twist
from jackal_msgs.msg import Drive
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from simulated_robot import Log, Process, RADIUS, Robot, advertise, call


class Excitation(unittest.TestCase):

    def setUp(self):
        self.robot = Robot(self)
        self.addCleanup(self.robot.close)
        self.robot.wait(lambda: self.robot.now() > 0.0, 'the clock')

    def start(self, name, **session):
        for key, value in dict(session, countdown=session.get('countdown', 0.0)).items():
            rospy.set_param('/{}/session/{}'.format(name, key), value)
        process = Process(name, 'excitation_node')
        self.addCleanup(process.__exit__)
        return process

    def driven(self):
        return any(drive.drivers[0] != 0.0 for drive in list(self.robot.drives))

    def begun(self):
        self.robot.wait(self.driven, 'the excitation to begin', 60.0)

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

    def test_refuses_to_drive_beside_another_or_under_an_emergency_stop(self):
        self.expect_end(self.start('beside'), self.another())
        self.doCleanups()
        self.setUp()
        self.emergency_stop()
        self.expect_end(self.start('under'), 'emergency stop')
        self.assertFalse(self.driven())

    def test_ends_with_an_emergency_stop_or_another_publisher(self):
        process = self.start('stopped')
        self.begun()
        self.emergency_stop()
        self.expect_end(process, 'was not driven to its end: emergency stop')
        self.assertEqual(self.robot.drives[-1].drivers[0], 0.0)
        self.doCleanups()
        self.setUp()
        process = self.start('exciter')
        self.begun()
        self.expect_end(process, self.another())

    def test_waits_for_confirmation_and_keeps_its_acceleration(self):
        process = self.start('confirmed', confirm=True, countdown=0.5)
        rospy.wait_for_service('/confirmed/start', 60.0)
        self.robot.run(5.0)
        self.assertFalse(self.driven(), 'not confirmed yet')
        call('/confirmed/start', Trigger)
        self.begun()
        self.robot.wait(process.ended, 'the excitation to end', 60.0)
        self.assertEqual(process.process.returncode, 0, process.errors())
        speeds = [drive.drivers[0] for drive in self.robot.drives]
        largest, step = max(abs(b - a) for a, b in zip(speeds, speeds[1:])), 0.02 * 20.0 / RADIUS  # by 20 m/s^2 in a period
        self.assertTrue(0.5 * step < largest <= 1.01 * step, largest)
        self.assertEqual(speeds[-1], 0.0)

    def test_drives_by_body_velocities(self):
        twists = Log('cmd_vel', Twist)
        process = self.start('twister', twist=True)
        self.robot.wait(lambda: any(twist.linear.x > 0.59 for twist in list(twists)), 'the full speed', 30.0)
        self.assertFalse(self.driven())
        self.robot.set_point.publish(Twist())
        self.robot.wait(process.ended, 'the excitation to end', 60.0)

    def test_drives_only_while_its_bag_is_written(self):
        with tempfile.TemporaryDirectory() as directory:
            for name, bag in (('unwritten', directory + '/none/drive.bag'), ('abandoned', directory + '/drive.bag')):
                if name == 'abandoned':
                    pathlib.Path(bag).write_text('an earlier drive')
                    pathlib.Path(bag + '.1').write_text('the first drive')
                process = self.start(name, bag=bag)
                with Process('record_of_' + name, 'record', bag, '--only', 'cmd_drive'):
                    if name == 'unwritten':
                        self.expect_end(process, 'the recorder does not write ' + bag)
                        self.assertFalse(self.driven())
                        continue
                    self.begun()
                    subprocess.check_output(['rosnode', 'kill', '/record_of_abandoned'])
                    self.expect_end(process, 'was not driven to its end: the recorder has ended, which was to write ' + bag)
                    self.robot.wait(lambda: self.robot.drives[-1].drivers[0] == 0.0, 'the last command', 10.0)
            self.assertEqual(pathlib.Path(bag).read_bytes()[:13], b'#ROSBAG V2.0\n')
            self.assertEqual([pathlib.Path(bag + end).read_text() for end in ('.1', '.2')], ['the first drive', 'an earlier drive'])


if __name__ == '__main__':
    rospy.init_node('excitation_test')
    rostest.rosrun('jackal_aic', 'excitation', Excitation)
