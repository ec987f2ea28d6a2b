"""A topic on which things go wrong: messages in, messages with their times out. Time is an argument."""

import bisect
import copy
import math
import random
import types

import rospy

LARGEST, LARGEST_FLOAT32 = 1e300, 1e38
# Vectors of a topic, their channels, and their axes that count.
VECTORS = {'imu': (('angular_velocity', 'gyro', 'z'), ('linear_acceleration', 'acceleration', 'xyz')),
           'set_point': (('linear', 'forward', 'x'), ('angular', 'yaw_rate', 'z'))}


def places(topic, message, channel):
    """Where the values of a channel are, as (container, key)."""
    sides = [side for side in ('left', 'right') if channel in ('all', side)]
    if topic == 'joint_states':
        message.velocity = list(message.velocity)
        return [(message.velocity, i) for i, name in enumerate(message.name[:len(message.velocity)]) if any(side in name for side in sides)]
    if topic == 'cmd_drive':
        message.drivers = list(message.drivers)
        return [(message.drivers, ('left', 'right').index(side)) for side in sides]
    if topic == 'feedback':
        return [(message.drivers[('left', 'right').index(side)], 'measured_velocity') for side in sides]
    return [(getattr(message, vector), axis) for vector, name, axes in VECTORS.get(topic, ()) if channel in ('all', name) for axis in axes]


def get(place):
    container, key = place
    return container[key] if isinstance(key, int) else getattr(container, key)


def put(place, value):
    container, key = place
    if isinstance(key, int):
        container[key] = value
    else:
        setattr(container, key, value)


def faulty(fault, value):
    """What a fault makes of a value."""
    return {'not_a_number': math.nan, 'infinite': math.inf, 'set': fault.amount, 'bias': value + fault.amount, 'scale': value * fault.amount,
            'huge': LARGEST_FLOAT32 if fault.topic in ('cmd_drive', 'feedback') else LARGEST}[fault.kind]


def turn_over(imu):
    """By half a turn about the sensor's own x axis."""
    for vector in (imu.angular_velocity, imu.linear_acceleration):
        vector.y, vector.z = -vector.y, -vector.z
    q = imu.orientation
    q.w, q.x, q.y, q.z = -q.x, q.w, q.z, -q.y


def spoil(message, kind):
    """Faults that one type of message has."""
    if kind == 'wrong_names':
        message.name = ['unknown_' + name for name in message.name]
    elif kind == 'one_side':
        kept = [(name, value) for name, value in zip(message.name, message.velocity) if 'right' not in name]
        message.name, message.velocity, message.position, message.effort = [name for name, _ in kept], [value for _, value in kept], [], []
    elif kind == 'no_values':
        message.velocity = []
    elif kind == 'upside_down':
        turn_over(message)
    elif kind == 'driver_fault':
        for driver in message.drivers:
            driver.driver_fault = True
    elif kind == 'mode_none':
        message.actual_mode = -1
    elif kind == 'external_stop':
        message.driver_external_stop_present, message.driver_external_stop_stopped, message.drivers_active = True, True, False


class Channel:
    """Passes the messages of one topic through its faults, in their order. Equal messages give equal results."""

    def __init__(self, topic):
        self.topic = topic
        self.arm((), 0.0)

    def arm(self, faults, onset):
        """Forgets everything from before. onset [s]: from which `start` of a fault counts."""
        # first: the message in force when a fault began; second: whether the next message is the second of a pair
        self._wrong = [types.SimpleNamespace(fault=fault, first=None, second=False) for fault in faults]
        self._onset, self._random = onset, random.Random(1)
        self._last_good, self._waiting = None, []

    def take(self, now, message):
        """A message comes in; what is due goes out by due()."""
        active = [wrong for wrong in self._wrong if wrong.fault.active(now - self._onset)]
        batch = [(now, copy.deepcopy(message) if active else message)]
        for wrong in active:
            batch = [entry for one in batch for entry in self._apply(wrong, now, *one)]
        if not active:
            self._last_good = message
        for time, sent in batch:  # behind those of the same time, so that what came first goes first
            self._waiting.insert(bisect.bisect_right([other for other, _ in self._waiting], time), (time, sent))

    def due(self, now):
        """The messages that are due, in the order of their times."""
        count = bisect.bisect_right([time for time, _ in self._waiting], now)
        found, self._waiting = [message for _, message in self._waiting[:count]], self._waiting[count:]
        return found

    def _apply(self, wrong, now, time, message):
        """What becomes of a message: any number of (time, message)."""
        fault = wrong.fault
        if wrong.first is None:
            wrong.first = copy.deepcopy(self._last_good or message)
        if fault.share < 1.0 and self._random.random() >= fault.share:
            return [(time, message)]
        if fault.kind == 'drop':
            return []
        if fault.kind == 'delay':
            return [(time + fault.amount, message)]
        if fault.kind == 'duplicate':
            return [(time, copy.deepcopy(message)) for _ in range(1 + int(fault.amount))]
        if fault.kind == 'reorder':
            wrong.second = not wrong.second
            return [(time + (fault.amount if wrong.second else 0.0), message)]
        if fault.kind == 'burst':
            begun = self._onset + fault.start
            return [(begun + fault.amount * (math.floor((now - begun) / fault.amount) + 1.0), message)]
        return [(time, self._falsified(wrong, message))]

    def _falsified(self, wrong, message):
        fault, first = wrong.fault, wrong.first
        if fault.kind == 'stale' or (fault.kind == 'freeze' and fault.channel == 'all'):
            found = copy.deepcopy(first)
            if fault.kind == 'freeze' and hasattr(message, 'header'):
                found.header.stamp = message.header.stamp
            return found
        if fault.kind.startswith('stamp'):
            message.header.stamp = self._stamp(fault, first.header.stamp, message.header.stamp)
        elif fault.kind == 'freeze':
            for place, old in zip(*(places(self.topic, one, fault.channel) for one in (message, first))):
                put(place, get(old))
        elif fault.kind in ('not_a_number', 'infinite', 'set', 'huge', 'bias', 'scale'):
            for place in places(self.topic, message, fault.channel):
                put(place, faulty(fault, get(place)))
        else:
            spoil(message, fault.kind)
        return message

    @staticmethod
    def _stamp(fault, first, stamp):
        seconds = {'stamp_repeated': first.to_sec(), 'stamp_reversed': 2.0 * first.to_sec() - stamp.to_sec(),
                   'stamp_shift': stamp.to_sec() + fault.amount}
        return rospy.Time() if fault.kind == 'stamp_zero' else rospy.Time.from_sec(max(1e-9, seconds[fault.kind]))
