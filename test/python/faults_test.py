#!/usr/bin/python3
"""The fault campaign without a master: what faults make of messages, which scenarios are read, and what the judge fails."""

import math
import pathlib
import sys
import unittest

import jackal_aic
import rospy
import rosunit
from jackal_msgs.msg import Feedback, Status
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / 'sim/faults'))

import campaign  # noqa: E402
import channel  # noqa: E402
import judge  # noqa: E402
import scenarios  # noqa: E402
from scenarios import Fault  # noqa: E402

ONSET, PERIOD = 1.0, 0.02  # s
SHIPPED = scenarios.parse((SOURCE / 'sim/faults/scenarios.yaml').read_text())
JOINTS = ['front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel']


def stamp_of(i):
    return ONSET + (i - 1) * PERIOD


def wheels(time):
    message = JointState(name=JOINTS, velocity=(1.0 + time, 2.0 + time, 1.0 + time, 2.0 + time))
    message.header.stamp = rospy.Time.from_sec(time)
    return message


def sent(count, kind, amount=0.0, **fault):
    """(time, message) of what comes out of `count` wheel messages at 50 Hz from one period before the onset on."""
    one, found = channel.Channel('joint_states'), []
    one.arm([Fault('joint_states', kind, amount=amount, duration=0.1, **fault)], ONSET)
    for i in range(count):
        one.take(stamp_of(i), wheels(stamp_of(i)))
        for k in range(20):  # in between, so that a message is seen within a millisecond of its time
            found += [(stamp_of(i) + 0.001 * k, message) for message in one.due(stamp_of(i) + 0.001 * k + 1e-9)]
    return found


def passed(topic, message, *faults):
    one = channel.Channel(topic)
    one.arm(faults, 0.0)
    one.take(0.01, message)
    return one.due(100.0)


class Messages(unittest.TestCase):

    def test_come_when_the_fault_says(self):
        for kind, amount, count, numbers in (('drop', 0.0, 8, [0, 6, 7]), ('delay', 0.03, 4, [0, 1, 2]), ('duplicate', 2.0, 2, [0, 1, 1, 1]),
                                             ('reorder', 0.03, 6, [0, 2, 1, 4, 3]), ('burst', 0.06, 5, [0, 1, 2, 3]), ('stale', 0.0, 3, [0, 0, 0])):
            found = [round((message.header.stamp.to_sec() - ONSET) / PERIOD) + 1 for _, message in sent(count, kind, amount)]
            self.assertEqual(found[:len(numbers)], numbers, kind)
        self.assertAlmostEqual(sent(4, 'delay', 0.03)[1][0], stamp_of(1) + 0.03, delta=0.002)
        self.assertTrue(all(abs(time - ONSET - 0.06) < 0.002 for time, _ in sent(5, 'burst', 0.06)[1:]))

    def test_have_the_stamps_that_the_fault_says(self):
        for kind, amount, stamp in (('stamp_zero', 0.0, 0.0), ('stamp_shift', 10.0, stamp_of(3) + 10.0), ('stamp_repeated', 0.0, stamp_of(0)),
                                    ('stamp_reversed', 0.0, stamp_of(0) - 3 * PERIOD), ('freeze', 0.0, stamp_of(3))):
            self.assertAlmostEqual(sent(4, kind, amount)[3][1].header.stamp.to_sec(), stamp, places=6, msg=kind)

    def test_have_wrong_values_on_the_channel_only(self):
        good, old = wheels(stamp_of(1)).velocity, wheels(stamp_of(0)).velocity
        for kind, amount, right in (('bias', 0.5, good[1] + 0.5), ('scale', -1.0, -good[1]), ('set', 4.0, 4.0), ('huge', 0.0, 1e300),
                                    ('infinite', 0.0, math.inf), ('freeze', 0.0, old[1])):
            velocity = sent(2, kind, amount, channel='right')[1][1].velocity
            self.assertEqual(velocity, [good[0], right, good[2], right], kind)
        self.assertTrue(math.isnan(sent(2, 'not_a_number', channel='left')[1][1].velocity[0]))
        self.assertEqual(tuple(sent(4, 'freeze')[3][1].velocity), old)

    def test_of_each_type_have_their_own_faults(self):
        self.assertEqual(sent(2, 'wrong_names')[1][1].name[0], 'unknown_front_left_wheel')
        self.assertEqual(sent(2, 'one_side')[1][1].name, JOINTS[::2])
        self.assertEqual(len(sent(2, 'one_side')[1][1].velocity), 2)
        self.assertEqual(len(sent(2, 'no_values')[1][1].velocity), 0)
        imu = Imu()
        imu.orientation.w, imu.angular_velocity.x, imu.angular_velocity.z, imu.linear_acceleration.z = 1.0, 0.1, 0.5, 9.81
        turned, = passed('imu', imu, Fault('imu', 'upside_down'))
        self.assertEqual((turned.angular_velocity.x, turned.angular_velocity.z, turned.linear_acceleration.z), (0.1, -0.5, -9.81))
        self.assertEqual((turned.orientation.x, turned.orientation.w), (1.0, 0.0))
        self.assertEqual(imu.angular_velocity.z, 0.5, 'the message that came in is as it was')
        reported, = passed('feedback', Feedback(), Fault('feedback', 'driver_fault'), Fault('feedback', 'mode_none'))
        self.assertTrue(reported.drivers[0].driver_fault)
        self.assertEqual(reported.actual_mode, -1)
        self.assertTrue(passed('status', Status(), Fault('status', 'external_stop'))[0].driver_external_stop_stopped)

    def test_are_hit_by_the_share_asked_for_and_alike_each_time(self):
        counts, one = [], channel.Channel('joint_states')
        for _ in range(2):
            one.arm([Fault('joint_states', 'drop', share=0.3, duration=1000.0)], 0.0)
            for i in range(2000):
                one.take(0.02 * i, wheels(0.02 * i))
            counts.append(len(one.due(1000.0)))
        self.assertAlmostEqual(counts[0], 1400, delta=60)
        self.assertEqual(*counts)


class Scenarios(unittest.TestCase):
    HEAD = 'motions: {rest: {forward: 0.0}, straight: {forward: 1.0}}\nscenarios: {sample: {motions: [rest, straight], '
    EXPECT = 'expect: {outcome: drives, detected_by: tolerated}'

    def test_are_read_with_each_motion_and_robot(self):
        found = scenarios.parse(self.HEAD + 'core: [straight], onset: 3, plant: {encoder_step: [0.06, 0.1]}, imu: {kind: bias, channel: gyro, '
                                'amount: -0.3, start: 0.2, duration: 0.5}, expect: {outcome: stops, within: 0.2, reasons: [gyro]}}}')
        self.assertEqual([run.name for run in found], ['sample_{}/{}'.format(step, motion) for step in (0.06, 0.1) for motion in ('rest', 'straight')])
        self.assertEqual([run.core for run in found], 2 * [False, True])
        self.assertEqual(found[3].plant, {'encoder_step': 0.1})
        self.assertEqual(found[3].faults, (Fault('imu', 'bias', 'gyro', -0.3, 1.0, 0.2, 0.5),))
        self.assertAlmostEqual(found[3].end(), 5.7)

    def test_are_refused_if_they_do_not_fit(self):
        for body, words in (('imu: {kind: drop}', "scenarios.sample: 'expect'"),
                            ('imu: {kind: drop}, expect: {outcome: drives}', 'with reasons'),
                            ('imu: {kind: drop}, expect: {detected_by: tolerated}', "'outcome'"),
                            ('imu: {channel: gyro}, ' + self.EXPECT, "'kind'"), ('imu: {kind: melt}, ' + self.EXPECT, 'melt of all is not a fault of imu'),
                            ('imu: {kind: drop, shares: 0.5}, ' + self.EXPECT, "'shares'"),
                            ('lidar: {kind: drop}, ' + self.EXPECT, "'lidar'"), ('system: {kind: melt}, ' + self.EXPECT, 'melt of all'),
                            ('set_point: {kind: stamp_zero}, ' + self.EXPECT, 'not a fault'),
                            ('imu: {kind: bias, channel: left}, ' + self.EXPECT, 'not a fault')):
            with self.assertRaises(ValueError) as caught:
                scenarios.parse(self.HEAD + body + '}}')
            self.assertIn(words, str(caught.exception))
        with self.assertRaisesRegex(ValueError, 'select = .*matches no scenario'):
            scenarios.selected(str(SOURCE / 'sim/faults/scenarios.yaml'), 'nonesuch')

    def test_that_ship_try_every_kind_of_fault(self):
        self.assertEqual(len({run.name for run in SHIPPED}), len(SHIPPED))
        kinds = {fault.kind for run in SHIPPED for fault in run.faults}
        own = [kind for _, kinds_of in scenarios.TOPICS.values() for kind in kinds_of]
        wanted = {*scenarios.OF_TIME, *scenarios.OF_STAMP, *scenarios.OF_VALUE, *scenarios.SYSTEM, *own} - {'block_right'}
        self.assertEqual(wanted - kinds, set(), 'never tried')
        for plant in {tuple(run.plant.items()) for run in SHIPPED}:
            jackal_aic.settings('ground', 'predictive', {'plant.' + name: value for name, value in plant})


GATE = {'limits.linear_speed': 2.0, 'limits.angular_speed': 4.0, 'limits.wheel_speed': 25.5, 'limits.linear_acceleration': 20.0,
        'limits.angular_acceleration': 25.0, 'brake.time': 1.0, 'brake.linear_deceleration': 3.0, 'brake.angular_deceleration': 6.0}
LIMITS = judge.Limits(GATE)
STOPS = scenarios.Scenario('sample/straight', 'straight', (1.0, 0.0), (Fault('imu', 'drop'),), {},
                           scenarios.Expectation('stops', within=0.2, reasons=('IMU',), recovers=False))
DRIVES = scenarios.Expectation('drives', 'tolerated')


def braking(stop, deceleration=2.0):
    """A run at 1 m/s until `stop` [s], then a ramp to zero, by robot and command alike."""
    record = judge.Record()
    for k in range(281):
        time = 0.02 * k
        speed = 1.0 if time < stop else max(0.0, 1.0 - deceleration * (time - stop))
        record.truth.append(judge.Truth(time, speed, 0.0))
        record.commands.append(judge.Command(time, speed / 0.098, speed / 0.098))
        record.states.append(judge.State(time, time < stop, 'driving' if time < stop else 'braking: IMU data too old'))
    return record


def changed(record, series, first, last, **values):
    """The record with other values of a series between two times."""
    samples = getattr(record, series)
    setattr(record, series, [s._replace(**values) if first < s.time < last else s for s in samples])
    return record


class Judge(unittest.TestCase):

    def failures(self, record, expectation=STOPS.expectation):
        return '; '.join(judge.Verdict(STOPS._replace(expectation=expectation), record, LIMITS).failures)

    def test_passes_a_stop_in_time(self):
        row = judge.Verdict(STOPS, braking(2.2), LIMITS).row()
        self.assertEqual(row['failures'], '')
        self.assertEqual(row['history'], '0.00 s driving, 2.20 s braking: IMU data too old')
        for name, value, delta in (('standstill_s', 0.7, 0.021), ('detected_s', 0.2, 0.021), ('distance_m', 0.45, 0.03),
                                   ('command_step_radps', 0.04 / 0.098, 1e-3), ('acceleration_use', 0.1, 1e-3), ('limit_use', 0.5, 1e-3)):
            self.assertAlmostEqual(float(row[name]), value, delta=delta, msg=name)

    def test_fails_every_bar_that_is_missed(self):
        late = STOPS.expectation._replace(detected_within=0.15)
        drives_on, counts = braking(100.0), DRIVES._replace(detected_by='set_points')
        for words, record, expectation in (
                ('standstill after', braking(2.9), STOPS.expectation), ('does not stop', drives_on, STOPS.expectation),
                ('undetected', drives_on, STOPS.expectation), ('at the end', drives_on, STOPS.expectation),
                ('at the onset', braking(0.0, 1000.0), STOPS.expectation), ('steps by', braking(2.2, 1000.0), STOPS.expectation),
                ('standstill after', changed(braking(2.2), 'truth', 3.3, 3.4, forward=0.1), STOPS.expectation),
                ('of the limits', changed(braking(2.2), 'commands', -1.0, 1.8, left=21.5, right=21.5), STOPS.expectation),
                ('not finite', changed(braking(2.2), 'commands', 0.05, 0.07, right=math.nan), STOPS.expectation),
                ('overspeed 0.40', changed(braking(2.2), 'truth', 2.05, 2.15, forward=-1.4), STOPS.expectation),
                ('yaw rate 3.00', changed(braking(2.2), 'truth', 2.05, 2.15, yaw_rate=-3.0), STOPS.expectation),
                ('told after', braking(2.2), late), ('nothing was recorded', judge.Record(), STOPS.expectation),
                ('interrupted', changed(braking(100.0), 'states', 2.3, 2.5, driving=False), DRIVES),
                ("latched: 'faulted: sensors'", changed(braking(100.0), 'states', 2.3, 2.5, text='faulted: sensors'), DRIVES._replace(outcome='resumes')),
                ('does not drive at the end', changed(braking(100.0), 'states', 5.5, 9.0, driving=False), DRIVES._replace(outcome='resumes')),
                ('undetected', changed(braking(100.0), 'states', -1.0, 9.0, rejected_set_points=5), counts)):
            self.assertIn(words, self.failures(record, expectation))
        for record, expectation in ((drives_on, DRIVES), (changed(braking(100.0), 'states', 2.3, 9.0, rejected_set_points=7), counts),
                                    (changed(braking(100.0), 'states', 2.3, 2.5, driving=False), DRIVES._replace(outcome='resumes'))):
            self.assertEqual(self.failures(record, expectation), '')

    def test_a_new_process_starts_from_zero(self):
        still = changed(braking(2.2), 'commands', 2.2, 9.0, left=0.0, right=0.0)
        self.assertIn('steps by', self.failures(still))
        self.assertEqual(self.failures(changed(still, 'commands', 2.2, 2.235, fresh_start=True)), '')
        self.assertIn('old motion', self.failures(changed(still, 'commands', 2.2, 2.3, left=3.0, right=3.0)))


class Recording(unittest.TestCase):

    def test_keeps_truth_before_its_clock_but_none_of_before_a_reset(self):
        nodes = object.__new__(campaign.Campaign)  # without a ROS graph
        nodes._record, nodes._recording, nodes._base, nodes._plant_clock = judge.Record(), True, 4.0, 2.0
        for stamp in (1.99, 2.02, 7.5):
            truth = Odometry()
            truth.header.stamp = rospy.Time.from_sec(stamp)
            nodes._on_truth(truth)
        self.assertEqual([round(sample.time, 2) for sample in nodes._record.truth], [5.99, 6.02])


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'faults', '__main__')
