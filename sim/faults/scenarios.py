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


def require(good, key, words):
    if not good:
        raise ValueError('{}: {}'.format(key, words))


def one_of(key, value, known):
    require(value in known, key, "'{}' is unknown; known: {}".format(value, ', '.join(known)))
    return value


def keys(key, node, known):
    """A mapping with known keys."""
    require(isinstance(node, dict), key, 'must be a mapping')
    for name in node:
        one_of(key, name, known)
    return node


def fault_of(key, topic, node):
    require('kind' in node, key + '.kind', 'missing')
    fault = Fault(topic, **keys(key, dict(node), Fault._fields[1:]))
    if topic == 'system':
        one_of(key, fault.kind, SYSTEM)
        return fault
    channels, own = TOPICS[topic]
    possible = own + OF_TIME + (() if topic in UNSTAMPED else OF_STAMP) + (OF_VALUE if fault.channel in channels else ())
    require(fault.kind in possible, key, '{} of {} is not a fault of this topic'.format(fault.kind, fault.channel))
    return fault


def expectation_of(key, node):
    node = keys(key, dict(node), Expectation._fields)
    require('outcome' in node, key + '.outcome', 'missing')
    node['reasons'] = tuple(node.get('reasons', ()))
    found = Expectation(**node)
    one_of(key + '.outcome', found.outcome, ('stops', 'drives', 'resumes'))
    one_of(key + '.detected_by', found.detected_by, ('state', 'set_points', 'measurements', 'tolerated'))
    require(found.reasons or found.detected_by != 'state', key + '.reasons', 'missing, though detected_by needs them')
    return found


def plants_of(node):
    """Each combination of the values of plant.*, where a list stands for several robots: (suffix of the name, values)."""
    lists = [name for name, value in node.items() if isinstance(value, list)]
    for values in itertools.product(*(node[name] for name in lists)):
        yield ''.join('_{:g}'.format(value) for value in values), dict(node, **dict(zip(lists, values)))


def scenarios_of(name, node, motions):
    """The runs of an entry: with each of its motions and of its robots."""
    key = 'scenarios.' + name
    keys(key, node, ('motions', 'core', 'real', 'onset', 'recovery', 'own_launch', 'plant', 'expect', 'system') + tuple(TOPICS))
    faults = tuple(fault_of('{}.{}'.format(key, topic), topic, node[topic]) for topic in (*TOPICS, 'system') if topic in node)
    require(faults or node.get('plant'), key, 'has no fault')
    require('motions' in node and 'expect' in node, key, 'motions and expect are needed')
    for part in ('motions', 'core', 'real'):
        for motion in node.get(part, ()):
            one_of('{}.{}'.format(key, part), motion, motions)
    rest = {part: node[part] for part in ('onset', 'recovery', 'own_launch') if part in node}
    for motion in node['motions']:
        point = keys('motions.' + motion, motions[motion], ('forward', 'yaw_rate'))
        for suffix, plant in plants_of(node.get('plant', {})):
            yield Scenario('{}{}/{}'.format(name, suffix, motion), motion, (point.get('forward', 0.0), point.get('yaw_rate', 0.0)), faults,
                           plant, expectation_of(key + '.expect', node['expect']), core=motion in node.get('core', ()),
                           real=motion in node.get('real', ()), **rest)


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
    """All scenarios of a YAML text, in alphabetical order. Raises ValueError naming key and value."""
    try:
        node = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ValueError(' '.join(str(error).split())) from error
    keys('scenarios', node, ('motions', 'scenarios', 'pairs'))
    motions = node.get('motions', {})
    found = [run for name, entry in node.get('scenarios', {}).items() for run in scenarios_of(name, entry, motions)]
    by_name = {run.name: run for run in found}
    for first, second, chosen in node.get('pairs', ()):
        for motion in chosen:
            names = ['{}/{}'.format(name, motion) for name in (first, second)]
            for name in names:
                one_of('pairs', name, by_name)
            found.append(pair(*(by_name[name] for name in names), motion))
    return sorted(found, key=lambda run: run.name)


def read(path):
    try:
        with open(path) as file:
            return parse(file.read())
    except (OSError, ValueError) as error:
        raise ValueError('{}: {}'.format(path, error)) from error


def selected(path, pattern='.', own_launch=False, core=False, real=False):
    """The scenarios whose name matches a regular expression, of the test suite (core) or of the plant `real`."""
    try:
        expression = re.compile(pattern)
    except re.error as error:
        raise ValueError("select = '{}': no regular expression: {}".format(pattern, error)) from error
    found = [run for run in read(path) if expression.search(run.name) and run.own_launch == own_launch and (run.core or not core) and
             (run.real or not real)]
    require(found, "select = '{}'".format(pattern), 'matches no scenario')
    return found
