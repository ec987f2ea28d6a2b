#!/usr/bin/python3
"""The controller node as a process: what it refuses to start with, what it leaves behind, and what it keeps in its file."""

import pathlib
import signal
import tempfile
import time

import rospy
import rostest
from geometry_msgs.msg import Twist
from jackal_aic.msg import ControllerState
from rospy.impl.masterslave import ROSHandler
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, Trigger

from simulated_robot import Process, Relay, RobotTest, advertise, call, configure

CONFIGURED, TRUE, TOLERANCE = 0.7, 0.547, 0.02  # m, effective track of the controller and of the robot turning in place


class StartAndStop(RobotTest):

    def wait_until_ready(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.file = pathlib.Path(directory.name, 'slip.yaml')
        self.robot.wait(lambda: self.robot.now() > 0.0 and self.robot.truth, 'the robot')

    def start(self, name, *arguments):
        process = Process(name, 'controller_node', *arguments)
        self.addCleanup(process.__exit__)
        return process

    def ready(self, name, *files, arguments=(), **parameters):
        """A controller that runs, with these files of config/ and parameters ('a__b' is a/b)."""
        if files:
            configure(name, *files)
        for key, value in parameters.items():
            rospy.set_param('/{}/{}'.format(name, key.replace('__', '/')), value)
        self.robot.clear()
        process = self.start(name, *arguments)
        self.robot.wait_until_ready()
        return process

    def end(self, process, number=signal.SIGTERM):
        process.signal(number)
        self.robot.wait(process.ended, 'the node to end')

    def drive(self, forward, yaw_rate=0.0, seconds=3.0):
        self.robot.command(forward, yaw_rate)
        self.robot.run(seconds)
        if yaw_rate == 0.0:
            self.assertAlmostEqual(self.robot.speed(), forward, delta=0.05, msg=self.robot.state().reason)

    def test_refuses_a_missing_key_and_unstable_gains(self):
        for name, files, key, value, words in (
            ('missing', ('standard',), 'controller/kappa_mu', None, ('controller.kappa_mu', 'missing')),
            ('unstable', ('improved', 'plant_model'), 'controller/kappa_a', 60.0,
             ('closed loop', 'spectral radius 1.', 'kappa_a = 60 is too large: stable below'))):
            configure(name, *files)
            if value is None:
                rospy.delete_param('/{}/{}'.format(name, key))
            else:
                rospy.set_param('/{}/{}'.format(name, key), value)
            process = self.start(name)
            self.robot.wait(process.ended, 'the node to give up')
            self.assertEqual((process.process.returncode, process.errors().count('\n')), (1, 1), process.errors())
            for word in words:
                self.assertIn(word, process.errors())
        self.assertFalse(self.robot.drives, 'a command was published')

    def test_a_learned_file_that_cannot_be_used_is_named_and_the_robot_drives(self):
        outdated, aside = 'slip: {effective_track: 0.6, slip_factor: 1.0, told_track: 0.7}', self.file.with_name('slip.yaml.old')
        self.file.write_text(outdated)
        for name, preset, file, said in (
                ('outdated', 'predictive', self.file, ('slip.told_track', 'Learning starts from the configuration, and the file is now %s' % aside)),
                ('homeless', 'predictive', 'none/slip.yaml', ("none/slip.yaml': cannot be written: No such file or directory",)),
                ('improved_with_file', 'improved', self.file, ('slip.file is not used: only preset:=predictive learns',))):
            process = self.ready(name, preset, 'plant_model', slip__file=str(self.file.parent / file))
            self.robot.rest()
            self.drive(0.5)
            self.assertEqual(self.robot.state().status, ControllerState.DRIVING)
            for words in said:
                self.assertIn(words, process.errors())
            self.robot.rest()
            self.end(process)
            if name == 'outdated':
                self.file.unlink()
        self.assertEqual(aside.read_text(), outdated)
        self.assertFalse(self.file.exists(), 'written by a preset that does not learn')

    def test_a_signal_stops_the_robot_by_its_brake(self):
        slow_brake = {'limits__linear_deceleration': 0.5, 'brake__linear_deceleration': 0.5, 'brake__time': 5.0}
        for number, speed, parameters in ((signal.SIGTERM, 0.5, {}), (signal.SIGINT, 1.5, slow_brake)):
            process = self.ready('ending_{}'.format(int(number)), 'improved', **parameters)
            self.robot.rest()
            self.drive(speed, seconds=4.0)
            self.end(process, number)
            self.assertEqual(process.process.returncode, 0, process.errors())
            self.robot.run(1.5)
            self.assertEqual(tuple(self.robot.drives[-1].drivers), (0.0, 0.0))
            self.assertAlmostEqual(self.robot.speed(), 0.0, delta=0.01, msg='the plant drives on with its last command')
            if number == signal.SIGINT:
                speeds = [drive.drivers[0] for drive in self.robot.drives[-50:]]
                self.assertLess(max(before - after for before, after in zip(speeds, speeds[1:])), 0.5)

    def test_after_a_kill_it_stands_under_the_set_points_that_go_on(self):
        process = self.ready('killed', 'improved')
        self.robot.rest()
        self.drive(0.5)
        self.end(process, signal.SIGKILL)  # the plant drives on with the last command
        self.robot.run(0.2)
        self.ready('killed')
        self.robot.run(3.0)
        self.assertEqual({tuple(drive.drivers) for drive in self.robot.drives}, {(0.0, 0.0)})
        self.assertEqual((self.robot.state().status, self.robot.state().reason),
                         (ControllerState.STOPPED, 'set points not zero since the start (waits for a zero set point or a pause)'))
        self.assertAlmostEqual(self.robot.speed(), 0.0, delta=0.01)
        self.robot.wanted = None
        self.robot.run(1.0)
        self.drive(0.5)

    def test_set_points_that_are_not_connected_yet_are_no_pause(self):
        """As on a machine so busy that their publisher answers a new subscriber seconds late."""
        at_once = ROSHandler.requestTopic

        def late(handler, caller, topic, protocols):
            time.sleep(3.0 if topic == self.robot.set_point.resolved_name else 0.0)
            return at_once(handler, caller, topic, protocols)

        ROSHandler.requestTopic = late
        self.addCleanup(setattr, ROSHandler, 'requestTopic', at_once)
        self.robot.wanted = Twist()
        self.robot.wanted.linear.x = 0.5
        self.ready('deaf', 'improved')
        self.robot.run(3.0)
        self.assertEqual({tuple(drive.drivers) for drive in self.robot.drives}, {(0.0, 0.0)})
        self.assertEqual(self.robot.state().reason, 'set points not zero since the start (waits for a zero set point or a pause)')

    def test_a_latched_stop_is_heard_before_the_first_command(self):
        stop = advertise('e_stop', Bool, latch=True)
        self.addCleanup(stop.unregister)
        stop.publish(True)
        configure('stopped', 'improved')
        self.robot.command(0.0)
        self.robot.drives.clear()
        self.start('stopped')
        self.robot.wait(lambda: self.robot.drives, 'the first command', 60.0)
        self.robot.command(0.5)
        self.robot.run(2.0)
        self.assertEqual({drive.drivers[0] for drive in self.robot.drives}, {0.0})
        self.robot.clear()
        self.assertEqual(self.robot.state().reason, 'emergency stop')

    def test_a_node_whose_name_was_taken_says_so_and_stays_down(self):
        def told(process):
            return 'Another node was started as /twin' in process.errors()

        respawned = self.ready('twin', 'improved', arguments=('--respawned',))
        second = self.start('twin')
        self.robot.wait(lambda: told(respawned), 'the first to say so', 60.0)
        self.robot.run(3.0)
        self.assertFalse(respawned.ended(), 'roslaunch would start it again, and it would take the name back')
        self.assertFalse(second.ended(), second.errors())
        self.end(respawned)
        self.start('twin')
        self.robot.wait(second.ended, 'the second to end', 60.0)
        self.assertTrue(told(second), second.errors())

    def test_starts_without_a_warning_whichever_sensor_is_first(self):
        for name, preset, wheels, imu in (('together', 'predictive', 0.0, 0.0), ('wheels_first', 'predictive', 0.3, 0.9),
                                          ('imu_first', 'improved', 0.9, 0.3)):
            relays = {topic: Relay(topic, kind, name + '/' + topic) for topic, kind in (('joint_states', JointState), ('imu/data', Imu))}
            begin = dict.fromkeys(relays, float('inf'))
            for topic, relay in relays.items():
                relay.alter = lambda message, topic=topic: message if self.robot.now() >= begin[topic] else None
            self.robot.wanted = None
            process = self.ready(name, preset, 'plant_model', arguments=['{0}:={1}/{0}'.format(topic, name) for topic in begin])
            now = self.robot.now()
            begin.update({'joint_states': now + wheels, 'imu/data': now + imu})
            self.robot.run(1.5)
            self.robot.commanded = False
            self.drive(1.0)
            for state in self.robot.states:
                self.assertIn((state.status, bool(state.reason), state.rejected_measurements),
                              {(ControllerState.IDLE, True, 0), (ControllerState.DRIVING, False, 0)}, state.reason)
            lines = [line for line in process.errors().splitlines() if ' yet: start the robot' not in line]  # by the wall clock
            self.assertFalse([line for line in lines if 'WARN' in line or 'ERROR' in line])
            self.robot.rest()
            self.end(process)
            for relay in relays.values():
                relay.subscriber.unregister()

    def test_the_slip_is_frozen_saved_and_outlives_a_restart_and_a_kill(self):
        process = self.ready('learning', 'predictive', 'plant_model', plant_model__effective_track=CONFIGURED, slip__file=str(self.file))
        self.robot.rest()
        self.assertTrue(call('/learning/freeze_learning', SetBool, True).success)
        self.drive(0.0, 0.5)
        self.assertAlmostEqual(self.robot.state().effective_track, CONFIGURED)
        self.assertTrue(self.robot.state().learning_frozen)
        call('/learning/freeze_learning', SetBool, False)
        self.robot.run(3.0)
        saved = call('/learning/save_learned_model', Trigger)
        self.assertTrue(saved.success, saved.message)
        self.assertIn('{}: effective track 0.5'.format(self.file), saved.message)
        self.assertIn('effective_track: 0.5', self.file.read_text())
        # After a turn the ground's share fades, which is not saved. It is written every 10 s, the last time at rest.
        for number, seconds in ((signal.SIGTERM, 3.0), (signal.SIGKILL, 12.0)):
            self.file.unlink()
            self.drive(0.0, -0.5)
            self.robot.command(0.0)
            self.robot.run(seconds)
            learned = self.robot.state().effective_track
            self.assertAlmostEqual(learned, TRUE, delta=TOLERANCE)
            self.end(process, number)
            process = self.ready('learning')
            self.assertAlmostEqual(self.robot.states[0].effective_track, learned, delta=1e-3, msg='known before the first turn')
            self.robot.rest()


if __name__ == '__main__':
    rospy.init_node('start_and_stop_test')
    rostest.rosrun('jackal_aic', 'start_and_stop', StartAndStop)
