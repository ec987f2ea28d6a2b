"""The scenarios of the fault campaign: what the robot does, what goes wrong, and what has to come of it (scenarios.yaml)."""

import itertools
import re
import typing

import yaml

SIDES, CHANNELS_OF_SET_POINT = ('all', 'left', 'right'), ('all', 'forward', 'yaw_rate')
# Topics between robot, controller and operator: the channels of their values, and the faults that no other topic has.
TOPICS = {'joint_states': (SIDES, ('wrong_names', 'one_side', 'no_values')), 'imu': (('all', 'gyro', 'acceleration'), ('upside_down',)),
          'feedback': (SIDES, ('driver_fault', 'mode_none')), 'status': ((), ('external_stop',)), 'set_point': (CHANNELS_OF_SET_POINT, ()),
          'cmd_drive': (SIDES, ())}
OF_TIME = ('drop', 'delay', 'duplicate', 'reorder', 'burst', 'stale')
OF_STAMP = ('stamp_zero', 'stamp_shift', 'stamp_repeated', 'stamp_reversed')
OF_VALUE = ('freeze', 'not_a_number', 'infinite', 'set', 'huge', 'bias', 'scale')
UNSTAMPED = ('set_point', 'cmd_drive')
SYSTEM = ('e_stop', 'second_publisher', 'block_left', 'block_right', 'push', 'lift', 'clock_jump', 'clock_reset', 'pause', 'stall',
          'kill', 'interrupt', 'terminate', 'master_restart')


class Fault(typing.NamedTuple):
    """A fault of a topic or, with topic 'system', of robot, clock or process. What amount means depends on the kind (scenarios.yaml);
    start [s] counts from the onset; share: of the messages that are hit; torque [N m]: of a push."""

    topic: str
    kind: str
    channel: str = 'all'
    amount: float = 0.0
    share: float = 1.0
    start: float = 0.0
    duration: float = 1.6
    torque: float = 0.0

    def active(self, since_onset):
        return self.start <= since_onset < self.start + self.duration

    def possible(self):
        """Whether its topic has a fault of this kind on this channel."""
        if self.topic == 'system':
            return self.kind in SYSTEM
        channels, own = TOPICS[self.topic]
        return self.kind in own + OF_TIME + (() if self.topic in UNSTAMPED else OF_STAMP) + (OF_VALUE if self.channel in channels else ())

    def __str__(self):
        amount = ' {:g}'.format(self.amount) if self.amount else ''
        channel = ' of ' + self.channel if self.channel != 'all' else ''
        share = ' in {:g}'.format(self.share) if self.share < 1.0 else ''
        return ('' if self.topic == 'system' else self.topic + ' ') + self.kind + amount + channel + share


class Expectation(typing.NamedTuple):
    """What has to come of a scenario; see scenarios.yaml."""

    outcome: str
    detected_by: str = 'state'
    reasons: tuple = ()
    within: float = 0.0
    detected_within: float = 0.0
    recovers: bool = True
    tolerance: float = 0.1
    overspeed: float = 0.2


class Scenario(typing.NamedTuple):
    """One run. Times count from the reset of the simulation [s]. motion: its name; set_point: (speed, yaw rate)."""

    name: str
    motion: str
    set_point: tuple
    faults: tuple
    plant: dict
    expectation: Expectation
    onset: float = 2.0
    recovery: float = 2.0
    core: bool = False
    real: bool = False
    own_launch: bool = False

    def of(self, topic):
        return [fault for fault in self.faults if fault.topic == topic]

    def clear(self):
        """End of the last fault [s]."""
        return self.onset + max((fault.start + fault.duration for fault in self.faults), default=0.0)

    def end(self):
        return self.clear() + self.recovery


def plants_of(node):
    """Each combination of the values of plant.*, where a list stands for several robots: (suffix of the name, values)."""
    lists = [name for name, value in node.items() if isinstance(value, list)]
    for values in itertools.product(*(node[name] for name in lists)):
        yield ''.join('_{:g}'.format(value) for value in values), dict(node, **dict(zip(lists, values)))


def scenarios_of(name, node, motions):
    """The runs of an entry: with each of its motions and of its robots."""
    node = dict(node)
    faults = tuple(Fault(topic, **node.pop(topic)) for topic in (*TOPICS, 'system') if topic in node)
    for fault in faults:
        if not fault.possible():
            raise ValueError('{} of {} is not a fault of {}'.format(fault.kind, fault.channel, fault.topic))
    expectation = node.pop('expect')
    expectation = Expectation(**dict(expectation, reasons=tuple(expectation.get('reasons', ()))))
    if expectation.outcome not in ('stops', 'drives', 'resumes') or (expectation.detected_by == 'state' and not expectation.reasons):
        raise ValueError('outcome must be stops, drives or resumes, with reasons if it is detected by the state')
    marks = {mark: node.pop(mark, ()) for mark in ('core', 'real')}
    chosen, robots = node.pop('motions'), node.pop('plant', {})
    for motion, (suffix, plant) in itertools.product(chosen, plants_of(robots)):
        set_point = tuple(motions[motion].get(channel, 0.0) for channel in ('forward', 'yaw_rate'))
        yield Scenario('{}{}/{}'.format(name, suffix, motion), motion, set_point, faults, plant, expectation,
                       **{mark: motion in marked for mark, marked in marks.items()}, **node)


def pair(first, second, motion):
    """Two scenarios at once: the one that stops the robot does so in spite of the other, and the sooner of two counts."""
    one, other = (found.expectation for found in (first, second))
    order = {'stops': 0, 'resumes': 1, 'drives': 2}
    sooner, later = sorted((one, other), key=lambda e: (order[e.outcome], e.within, e.detected_by == 'tolerated'))
    found = sooner._replace(tolerance=max(one.tolerance, other.tolerance), overspeed=max(one.overspeed, other.overspeed))
    return first._replace(name='{}+{}/{}'.format(first.name.split('/')[0], second.name.split('/')[0], motion), motion=motion,
                          faults=first.faults + second.faults, plant={**first.plant, **second.plant}, expectation=found,
                          core=False, real=False)


def parse(text):
    """All scenarios of a YAML text, in alphabetical order. Raises ValueError naming the entry that cannot be read."""
    node, by_name = yaml.safe_load(text), {}
    for name, entry in node['scenarios'].items():
        try:
            by_name.update((run.name, run) for run in scenarios_of(name, entry, node['motions']))
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError('scenarios.{}: {}'.format(name, error)) from error
    for first, second, chosen in node.get('pairs', ()):
        for run in [pair(by_name[first + '/' + motion], by_name[second + '/' + motion], motion) for motion in chosen]:
            by_name[run.name] = run
    return sorted(by_name.values(), key=lambda run: run.name)


def selected(path, pattern='.', own_launch=False, core=False, real=False):
    """The scenarios of a file whose name matches a regular expression, of the test suite (core) or of the plant `real`."""
    try:
        with open(path) as file:
            runs = parse(file.read())
        found = [run for run in runs if re.search(pattern, run.name) and run.own_launch == own_launch and (run.core or not core) and
                 (run.real or not real)]
    except (OSError, KeyError, re.error, yaml.YAMLError) as error:
        raise ValueError('{}, select = {}: {}'.format(path, pattern, ' '.join(str(error).split()))) from error
    if not found:
        raise ValueError("select = '{}': matches no scenario".format(pattern))
    return found
