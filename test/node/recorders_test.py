#!/usr/bin/python3
"""What is recorded of a drive: by the recorder of the demo, by that of the launch files, and of two robots in one graph."""

import csv
import pathlib
import subprocess
import tempfile
import unittest

import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import PoseWithCovarianceStamped
from jackal_aic.msg import ControllerState
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

from simulated_robot import Log, RADIUS, Robot, advertise, call, run_test


class StepRecorder(unittest.TestCase):

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = pathlib.Path(directory.name)
        clock = Log('/ground_truth/odom', Odometry)
        robot = Robot(self)  # the controller obeys one publisher only
        robot.wait(lambda: clock, 'the robot')
        robot.close()

    def record(self, directory):
        for key, value in (('recorder/output_directory', str(directory)), ('manoeuvre/durations', [1.0, 2.0, 1.0, 2.0]),
                           ('manoeuvre/forward', [0.0, 0.5, 0.0, 0.0]), ('manoeuvre/yaw_rate', [0.0, 0.0, 0.0, 0.5])):
            rospy.set_param('/recorder_under_test/' + key, value)
        return subprocess.call(['rosrun', 'jackal_aic', 'step_recorder', '__name:=recorder_under_test'])

    def table(self, name):
        with open(str(self.directory / name), newline='') as file:
            return list(csv.DictReader(file))

    def test_records_a_forward_step_and_a_turn(self):
        self.assertEqual(self.record(self.directory / 'missing'), 1)
        self.assertEqual(self.record(self.directory), 0)
        rows = self.table('response.csv')
        self.assertGreater(len(rows), 400, 'ground truth comes at 100 Hz for 6 s')
        self.assertGreater(float(rows[-1]['time']), 5.95)
        turn = 0.5 * 0.5 * 0.563385 / RADIUS
        for time, values in ((2.9, {'set_forward': (0.5, 0.0), 'true_forward': (0.5, 0.02), 'measured_forward': (0.5, 0.05),
                                    'command_left': (0.5 / RADIUS, 0.01), 'command_right': (0.5 / RADIUS, 0.01)}),
                             (5.9, {'set_yaw_rate': (0.5, 0.0), 'true_yaw_rate': (0.5, 0.05), 'measured_yaw_rate': (0.5, 0.08),
                                    'command_right': (turn, 0.01), 'command_left': (-turn, 0.01)})):
            row = [row for row in rows if float(row['time']) <= time][-1]
            for name, (value, tolerance) in values.items():
                self.assertAlmostEqual(float(row[name]), value, delta=tolerance, msg=name)
        self.assertEqual(rows[-1]['believed_forward'], '', 'an open-loop controller believes nothing')
        step, turned = self.table('metrics.csv')
        self.assertEqual((step['step'], turned['step'], step['bounded']), ('0.5 m/s', '0.5 rad/s', '1'))
        for row, name, value, tolerance in ((step, 'begin_s', 1.0, 0.2), (step, 'end_s', 3.0, 0.2), (step, 'settling_s', 0.5, 0.5),
                                            (step, 'steady_error_pct', 0.0, 2.0), (turned, 'settling_s', 0.5, 0.5)):
            self.assertAlmostEqual(float(row[name]), value, delta=tolerance, msg=name)

    def test_begins_only_when_the_controller_drives(self):
        stop = advertise('e_stop', Bool, latch=True)
        stop.publish(True)
        rospy.set_param('/recorder_under_test/recorder/data_timeout', 4.0)
        self.assertEqual(self.record(self.directory), 1)
        stop.publish(False)
        self.assertEqual(self.record(self.directory), 0, 'its zero set points acknowledge the stop')


class Record(unittest.TestCase):
    def output(self, *command, status=0):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
        self.assertEqual(done.returncode, status, done.stdout)
        return done.stdout

    def test_a_drive_comes_out_to_the_bit(self):
        to = pathlib.Path(rospy.get_param('/record_to'))
        self.addCleanup(lambda: [path.unlink() for path in to.parent.glob(to.name + '*')])
        robot = Robot(self)
        robot.wait_until_ready()
        picture = str(to) + '.png'
        robot.command(0.4, 0.5)
        robot.run(2.0)
        state = robot.states[-1]
        self.assertEqual(state.summary, 'predictive, driving, driven by this controller', state.reason)
        self.assertAlmostEqual(state.measured_forward, 0.4, delta=0.05)
        self.assertAlmostEqual(state.measured_yaw_rate, 0.5, delta=0.1)
        self.assertAlmostEqual(state.measured_forward, state.belief_forward[0], delta=0.05)
        call('/jackal_aic/freeze_learning', SetBool, True)
        call('/jackal_aic/predictive/set_parameters', Reconfigure, Config(doubles=[DoubleParameter('reference_time', 0.05)]))
        robot.run(1.0)
        stop = advertise('e_stop', Bool, latch=True)
        robot.wait(lambda: stop.get_num_connections() > 1, 'the controller and the recorder to hear the stop')
        stop.publish(True)
        robot.run(1.0)
        self.assertEqual(robot.states[-1].status, ControllerState.STOPPED)
        robot.wanted = None
        robot.run(0.5)
        self.output('rosnode', 'kill', '/jackal_aic_recorder')
        robot.wait(lambda: list(to.parent.glob(to.name + '*.bag')), 'the bag', 20.0)
        bag = str(next(to.parent.glob(to.name + '*.bag')))
        said = self.output('rosrun', 'jackal_aic', 'replay', '--check', bag)
        for words, there in (('all identical', True), ('emergency stop', True), ('missing', False), ('begins', False)):
            self.assertEqual(words in said, there, said)
        # The sensors' messages alone give the same drive, with the timers a moment apart.
        said = self.output('rosrun', 'jackal_aic', 'replay', '--messages', bag)
        for words, there in (('Messages of the sensors', True), ('emergency stop', True), ('refused', False)):
            self.assertEqual(words in said, there, said)
        self.output('rosrun', 'jackal_aic', 'plot', bag, '--output', picture)
        self.assertGreater(pathlib.Path(picture).stat().st_size, 10000)
        self.assertIn('no messages on /robot1/', self.output('rosrun', 'jackal_aic', 'plot', bag, '--namespace', 'robot1', status=1))


class TwoRobots(unittest.TestCase):
    def test_they_drive_apart_on_one_clock(self):
        robots, frames = [], set()
        logs = [Log(topic, TFMessage) for topic in ('/tf', '/tf_static')]
        for name in ('/robot1/', '/robot2/'):
            robot = Robot(self, name)
            robot.truth, robot.odometry = (Log(name + topic, Odometry) for topic in ('ground_truth/odom', 'odom'))
            robot.imu = Log(name + 'imu/data', Imu)
            robots.append(robot)
        first, second = robots
        for robot in robots:
            robot.wait_until_ready()
        for robot, wanted in zip(robots, ((0.4, 0.0), (0.0, 0.5))):
            robot.command(*wanted)
        first.wait(lambda: abs(first.speed() - 0.4) < 0.05 and abs(second.yaw_rate() - 0.5) < 0.08, 'both to drive', 20.0)
        self.assertAlmostEqual(first.yaw_rate(), 0.0, delta=0.1)
        self.assertAlmostEqual(second.speed(), 0.0, delta=0.1)
        self.assertEqual([robot.states[-1].reason for robot in robots], ['', ''])
        self.assertEqual((first.odometry[-1].header.frame_id, first.odometry[-1].child_frame_id), ('robot1/odom', 'robot1/base_link'))
        self.assertEqual((second.imu[-1].header.frame_id, second.states[-1].header.frame_id), ('robot2/imu_link', 'robot2/base_link'))
        for message in logs[0] + logs[1]:
            for transform in message.transforms:
                frames |= {transform.header.frame_id, transform.child_frame_id}
        frames -= {'base_link', 'imu_link'}  # which this test says
        self.assertEqual({frame.split('/')[0] for frame in frames}, {'robot1', 'robot2'})
        # In all of space rviz draws no ellipse but a column: nothing is known of the height.
        covariance = rospy.wait_for_message('/robot1/jackal_AIC/arrows/pose', PoseWithCovarianceStamped, 20.0).pose.covariance
        self.assertGreater(min(covariance[0], covariance[7], covariance[35]), 0.0)
        self.assertEqual([covariance[row * 7] for row in (2, 3, 4)], [0.0] * 3)


if __name__ == '__main__':
    run_test(step_recorder=StepRecorder, record=Record, two_robots=TwoRobots)
