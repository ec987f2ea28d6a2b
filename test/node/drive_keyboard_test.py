#!/usr/bin/python3
"""drive_keyboard in a pseudo terminal: keys in, set points out, zero and a restored terminal at the end."""

import os
import pty
import signal
import subprocess
import termios
import time
import unittest

import rospy
import rostest
from geometry_msgs.msg import Twist

from simulated_robot import Log, bound_to_parent


class DriveKeyboard(unittest.TestCase):

    def setUp(self):
        self.heard = Log('jackal_AIC/set_point', Twist)
        self.master, self.terminal = pty.openpty()
        self.process = subprocess.Popen(bound_to_parent(['rosrun', 'jackal_aic', 'drive_keyboard']), stdin=self.terminal,
                                        stdout=self.terminal, stderr=self.terminal, start_new_session=True)
        os.set_blocking(self.master, False)
        self.wait(lambda: not self.cooked() and self.heard.subscriber.get_num_connections() > 0)

    def tearDown(self):
        self.process.kill()
        self.process.wait()

    def cooked(self):
        """Whether keys are echoed, and handed over line by line."""
        flags = termios.tcgetattr(self.terminal)[3]
        return flags & termios.ECHO and flags & termios.ICANON

    def wait(self, condition):
        end = time.monotonic() + 20.0
        while not condition() and time.monotonic() < end:
            try:
                os.read(self.master, 1024)  # what was printed
            except BlockingIOError:
                time.sleep(0.01)
        self.assertTrue(condition())

    def type(self, keys, forward, yaw_rate):
        os.write(self.master, keys)
        self.wait(lambda: self.heard and abs(self.heard[-1].linear.x - forward) < 1e-9 and
                  abs(self.heard[-1].angular.z - yaw_rate) < 1e-9)

    def expect_end_at_rest(self):
        self.wait(lambda: self.process.poll() is not None)
        self.assertEqual(self.process.returncode, 0)
        self.wait(lambda: (self.heard[-1].linear.x, self.heard[-1].angular.z) == (0.0, 0.0))
        self.assertTrue(self.cooked())

    def test_keys_change_the_set_point_and_the_end_is_zero(self):
        time.sleep(0.3)
        self.assertFalse(self.heard, 'no key was pressed')
        for keys, forward, yaw_rate in ((b'ww', 0.2, 0.0), (b'\x1b[D', 0.2, 0.2), (b'\x1b[C\x1b[C\x1b[B', 0.1, -0.2), (b' ', 0.0, 0.0),
                                        (b'\x1bOA', 0.1, 0.0)):
            self.type(keys, forward, yaw_rate)
        before = len(self.heard)
        self.wait(lambda: len(self.heard) >= before + 10)
        os.write(self.master, b'q')
        self.expect_end_at_rest()

    def test_a_signal_ends_it_at_rest(self):
        self.type(b'w', 0.1, 0.0)
        os.killpg(self.process.pid, signal.SIGTERM)
        self.expect_end_at_rest()


if __name__ == '__main__':
    rospy.init_node('drive_keyboard_test')
    rostest.rosrun('jackal_aic', 'drive_keyboard', DriveKeyboard)
