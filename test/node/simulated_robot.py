"""What node tests in Python share: topics, processes, services, and a robot that is commanded on simulated time.

Nothing here asserts on wall time: a wait ends when simulated time stands still for PATIENCE.
"""

import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import rospkg
import rospy
import rostest
from geometry_msgs.msg import TransformStamped, Twist
from jackal_aic.msg import ControllerState
from jackal_msgs.msg import Drive
from nav_msgs.msg import Odometry
from std_msgs.msg import Time
from tf2_msgs.msg import TFMessage

SOURCE = pathlib.Path(rospkg.RosPack().get_path('jackal_aic'))
PATIENCE = 60.0  # s on the wall clock without any progress
RADIUS = 0.098  # m


class Log(list):
    """The messages of a topic, oldest first."""

    def __init__(self, topic, kind):
        super().__init__()
        # Without a size rospy keeps that of its own subscriber to /clock: one message, so that a late process misses some.
        self.subscriber = rospy.Subscriber(topic, kind, self.append, queue_size=1000, tcp_nodelay=True)


def advertise(topic, kind, **options):
    return rospy.Publisher(topic, kind, **dict({'queue_size': 50, 'tcp_nodelay': True}, **options))


def call(service, kind, *arguments):
    rospy.wait_for_service(service, PATIENCE)
    return rospy.ServiceProxy(service, kind)(*arguments)


def configure(name, *files):
    """Loads jackal.yaml and more files of config/ into the private namespace of a node to come."""
    for file in ('jackal',) + files:
        subprocess.check_call(['rosparam', 'load', str(SOURCE / 'config' / (file + '.yaml')), '/' + name])


def bound_to_parent(command, number='KILL'):
    """The command, which gets a signal when its parent dies, even if killed: INT for what ends others itself, as roslaunch does."""
    return ['setpriv', '--pdeathsig', number, *command]


class Relay:
    """Hands on the messages of a topic, changed by `alter`, which may swallow them by None."""

    def __init__(self, topic, kind, to):
        self.alter, self.publisher = None, advertise(to, kind)
        self.subscriber = rospy.Subscriber(topic, kind, self.take, tcp_nodelay=True)

    def take(self, message):
        handed_on = self.alter(message) if self.alter else message
        if handed_on is not None:
            self.publisher.publish(handed_on)


class Process:
    """A node of its own, with stderr in a file; killed if it does not end by itself."""

    def __init__(self, name, executable='controller_node', *arguments):
        self.log = tempfile.NamedTemporaryFile('w+')
        self.process = subprocess.Popen(bound_to_parent(['rosrun', 'jackal_aic', executable, '__name:=' + name, *arguments]),
                                        stderr=self.log, stdin=subprocess.PIPE, universal_newlines=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def signal(self, number):
        self.process.send_signal(number)

    def confirm(self):
        print(file=self.process.stdin, flush=True)

    def ended(self):
        return self.process.poll() is not None

    def errors(self):
        return pathlib.Path(self.log.name).read_text()


@contextlib.contextmanager
def command(text):
    process = subprocess.Popen(bound_to_parent(['bash', '-c', 'exec ' + text]), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                               start_new_session=True)
    yield process
    os.killpg(process.pid, signal.SIGTERM)
    process.wait()


def mount_imu():
    """Says where the IMU of sim/urdf/jackal.urdf is mounted; keep what it returns."""
    mount = TransformStamped(child_frame_id='imu_link')
    mount.header.frame_id = 'base_link'
    mount.transform.rotation.w = 1.0
    topic = advertise('/tf_static', TFMessage, latch=True)
    topic.publish([mount])
    return topic


class Robot:
    """Commands one controller at 20 Hz of simulated time, and records what it does."""

    mount = None

    def __init__(self, test, namespace=''):
        self.test, self.wanted, self.due, self.commanded, self.seen_time = test, None, 0.0, False, -1.0
        Robot.mount = Robot.mount or mount_imu()
        self.set_point = advertise(namespace + 'jackal_AIC/set_point', Twist)
        self.seen = advertise('/plant/seen', Time)
        self.truth = Log('ground_truth/odom', Odometry)
        self.states = Log(namespace + 'jackal_AIC/state', ControllerState)
        self.drives = Log(namespace + 'cmd_drive', Drive)
        self.closed = False
        threading.Thread(target=self.send_all, daemon=True).start()

    def close(self):
        self.closed = True
        for log in (self.truth, self.states, self.drives):
            log.subscriber.unregister()
        self.set_point.unregister()

    def wait(self, condition, what, longest=None):
        """Until a condition holds, for at most so many simulated seconds."""
        progress, last, begin = time.monotonic(), self.now(), self.now()
        while not condition():
            now = self.now()
            if now != last:
                progress, last = time.monotonic(), now
            if time.monotonic() - progress > PATIENCE or (longest is not None and now > begin + longest):
                break
            time.sleep(0.002)
        self.test.assertTrue(condition(), 'waited in vain for {} at {:.2f} s'.format(what, self.now()))

    @staticmethod
    def now():
        return rospy.get_time()

    def send_all(self):
        while not self.closed and not rospy.is_shutdown():
            now = self.now()
            if self.wanted is not None and not 0.0 < self.due - now < 1.0:
                self.due = now + 0.05
                self.set_point.publish(self.wanted)
            if not 0.0 <= now - self.seen_time < 0.01:  # the simulation does not leave this process behind
                self.seen_time = now
                self.seen.publish(rospy.Time.from_sec(now))
            time.sleep(0.001)

    def wait_until_ready(self):
        self.wait(lambda: self.now() > 0.0 and self.truth and self.states and self.set_point.get_num_connections() > 0, 'a controller')

    def run(self, seconds):
        end = self.now() + seconds
        self.wait(lambda: self.now() >= end, 'simulated time')

    def command(self, forward, yaw_rate=0.0):
        """The first time zero before it, which a controller that has just started waits for; returns the time."""
        if not self.commanded:
            self.commanded = True
            self.command(0.0)
            self.run(0.2)
        wanted = Twist()
        wanted.linear.x, wanted.angular.z = forward, yaw_rate
        self.wanted, self.due = wanted, 0.0
        return self.now()

    def rest(self):
        self.command(0.0)
        self.run(2.0)
        self.clear()

    def clear(self):
        for log in (self.truth, self.states, self.drives):
            log.clear()

    def series(self, value, since=-1.0):
        """Times and values of the true motion; value: 'forward' or 'yaw_rate'."""
        truth = [message for message in list(self.truth) if message.header.stamp.to_sec() > since]
        return ([message.header.stamp.to_sec() for message in truth],
                [message.twist.twist.linear.x if value == 'forward' else message.twist.twist.angular.z for message in truth])

    def state(self):
        self.wait(lambda: self.states, 'a state of the controller')
        return self.states[-1]

    def speed(self):
        return self.truth[-1].twist.twist.linear.x

    def yaw_rate(self):
        return self.truth[-1].twist.twist.angular.z


class RobotTest(unittest.TestCase):
    """Of a controller that the launch file starts."""

    def setUp(self):
        self.robot = Robot(self)
        self.addCleanup(self.robot.close)
        self.wait_until_ready()

    def wait_until_ready(self):
        self.robot.wait_until_ready()


def run_test(**tests):
    """The one that the first argument names."""
    rospy.init_node(sys.argv[1] + '_test')
    rostest.rosrun('jackal_aic', sys.argv[1], tests[sys.argv[1]])
