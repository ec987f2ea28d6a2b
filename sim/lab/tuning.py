"""Searches gains that settle fastest on simulated robots, keep their margins, and pass all trials.

A trial drives from rest to a set point and back: nominal robots, robots that differ from their model, coarse encoders and late
samples. tau, kappa_mu, kappa_a and the variances of all orders are searched on logarithmic scales (Nelder and Mead), first on the
linear models, then on the simulated robots in rounds; the worst failed trials of a round join the next. The same task gives the same
gains.
"""

import functools
import math
import pathlib
import types
import typing

import jackal_aic
import numpy

import engine
import motions
import search
import stops
from draws import Draws

SPEED = 0.5  # m/s of the step whose settling time counts
DRIVE, STAND = 4.0, 3.0  # s; half the limit of the ground's motors reaches 2 m/s in 2.5 s
RESERVE = 0.9  # part of a bar above which penalties begin
# Figures (stops.assess()): name, and bars of the robot as it is and of another one; Task has those of the overshoot.
FIGURES = {'overshoot_pct': ('overshoot %', None, None), 'beyond_mps': ('running back m/s', 0.03, 0.10),
           'beyond_radps': ('turning back rad/s', 0.05, 0.15), 'ripple': ('command ripple rad/s', 0.1, 0.1)}

# Set points (speed, yaw rate); robots that differ from their model (dead time + s, lag, gain, acceleration limit x); encoders; largest
# delay of a sample [s].
SET_POINTS = ((0.1, 0.0), (0.3, 0.0), (0.5, 0.0), (1.0, 0.0), (1.5, 0.0), (2.0, 0.0), (0.0, 0.5), (0.0, 2.0), (0.5, 0.5), (1.0, 2.0))
SPREAD = {'dead time + 10 ms': (0.01, 1.0, 1.0, 1.0), 'dead time - 10 ms': (-0.01, 1.0, 1.0, 1.0), 'lag x 1.4': (0.0, 1.4, 1.0, 1.0),
          'lag x 0.7': (0.0, 0.7, 1.0, 1.0), 'gain x 1.05': (0.0, 1.0, 1.05, 1.0), 'gain x 0.95': (0.0, 1.0, 0.95, 1.0),
          'limit x 0.5': (0.0, 1.0, 1.0, 0.5), 'limit x 2': (0.0, 1.0, 1.0, 2.0)}
STEPS, NOISE, LATEST = (0.0065, 0.06, 0.1), (0.0, 0.003, 0.03), 0.010
SEED, ROUNDS, JOINING = 1, 4, 3  # of the random trials; of the local search, and trials that join after each
UNSTABLE = 100.0  # s, the cost of gains without their margins; above every other
RESPONSE, BAND = 2.5, 0.035  # s of a linear response, and its band: narrower than the 5 % of the settling time
RANGES = {'tau': (1e-4, 1.0), 'kappa_mu': (1e-3, 1e3), 'kappa_a': (0.3, 300.0)}


class Task(typing.NamedTuple):
    """A search, by the options of `tune`: from a preset or file, on robots (as simulate() takes them), within bars."""

    start: str
    plant: tuple
    gain_margin: float = 2.0
    delay_margin: float = 0.05
    overshoot: float = 10.0
    orders: int = 1
    evaluations: int = 40
    draws: int = 50

    def loops(self, plant, gains):
        return jackal_aic.linear_loops(plant, self.start, gains)


class Trial(typing.NamedTuple):
    """From rest to a set point and back. nominal: the robot equals its model."""

    plant: str
    set_point: tuple
    overrides: dict
    bars: dict
    name: str
    nominal: bool = False

    def searched(self):
        """True for the step whose settling time counts."""
        return self.nominal and self.set_point == (SPEED, 0.0)


def varied(plant, dead_time, lag, gain, limit):
    return {'plant.dead_time': max(0.0, plant['dead_time'] + dead_time), 'plant.motor_lag': plant['motor_lag'] * lag,
            'plant.wheel_gain': plant['wheel_gain'] * gain, 'plant.acceleration_limit': plant['acceleration_limit'] * limit}


def trials(task, plant):
    """Every trial of a robot. Nominal over the phase of the timers; coarse encoders with late samples; its spread at the worst end of
    the phase; random ones."""
    robot, found = engine.settings(plant, task.start)['plant'], []
    latest = 1.0 / robot['sensor_rate'] - motions.TICK

    def add(set_point, words, overrides, phase=latest, nominal=False, unseen=0.0):
        bars = {figure: bar[0 if nominal else 1] for figure, (_, *bar) in FIGURES.items()}
        bars['overshoot_pct'] = task.overshoot * (1.0 if nominal else 1.5) + unseen
        point = ''.join(', {:.4g} {}'.format(value, unit) for value, unit in zip(set_point, ('m/s', 'rad/s')) if value)
        found.append(Trial(plant, set_point, dict(overrides, **{'loop.phase': phase}), bars, pathlib.Path(plant).stem + point + ', ' + words, nominal))

    for phase in (latest, 0.0, 0.5 * latest):
        for point in SET_POINTS:
            add(point, 'phase {:.4g} s'.format(phase), {}, phase, True)
    for step in STEPS:
        for point in ((0.1, 0.0), (0.7, 0.0), (0.3, 0.7)):  # the encoder does not resolve a part of the set point
            add(point, 'encoder steps of {:.4g} rad/s, late samples'.format(step), {
                'plant.encoder_step': step, 'plant.encoder_noise': 0.003, 'plant.stamp_jitter': LATEST}, 0.5 * latest,
                unseen=10.0 * step / max(point[0], 0.1))
    for name, variant in SPREAD.items():
        for point in ((0.3, 0.0), (1.0, 0.0), (0.5, 1.0)):
            add(point, name, varied(robot, *variant))
    draw = Draws(SEED)
    for i in range(task.draws):
        point, phase, step = draw.one_of(SET_POINTS), draw.between(0.0, latest), draw.one_of((0.0, 0.0131) + STEPS)
        drawn = varied(robot, draw.between(-0.01, 0.01), draw.between(0.7, 1.4), draw.between(0.95, 1.05), 2.0**draw.between(-1.0, 1.0))
        drawn.update({'plant.encoder_step': step, 'plant.encoder_noise': draw.one_of(NOISE),
                      'plant.stamp_jitter': draw.between(0.0, LATEST), 'plant.seed': SEED + i})
        add(point, 'draw {}, encoder steps of {:.4g} rad/s'.format(i, step), drawn, phase)
    return found


def first_trials(task):
    """First trials of a candidate: the searched step at both ends of the phase, a turn, a fast step on a slower motor, and coarse
    encoders on an arc."""
    chosen = [(SPEED, 0.0, 'phase 0.01'), (SPEED, 0.0, 'phase 0 '), (0.0, 2.0, 'phase 0.01'), (1.0, 0.0, 'lag x 1.4'), (0.3, 0.7, 'of 0.06')]
    listed = [trial for plant in task.plant for trial in trials(task._replace(draws=0), plant)]
    return [trial for *point, words in chosen for trial in listed if trial.set_point == tuple(point) and words in trial.name]


def drive(task, gains, trial):
    """Figures of a trial."""
    motion = motions.stop(*trial.set_point, DRIVE, STAND)
    return stops.assess(engine.drive(trial.plant, task.start, motion, {**stops.LIMITS, **gains, **trial.overrides}), *trial.set_point, DRIVE)


def penalty(bars, figures):
    """Penalty [s]: one second for every missed bar, in proportion to its excess, and a small part just below the bar."""
    parts = [(figures[name] / (RESERVE * bar), figures[name] <= bar) for name, bar in bars.items()]
    return sum(part - kept for part, kept in parts if part > 1.0) + (2.0 if figures['settling_s'] is None else 0.0)


def missed_bar(bars, figures):
    """Text of the first missed figure; empty if every bar is kept."""
    words = ['{} {:.4g}, at most {:.4g}'.format(FIGURES[name][0], figures[name], bar) for name, bar in bars.items() if not figures[name] <= bar]
    return 'never settles' if figures['settling_s'] is None else words[0] if words else ''


def assess(task, gains, run=map):
    """Drives every trial; run: as map(). table: a dict of the largest figures for each robot; missed: texts, margins first;
    worst: failed trials, the worst first; settling: the longest of the searched step [s]."""
    found = types.SimpleNamespace(gains=gains, table=[], missed=[], settling=0.0)
    failed = []
    for plant in task.plant:
        robot, certificates = pathlib.Path(plant).stem, [loop.certify() for loop in task.loops(plant, gains)]
        gain_margin, delay_margin = (min(getattr(c, name) for c in certificates) for name in ('gain_margin', 'delay_margin'))
        if not all(c.stable for c in certificates) or gain_margin < task.gain_margin or delay_margin < task.delay_margin:
            found.missed.append(robot + ': margins')
        listed = trials(task, plant)
        driven = list(zip(listed, run(functools.partial(drive, task, gains), listed)))
        for trial, figures in driven:
            words = missed_bar(trial.bars, figures)
            if words:
                found.missed.append(trial.name + ': ' + words)
                failed.append((penalty(trial.bars, figures), trial))
        settling = max(figures['settling_s'] or math.inf for trial, figures in driven if trial.searched())
        found.settling = max(found.settling, settling)
        largest = {words: '{:.3f}'.format(max(figures[name] for _, figures in driven)) for name, (words, _, _) in FIGURES.items()}
        found.table.append({'robot': robot, 'settling s': '{:.2f}'.format(settling), **largest, 'gain margin': '{:.2f}'.format(gain_margin),
                            'delay margin s': '{:.3f}'.format(delay_margin)})
    found.worst = [trial for _, trial in sorted(failed, key=lambda pair: -pair[0])]
    return found


def margin_violation(task, loops):
    """Excess of the largest spectral radius over 1 at the margins, at both ends of the phase; negative if the margins are kept."""
    changes = (task.gain_margin, 0.0), (1.0, task.delay_margin), (1.0, 0.0)
    return max(min(loop.spectral_radius(gain, delay, phase), 1e3) - 1.0 for loop in loops for phase in (loop.longest_phase, 0.0)
               for gain, delay in changes)


def linear_cost(task, gains):
    """The longest settling time to BAND [s] of a step of the linear model, over robots and both ends of the phase. Penalties for margins
    and overshoot are added, and a small part of the error's area, which guides the search where the settling time is flat."""
    worst = 0.0
    for plant in task.plant:
        loop = task.loops(plant, gains)[0]
        violation = margin_violation(task, [loop])
        if violation >= 0.0:
            return UNSTABLE + violation
        for phase in (loop.longest_phase, 0.0):
            response = loop.step_response(int(RESPONSE / loop.period), phase)
            time = loop.period * numpy.arange(len(response))
            found = jackal_aic.step_response(time, response, 0.0, 0.0, 1.0, BAND)
            settled = RESPONSE if found.settling_time is None else found.settling_time
            area = loop.period * float(time @ numpy.abs(response - 1.0))
            worst = max(worst, settled + 0.5 * area + 0.2 * max(0.0, found.overshoot - 0.5 * task.overshoot))
    return worst


def cost(task, gains, judged, give_up=math.inf):
    """The longest settling time [s] of the searched steps and the penalties of all trials; above `give_up` no further one is driven."""
    violation = margin_violation(task, [loop for plant in task.plant for loop in task.loops(plant, gains)])
    if violation >= 0.0:
        return UNSTABLE + violation
    longest, others = 0.0, 0.0
    for trial in judged:
        figures = drive(task, gains, trial)
        settling = (figures['settling_s'] or 0.0) if trial.searched() else 0.0
        longest, others = max(longest, settling), others + 0.05 * settling + penalty(trial.bars, figures)
        if longest + others > give_up:
            break
    return longest + others


class Space:
    """Logarithms of the gains that are searched, as overrides of four digits. The sensory variance of order 0 stays: scaling all
    variances and both learning rates together changes nothing."""

    def __init__(self, task):
        settings, self.orders = engine.settings(task.plant[0], task.start), task.orders
        self.first, rate = settings['controller']['sensory_variances'][0], settings['plant']['sensor_rate']
        # At least 1e-5 of the variance of white noise in an order, C(2 i, i) rate^2i times that of order 0: smaller ones amplify
        # encoder steps into limit cycles.
        noise = [math.factorial(2 * i) / math.factorial(i)**2 * rate**(2 * i) for i in range(1, self.orders + 1)]
        least = [min(max(1e-5 * self.first * times, 1e-3), 1e11) for times in noise]
        bounds = [*RANGES.values()] + (self.orders + 1) * [(1e-4, 1e6)] + [(variance, 1e12) for variance in least]
        self.low, self.high = numpy.log(bounds).T

    def gains(self, logarithms):
        values, states = [float('{:.4g}'.format(value)) for value in numpy.exp(logarithms)], len(RANGES) + self.orders + 1
        return {**{'controller.' + name: value for name, value in zip(RANGES, values)}, 'controller.orders': self.orders,
                'controller.state_variances': values[len(RANGES):states], 'controller.sensory_variances': [self.first] + values[states:]}

    def start(self, task):
        """A precise y' draws mu' towards it and the state dynamics draw mu to mu_d - tau mu', so the integral action gets a proportional
        part tau y. kappa_a is two fifths of the stability limit."""
        start, models = engine.settings(task.plant[0], task.start)['controller'], [task.loops(plant, {})[0].robot for plant in task.plant]
        delay = max(model['dead_time'] + model['lag'] for model in models) + 1.0 / start['action_rate']
        states = [0.01] + (start['state_variances'] + self.orders * start['state_variances'][-1:])[1:self.orders + 1]
        found = numpy.log([0.2 * delay, 10.0, start['kappa_a'], *states, *([10.0] + self.orders * [1e12])[:self.orders]])
        margins = [task.loops(plant, self.gains(found))[0].certify().gain_margin for plant in task.plant]
        found[2] += math.log(0.4 * min([margin for margin in margins if margin > 0.0], default=2.5))
        return found


def searched(task, run=map):
    """What the best gains do, as assess(); run: as map()."""
    space = Space(task)

    def descend(function, start, step, evaluations):
        return search.descend(lambda x: function(space.gains(x)), start, space.low, space.high, step, evaluations)[0]

    found = descend(functools.partial(linear_cost, task), space.start(task), 0.1 * (space.high - space.low), 100 * task.evaluations)
    judged, step, rounds = first_trials(task), 0.15, []
    for _ in range(ROUNDS):
        limit = math.inf

        def evaluate(gains):
            nonlocal limit
            value = cost(task, gains, judged, limit)
            limit = min(limit, value)
            return value

        found = descend(evaluate, found, step, task.evaluations)
        rounds.append(assess(task, space.gains(found), run))
        judged, step = judged + rounds[-1].worst[:JOINING], 0.5 * step
    return min(rounds, key=lambda assessed: (len(assessed.missed), assessed.settling))
