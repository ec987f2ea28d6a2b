"""Set points over time, and the step of them that is assessed."""

import bisect
import math
import typing

from jackal_aic import Fault

from draws import Draws

REST = 0.5  # s before the first step
STEP_TIME = 4.0  # s, of a step response
TICK = 0.001  # s, of the simulation


class Motion(typing.NamedTuple):
    """A drive: set_points as (time, speed, yaw rate) [s, m/s, rad/s], its duration [s], and what is assessed.

    channel: 'speed' or 'yaw_rate', whose step at `start` is assessed until `end` [s]; None: no step.
    faults: faults meanwhile (jackal_aic.Fault).
    """

    set_points: tuple
    duration: float
    channel: typing.Optional[str] = None
    start: float = 0.0
    end: float = 0.0
    faults: tuple = ()

    def at(self, time):
        """The set point (speed, yaw rate) at a time [s]."""
        begun = bisect.bisect_right(self.set_points, (time + 1e-9, math.inf))
        return self.set_points[begun - 1][1:] if begun else (0.0, 0.0)

    def step(self):
        """The assessed step: (speed before, after), (yaw rate before, after)."""
        before, after = self.at(self.start - TICK), self.at(self.start)
        return (before[0], after[0]), (before[1], after[1])


def require(good, name, value, bound):
    if not good:
        raise ValueError('{} = {:g}: must be {}'.format(name, value, bound))


def step(forward, yaw_rate=0.0, duration=STEP_TIME):
    """A step from rest, assessed in the speed unless only the yaw rate steps."""
    require(abs(forward) <= 10.0 and (forward != 0.0 or yaw_rate != 0.0), 'step', forward,
            'within +-10 m/s and not zero, unless there is a turn')
    require(abs(yaw_rate) <= 50.0, 'turn', yaw_rate, 'within +-50 rad/s')
    require(0.6 <= duration <= 3600.0, 'duration', duration, 'in [0.6, 3600] s')
    end = REST + duration
    return Motion(((REST, forward, yaw_rate),), end, 'speed' if forward != 0.0 else 'yaw_rate', REST, end)


def square(low, high, period=4.0, cycles=3):
    """A square wave of the speed from rest; the second rise from low to high is assessed."""
    require(abs(low) <= 10.0, 'min', low, 'within +-10 m/s')
    require(abs(high) <= 10.0 and high != low, 'max', high, 'within +-10 m/s and different from min')
    require(1.2 <= period <= 3600.0, 'period', period, 'in [1.2, 3600] s')
    require(2 <= cycles <= 1000, 'cycles', cycles, 'in [2, 1000]')
    half = 0.5 * period
    points = tuple((REST + i * half, high if i % 2 else low, 0.0) for i in range(2 * cycles))
    start = REST + 3.0 * half
    return Motion(points, REST + cycles * period, 'speed', start, start + half)


def cycle(seed=1, segments=20, forward=1.0, yaw_rate=1.0, shortest=1.0, longest=3.0):
    """Segments of constant set point, drawn: a third of them straight, a sixth turning in place. No step is assessed."""
    draw, points, time = Draws(seed), [], REST
    for i in range(segments):
        v, w = draw.between(-forward, forward), draw.between(-yaw_rate, yaw_rate)
        points.append((time, 0.0 if i % 6 == 2 else v, 0.0 if i % 3 == 0 else w))
        time += TICK * float(round(draw.between(shortest, longest) / TICK))
    return Motion(tuple(points), time)


def segments(parts):
    """Segments (duration, speed, yaw rate), and two seconds of rest."""
    points, time = [], REST
    for duration, speed, yaw_rate in parts:
        points.append((time, speed, yaw_rate))
        time += duration
    return Motion((*points, (time, 0.0, 0.0)), time + 2.0)


def stop(forward, yaw_rate, drive, stand):
    """From rest to a set point for some time [s], and back to rest for some time [s]."""
    return Motion(((REST, forward, yaw_rate), (REST + drive, 0.0, 0.0)), REST + drive + stand)


def arc(draw):
    """A set point that keeps the robot on its wheels."""
    forward = draw.between(0.1, 1.5)
    fastest = min(2.0, 2.0 / forward)  # 2 m/s^2 across are half of the ground's grip
    return draw.sign() * forward, draw.sign() * draw.between(0.1, fastest)


def joystick_points(draw, duration):
    """Joystick driving: targets change at random times, and the stick follows them with a lag."""
    points, target, stick, until, agility, time = [], (0.0, 0.0), (0.0, 0.0), REST, 1.0, REST
    while time < duration:
        if time >= until:
            kind, (forward, yaw_rate) = draw.below(5), arc(draw)
            target = (0.0 if kind in (0, 1) else forward, 0.0 if kind in (0, 2) else yaw_rate)
            until = time + draw.between(0.2, 5.0)
            agility = draw.between(0.1, 1.0)
        stick = tuple(s + agility * (t - s) for s, t in zip(stick, target))
        if math.hypot(target[0] - stick[0], target[1] - stick[1]) < 0.02:
            stick = target
        points.append((time, *stick))
        time += 0.05
    return tuple(points)


def joystick(seed, duration):
    return Motion(joystick_points(Draws(seed * 1000003), duration), duration)


def ordinary(seed, duration):
    """Steps, turns in place, arcs and square waves in random order."""
    speeds, turns = (0.0, 0.1, 0.3, 0.5, 1.0, -0.5), (0.0, 0.2, 0.5, 1.0, -0.5, -1.0)
    draw, points, time = Draws(seed), [], REST
    while time < duration:
        length = 1.0 + 0.001 * float(draw.below(3000))
        kind = draw.below(4)
        forward, yaw_rate = draw.one_of(speeds), draw.one_of(turns)
        parts = {0: [(forward, 0.0, length)], 1: [(0.0, yaw_rate, length)], 2: [(forward, yaw_rate, length)],
                 3: [(0.5 if half % 2 else 0.1, 0.0, 2.0) for half in range(6)]}
        for speed, turn, seconds in parts[kind]:
            points.append((time, speed, turn))
            time += seconds
    return Motion(tuple(point for point in points if point[0] < duration), duration)


def read(node):
    """The motion of a scenario: a step, a square wave (low, high) or a driving cycle (cycle: its seed)."""
    node = dict(node)
    faults = tuple(Fault('friction', change['time'], value=change['friction']) for change in node.pop('friction_changes', ()))
    channel = node.pop('assess', None)
    if 'low' in node:
        maker = square
    elif 'cycle' in node:
        node['seed'] = node.pop('cycle')
        maker = cycle
    else:
        node.setdefault('forward', 0.0)
        maker = step
    try:
        motion = maker(**node)
    except TypeError as error:
        raise ValueError('profile: {}'.format(error)) from error
    return motion._replace(faults=faults, channel=channel or motion.channel)
