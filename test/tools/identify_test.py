#!/usr/bin/python3
"""`identify`: from a bag, as rosbag record writes it, to a plant model; bags of the simulated robot."""

import copy
import math
import os
import pathlib
import subprocess
import tempfile
import unittest

import jackal_aic
import rosbag
import rospy
import rosunit
import yaml
from geometry_msgs.msg import TransformStamped, Twist, TwistStamped
from jackal_msgs.msg import Drive
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

PROGRAM = os.environ['JACKAL_AIC_DEVEL'] + '/lib/jackal_aic/identify'
JOINTS = ['front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel']
RADIUS, TRACK = 0.098, 0.5621  # m
BEGIN = 100.0  # s
FOUND = 'effective track, left         0.5'


def excited():
    """(topic, time, message) of the excitation on the simulated robot, as identify.launch records it."""
    parts = [(part * speed, part * turn) for speed, turn in ((0.6, 0.0), (0.0, 1.0)) for part in (0.5, -0.5, 1.0, -1.0)]
    points = [(0.8 + 2.0 * i + at, *point) for i, part in enumerate(parts) for at, point in ((0.0, part), (1.2, (0.0, 0.0)))]
    drive = jackal_aic.simulate('ground', 'diff_drive', points, duration=16.8, overrides={'loop.phase': 0.013})
    for k, time in enumerate(BEGIN + drive.time):
        stamp = rospy.Time.from_sec(time)
        if k % 20 == 13:
            yield '/cmd_drive', stamp, Drive(mode=Drive.MODE_VELOCITY, drivers=[drive.command_left[k], drive.command_right[k]])
        if k % 20 == 0:
            joints, imu = JointState(name=JOINTS, velocity=2 * [drive.measured_left[k], drive.measured_right[k]]), Imu()
            joints.header.stamp = imu.header.stamp = stamp
            imu.header.frame_id, imu.angular_velocity.z = 'base_link', drive.measured_yaw_rate[k]
            yield '/joint_states', stamp, joints
            yield '/imu/data', stamp, imu


def write(bag, topic, time, message, node):
    """As another node's message, which rosbag writes after its own connection."""
    bag._topic_connections.pop(topic, None)
    bag.write(topic, message, time, connection_header={'callerid': node, 'topic': topic, 'type': message._type, 'md5sum': message._md5sum,
                                                       'message_definition': message._full_text})


def mounting():
    """base_link <- mid_mount <- imu_link; the IMU lies on its side: its y axis points down."""
    transforms = []
    for parent, child, half_turn in (('base_link', 'mid_mount', 0.0), ('mid_mount', 'imu_link', -math.pi / 4.0)):
        transforms.append(TransformStamped(child_frame_id=child))
        transforms[-1].header.frame_id = parent
        transforms[-1].transform.rotation.w, transforms[-1].transform.rotation.x = math.cos(half_turn), math.sin(half_turn)
    return TFMessage(transforms)


def on_its_side(sign):
    """Changes the IMU's messages to those of one whose y axis points up (1) or down (-1)."""
    def change(joints, imu):
        imu.header.frame_id, imu.angular_velocity.y, imu.angular_velocity.z = '/imu_link', sign * imu.angular_velocity.z, 0.0
    return change


class Identify(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.messages = list(excited())

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = pathlib.Path(directory.name)
        self.bag = self.directory / 'drive.bag'

    def record(self, change=None, also=(), messages=None):
        """Writes the bag; a change of the sensors' messages, and others (topic, time, message, node)."""
        with rosbag.Bag(str(self.bag), 'w') as bag:
            for i, (topic, time, message) in enumerate(self.messages if messages is None else messages):
                if change and topic == '/joint_states':
                    message, imu = copy.deepcopy(message), copy.deepcopy(self.messages[i + 1][2])
                    change(message, imu)
                elif change and topic == '/imu/data':
                    message = imu
                bag.write(topic, message, time)
            for topic, time, message, node in also:
                write(bag, topic, rospy.Time.from_sec(time), message, node)

    def run_it(self, *arguments, status=0, **environment):
        """What the program prints."""
        done = subprocess.run([PROGRAM, *arguments], cwd=str(self.directory), stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, universal_newlines=True, env=dict(os.environ, **environment))
        self.assertEqual(done.returncode, status, done.stdout)
        return done.stdout

    def identified(self, *arguments):
        return self.run_it('drive.bag', '--no-plot', *arguments)

    def refusal(self, bag='drive.bag'):
        """One line that names the file."""
        said = self.run_it(str(bag), '--no-plot', status=2)
        self.assertTrue(said.startswith('identify: {}'.format(bag)), said)
        self.assertEqual(said.count('\n'), 1, said)
        self.assertLess(len(said), 400)
        return said

    def test_refuses_what_is_no_bag(self):
        self.refusal('/nonexistent/drive.bag')
        self.record()
        whole = self.bag.read_bytes()
        for content in (b'', b'time,left,right\n0.0,1.0,1.0\n', whole[:20000]):
            self.bag.write_bytes(content)
            self.refusal()
        os.mkfifo(str(self.directory / 'fifo'))
        for path in ('fifo', '/dev/zero'):
            self.assertIn('cannot be read as a bag: it is no file', self.refusal(path))

    def test_refuses_bags_without_commands(self):
        for messages, words in ((self.messages[:2], 'no messages on /cmd_drive'), ([('/cmd_drive', rospy.Time(100), Float64())], 'std_msgs/Float64')):
            self.record(messages=messages)
            self.assertIn(words, self.refusal())

    def test_refuses_wheels_and_stamps_that_cannot_be(self):
        def shift(seconds):
            def change(joints, imu):
                joints.header.stamp += rospy.Duration(seconds)
            return change

        def late(change, since=105.0):
            return lambda joints, imu: change(joints, imu) if joints.header.stamp.to_sec() > since else None

        for change, words in (
                (shift(0.1), 'stamps are 0.100 s later than their arrival'), (shift(-3.0), 'stamps are 3.000 s before their arrival'),
                (lambda j, i: setattr(j.header, 'stamp', rospy.Time()), '/joint_states: the message that arrived at 100.0'),
                (lambda j, i: setattr(i.header, 'stamp', rospy.Time()), '/imu/data: the message that arrived at 100.0'),
                (late(lambda j, i: j.velocity.__setitem__(2, math.nan)), "/joint_states: the velocity of joint 'rear_left_wheel' at 105.0"),
                (late(lambda j, i: j.velocity.pop()), "'rear_right_wheel' at 105.0"),
                (lambda j, i: setattr(j, 'name', list('abcd')), 'no message names a joint of front_left_wheel')):
            self.record(change)
            self.assertIn(words, self.refusal())

    def test_refuses_several_publishers(self):
        """Joints of other robots are not ours."""
        command, joints = Drive(drivers=[1.0, 1.0]), JointState(name=['arm'], velocity=[0.0])
        joints.header.stamp = rospy.Time(105)
        self.record(also=[('/joint_states', 105.0, joints, '/joint_state_publisher')])
        self.assertNotIn('publishers', self.identified())
        joints.name, joints.velocity = JOINTS, [0.0] * 4
        nodes = ['/jackal_node', '/excitation'] + ['/node{}'.format(i) for i in range(198)]
        for also, words in (([('/joint_states', 105.0, joints, '/joint_state_publisher')],
                             ('/joint_states has 2 publishers', "'/joint_state_publisher' sent 1")),
                            ([('/cmd_drive', 105.0, command, node) for node in nodes[:1]], ('2 publishers', '/jackal_node')),
                            ([('/cmd_drive', 105.0, command, node) for node in nodes], ('201 publishers',))):
            self.record(also=also)
            for word in words:
                self.assertIn(word, self.refusal())

    def test_leaves_out_a_message_now_and_then_that_is_not_finite(self):
        def change(joints, imu):
            if abs(joints.header.stamp.to_sec() - 105.0) < 0.009:
                joints.velocity[2] = math.nan
            if abs(joints.header.stamp.to_sec() - 107.0) < 0.009:
                imu.angular_velocity.z = math.nan
        self.record(change)
        said = self.identified()
        for words in ("left out: 1 message(s); /joint_states: the velocity of joint 'rear_left_wheel'", 'left out: 1 message(s); /imu/data', FOUND):
            self.assertIn(words, said)

    def test_takes_commands_that_are_body_velocities(self):
        """On a robot with twist_mux."""
        twists = []
        for topic, time, message in self.messages:
            if topic == '/cmd_drive':
                twist, stamped = Twist(), TwistStamped()
                left, right = message.drivers
                twist.linear.x, twist.angular.z = 0.5 * RADIUS * (left + right), RADIUS * (right - left) / TRACK
                stamped.twist = twist
                twists += [('/cmd_vel', time, twist), ('/mux/cmd_vel_out', time, stamped)]
        found = []
        self.record(messages=self.messages + twists)
        for topic in ('/cmd_drive', '/cmd_vel', '/mux/cmd_vel_out'):
            self.identified('--command-topic', topic, '--out', 'model.yaml')
            found.append(yaml.safe_load((self.directory / 'model.yaml').read_text())['plant_model'])
        for key in ('dead_time', 'gain', 'effective_track'):
            for other in found[1:]:
                self.assertAlmostEqual(other[key], found[0][key], delta=1e-4, msg=key)

    def test_turns_the_imu_as_it_is_mounted(self):
        self.record(on_its_side(-1.0), [('/tf_static', BEGIN, mounting(), '/robot_state_publisher')])
        self.assertIn(FOUND, self.identified(), 'as /tf_static says')
        self.assertNotIn(FOUND, self.identified('--imu-roll', '90'), 'as the user says, who is wrong')
        self.record(on_its_side(1.0))
        for arguments in (('--imu-roll', '90'), ('--imu-roll', '-270', '--imu-yaw', '0')):
            self.assertIn(FOUND, self.identified(*arguments), 'as the user says')
        said = self.identified()
        self.assertNotIn(FOUND, said)
        self.assertIn("neither /tf_static nor /tf says how IMU frame '/imu_link' is mounted on 'base_link': say it with "
                      '--imu-roll, --imu-pitch and --imu-yaw', ' '.join(said.split()))
        self.assertNotIn('neither', self.identified('--base-frame', 'imu_link'), 'it is that of the base')
        for option, angle in (('--imu-yaw', '1e300'), ('--imu-pitch', 'nan')):
            self.assertEqual(self.run_it('drive.bag', option, angle, status=2), 'identify: {} must be in [-360, 360] deg\n'.format(option))

    def test_tells_of_stamps_of_another_clock(self):
        """In one remark."""
        for wheels, imu, remark in ((0.004, 0.004, ''), (-0.06, 0.0, '/joint_states: stamps are 0.060 s before their arrival at the recorder'),
                                    (0.0, -0.06, '/imu/data: stamps are 0.060 s before their arrival at the recorder'),
                                    (0.0, 0.02, '/imu/data: stamps are 0.020 s later than their arrival at the recorder')):
            def change(joints, sample):
                joints.header.stamp += rospy.Duration(wheels)
                sample.header.stamp += rospy.Duration(imu)
            self.record(change)
            said = self.identified()
            self.assertIn(remark, said)
            self.assertEqual(said.count('stamps are'), 1 if remark else 0, said)

    def test_draws_beside_the_bag(self):
        (self.directory / 'my.bags').mkdir()
        self.bag = self.directory / 'my.bags/e\x1b[31m.bag'
        self.record()
        self.assertNotIn('\x1b', self.run_it('my.bags/e\x1b[31m.bag'))
        self.assertTrue((self.directory / 'my.bags/e\x1b[31m_identification.png').exists())

    def test_keeps_an_earlier_plant_model(self):
        self.record()
        mine = self.directory / 'mine.yaml'
        mine.write_text('by hand')
        self.assertIn('is now mine.yaml.1\n', self.identified('--out', 'mine.yaml', '--robot', 'one'))
        first = mine.read_text()
        self.assertIn('one', first)
        self.assertIn('is now mine.yaml.2\n', self.identified('--out', 'mine.yaml', '--robot', 'two'))
        self.assertEqual([(self.directory / name).read_text() for name in ('mine.yaml.1', 'mine.yaml.2')], ['by hand', first])
        self.assertNotIn('is now', self.run_it('no.bag', '--out', 'mine.yaml', status=2))
        self.assertIn('two', mine.read_text(), 'nothing came to replace it')
        self.assertIn('dead_time', self.identified('--out', '/dev/stdout'), 'what is no file is written to')

    def test_writes_the_model_without_a_picture(self):
        self.record()
        said = self.identified('--csv', 'speeds.csv')
        self.assertIn('Table: speeds.csv\n', said)
        self.assertNotIn('Figure', said)
        self.assertFalse((self.directory / 'drive_identification.png').exists())
        self.assertIn('--plot and --no-plot', self.run_it('drive.bag', '--no-plot', '--plot', 'picture.png', status=2))
        (self.directory / 'matplotlib.py').write_text("raise ImportError('hidden')\n")
        said = self.run_it('drive.bag', '--out', 'model.yaml', '--csv', 'speeds.csv',
                           PYTHONPATH='{}:{}'.format(self.directory, os.environ['PYTHONPATH']))
        for words in ('Plant model: model.yaml\n', 'Table: speeds.csv\n', 'identify: drive_identification.png: could not be drawn: the picture '
                      'needs matplotlib (apt install python3-matplotlib): hidden; --no-plot leaves it out\n'):
            self.assertIn(words, said)
        self.assertNotIn('Traceback', said)
        said = self.run_it('drive.bag', '--out', 'model.yaml', '--plot', 'nowhere/picture.png', status=2)  # it was asked for
        self.assertIn('The earlier plant model is now model.yaml.1\n', said)
        self.assertNotIn('Traceback', said)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'identify', '__main__')
