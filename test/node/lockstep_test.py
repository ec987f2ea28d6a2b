#!/usr/bin/python3
"""The simulation waits for its controller: the test is one that is as late as it likes."""

import time
import unittest

import rospy
import rostest
from jackal_aic.msg import ControllerState
from jackal_msgs.msg import Drive
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from simulated_robot import Log, PATIENCE, advertise

PERIOD = 20  # ms, parameter lockstep


class Lockstep(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.clock, cls.drive = Log('/clock', Clock), advertise('/cmd_drive', Drive)
        cls.state = advertise('/jackal_AIC/state', ControllerState)

    def setUp(self):
        self.wait(lambda: self.clock and self.drive.get_num_connections() > 0 and self.state.get_num_connections() > 0, 'the plant')

    def wait(self, condition, what):
        end = time.monotonic() + PATIENCE
        while not condition() and time.monotonic() < end:
            time.sleep(0.002)
        self.assertTrue(condition(), what)

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
    rospy.init_node('lockstep_test')
    rostest.rosrun('jackal_aic', 'lockstep', Lockstep)
