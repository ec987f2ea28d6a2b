"""Searches gains that settle fastest on simulated robots, keep their margins, and pass all trials.

A trial drives from rest to a set point and back: nominal robots, robots that differ from their model, coarse encoders and late
samples. For the thesis' structure tau, kappa_mu, kappa_a and the variances of all orders are searched (Nelder and Mead), first on the
linear models, then on the simulated robots in rounds; the worst failed trials of a round join the next. For the predictive structure
the gains of PREDICTIVE are searched on the simulated robots. Scales are logarithmic; the same task gives the same gains.
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
LIMITS = {'limits.linear_acceleration': 20.0, 'limits.angular_acceleration': 25.0}  # of the robot, which the thesis' runs do not have
# Figures (stops.assess()): bars of the robot as it is and of another one, heading of the table, and what is said of a missed bar.
FIGURES = {'overshoot_pct': (None, None, 'overshoot %', 'overshoots by {:.4g} % (at most {:.4g})'),
           'beyond_mps': (0.03, 0.10, 'runs back m/s', 'runs back with {:.4g} m/s after the stop'),
           'beyond_radps': (0.05, 0.15, 'back rad/s', 'turns back with {:.4g} rad/s after the stop'),
           'ripple': (0.1, 0.1, 'ripple rad/s', 'its command ripples by {:.4g} rad/s')}
HEADINGS = ['robot', 'settling s'] + [heading for _, _, heading, _ in FIGURES.values()] + ['gain margin', 'delay margin s', 'missed']

# Set points (speed, yaw rate); robots that differ from their model (dead time + s, lag, gain, acceleration limit x); encoders; largest
# delay of a sample [s].
SET_POINTS = ((0.1, 0.0), (0.3, 0.0), (0.5, 0.0), (1.0, 0.0), (1.5, 0.0), (2.0, 0.0), (0.0, 0.5), (0.0, 2.0), (0.5, 0.5), (1.0, 2.0))
SPREAD = {'dead time + 10 ms': (0.01, 1.0, 1.0, 1.0), 'dead time - 10 ms': (-0.01, 1.0, 1.0, 1.0), 'lag x 1.4': (0.0, 1.4, 1.0, 1.0),
          'lag x 0.7': (0.0, 0.7, 1.0, 1.0), 'gain x 1.05': (0.0, 1.0, 1.05, 1.0), 'gain x 0.95': (0.0, 1.0, 0.95, 1.0),
          'limit x 0.5': (0.0, 1.0, 1.0, 0.5), 'limit x 2': (0.0, 1.0, 1.0, 2.0)}
STEPS, NOISE, LATEST = (0.0065, 0.06, 0.1), (0.0, 0.003, 0.03), 0.010

SEED = 1  # of the random trials
ROUNDS, JOINING = 4, 3  # of the local search, and trials that join after each
UNSTABLE = 100.0  # s, the cost of gains without their margins; above every other
RESPONSE, BAND = 2.5, 0.035  # s of a linear response, and its band: narrower than the 5 % of the settling time
STABLE = 1.0 - 1e-12  # a spectral radius below is stable
PREDICTIVE = {'action_learning_rate': (0.1, 1.0), 'reference_time': (1e-3, 1.0), 'speed_process_noise': (1e-4, 10.0),
              'disturbance_process_noise': (1e-4, 10.0), 'yaw_process_noise': (1e-6, 0.1), 'dead_time_deviation': (1e-3, 0.1),
              'yaw_delay_deviation': (0.01, 0.5)}
THESIS = {'tau': (1e-4, 1.0), 'kappa_mu': (1e-3, 1e3), 'kappa_a': (0.3, 300.0)}


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

    def settings(self, plant=None):
        return engine.settings(plant or self.plant[0], self.start)

    def predictive(self):
        return self.settings()['structure'] == 'predictive'

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


# ---- what is driven

def varied(plant, dead_time=0.0, lag=1.0, gain=1.0, limit=1.0, offset=0.0):
    return {'plant.dead_time': max(0.0, plant['dead_time'] + dead_time), 'plant.motor_lag': plant['motor_lag'] * lag,
            'plant.wheel_gain': plant['wheel_gain'] * gain, 'plant.wheel_offset': max(0.0, plant['wheel_offset'] + offset),
            'plant.acceleration_limit': plant['acceleration_limit'] * limit}


def confidence_box(task, plant):
    """The corners of the confidence box of a robot's model, as SPREAD, with the change of the motors' offset."""
    model, *corners = (loop.robot for loop in task.loops(plant, {}))
    found = {}
    for corner in corners:
        lag, gain = (corner[key] / model[key] if model[key] > 0.0 else 1.0 for key in ('lag', 'gain'))
        found['dead time {dead_time:.3g} s, lag {lag:.3g} s, gain {gain:.3g}, offset {offset:.3g} rad/s'.format(**corner)] = (
            corner['dead_time'] - model['dead_time'], lag, gain, 1.0, corner['offset'] / corner['gain'] - model['offset'] / model['gain'])
    return {name: corner for name, corner in found.items() if corner != (0.0, 1.0, 1.0, 1.0, 0.0)}


def trials(task, plant):
    """Every trial of a robot. Nominal over the phase of the timers; coarse encoders with late samples; its spread and the corners of
    its confidence box at the worst end of the phase; random ones."""
    robot, found = task.settings(plant)['plant'], []
    latest = 1.0 / robot['sensor_rate'] - motions.TICK

    def add(set_point, words, overrides, phase=latest, nominal=False, unseen=0.0):
        bars = {figure: bar[0 if nominal else 1] for figure, bar in FIGURES.items()}
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
    for name, variant in {**SPREAD, **confidence_box(task, plant)}.items():
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
    chosen = (((SPEED, 0.0), 'phase 0.0'), ((SPEED, 0.0), 'phase 0 '), ((0.0, 2.0), 'phase 0.0'), ((1.0, 0.0), 'lag x 1.4'), ((0.3, 0.7), 'of 0.06'))
    listed = [trials(task._replace(draws=0), plant) for plant in task.plant]
    return [next(trial for trial in of_robot if trial.set_point == point and words in trial.name) for point, words in chosen for of_robot in listed]


def drive(task, gains, trial):
    """Figures of a trial. `predictive` learns the slip of an arc in a first drive, and is assessed in the second."""
    motion = motions.stop(*trial.set_point, DRIVE, STAND)
    begin = motion.duration if task.predictive() and all(trial.set_point) else 0.0
    again = tuple((begin + time, *point) for time, *point in motion.set_points) if begin else ()
    motion = motion._replace(set_points=motion.set_points + again, duration=motion.duration + begin)
    found = engine.drive(trial.plant, task.start, motion, {**LIMITS, **gains, **trial.overrides})
    columns = {name: column[found.time >= begin] for name, column in found.columns().items()}
    return stops.assess(types.SimpleNamespace(**dict(columns, time=columns['time'] - begin)), *trial.set_point, DRIVE)


# ---- what gains are worth

def penalty(bars, figures):
    """Penalty [s]: one second for every missed bar, in proportion to its excess, and a small part just below the bar."""
    parts = [(figures[name] / (RESERVE * bar), figures[name] <= bar) for name, bar in bars.items()]
    return sum(part - kept for part, kept in parts if part > 1.0) + (2.0 if figures['settling_s'] is None else 0.0)


def missed_bar(bars, figures):
    """Text of the first missed figure; empty if every bar is kept."""
    words = [FIGURES[name][-1].format(figures[name], bar) for name, bar in bars.items() if not figures[name] <= bar]
    return 'never settles' if figures['settling_s'] is None else words[0] if words else ''


def assess(task, gains, run=map):
    """Drives every trial; run: as map(). gains; rows: of a table (HEADINGS), figures of the robot as it is / otherwise; missed: texts,
    margins first; worst: failed trials, the worst first; settling: the longest of the searched step [s]."""
    missed, worst, rows, longest = [], [], [], 0.0
    for plant in task.plant:
        certificates = [loop.certify() for loop in task.loops(plant, gains)]
        margins = [min(getattr(certificate, name) for certificate in certificates) for name in ('gain_margin', 'delay_margin')]
        kept = all(certificate.stable for certificate in certificates) and margins[0] >= task.gain_margin and margins[1] >= task.delay_margin
        listed, failed = trials(task, plant), [] if kept else [pathlib.Path(plant).stem + ': margins']
        driven = list(zip(listed, run(functools.partial(drive, task, gains), listed)))
        for trial, figures in driven:
            words = missed_bar(trial.bars, figures)
            failed += [trial.name + ': ' + words] if words else []
            worst += [(penalty(trial.bars, figures), trial)] if words else []
        settling = [math.inf if f['settling_s'] is None else f['settling_s'] for trial, f in driven if trial.searched()]
        cells = [' / '.join('{:.{}f}'.format(max(f[name] for trial, f in driven if trial.nominal == nominal), 1 if name == 'overshoot_pct' else 3)
                            for nominal in (True, False)) for name in FIGURES]
        rows.append([pathlib.Path(plant).stem, '{:.2f}..{:.2f}'.format(min(settling), max(settling)), *cells, '{:.2f}'.format(margins[0]),
                     '{:.3f}'.format(margins[1]), str(len(failed) or '')])
        longest = max(longest, *settling)
        missed += failed
    return types.SimpleNamespace(gains=gains, rows=rows, missed=missed, settling=longest,
                                 worst=[trial for _, trial in sorted(worst, key=lambda pair: -pair[0])])


def margin_violation(task, loops):
    """Excess of a spectral radius over the margins' bound, at both ends of the phase; negative if the margins are kept."""
    worst = -1.0
    for loop in loops:
        for phase in (loop.longest_phase, 0.0):
            for gain, delay in ((task.gain_margin, 0.0), (1.0, task.delay_margin), (1.0, 0.0)):
                worst = max(worst, min(loop.spectral_radius(gain, delay, phase), 1e3) - STABLE)
                if worst >= 0.0:
                    return worst
    return worst


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
            error, time = numpy.abs(response - 1.0), loop.period * numpy.arange(len(response))
            k = numpy.flatnonzero(error > BAND)[-1:]  # the last sample outside, and from there to where the error crosses the band
            part = (error[k] - BAND) / numpy.maximum(error[k] - error[numpy.minimum(k + 1, len(error) - 1)], error[k] - BAND + 1e-9)
            settled = float(numpy.sum(loop.period * (k + 1 + part)))
            overshoot = float(numpy.max(response)) - 1.0 - 0.005 * task.overshoot
            worst = max(worst, settled + 0.5 * loop.period * float(time @ error) + 20.0 * max(0.0, overshoot))
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


# ---- the search

class Space:
    """Logarithms of the gains that are searched, as overrides of four digits. The sensory variance of order 0 stays: scaling all
    variances and both learning rates together changes nothing."""

    def __init__(self, task):
        start, rate, orders = task.settings()['controller'], task.settings()['plant']['sensor_rate'], task.orders
        if task.predictive():
            self.start, bounds = {'predictive.' + name: start[name] for name in PREDICTIVE}, PREDICTIVE.values()
            self.places = [(key, None) for key in self.start]
        else:
            # At least 1e-5 of the variance of white noise in an order, C(2 i, i) rate^2i times that of order 0: smaller ones amplify
            # encoder steps into limit cycles.
            noise = [math.factorial(2 * i) / math.factorial(i)**2 * rate**(2 * i) for i in range(1, orders + 1)]
            least = [min(max(1e-5 * start['sensory_variances'][0] * times, 1e-3), 1e11) for times in noise]
            bounds = [*THESIS.values()] + (orders + 1) * [(1e-4, 1e6)] + [(variance, 1e12) for variance in least]
            self.places = [('controller.' + name, None) for name in THESIS] + [('controller.state_variances', i) for i in range(orders + 1)]
            self.places += [('controller.sensory_variances', i) for i in range(1, orders + 1)]
            self.start = self._damped(task, start, orders)
        self.low, self.high = numpy.log(list(bounds)).T

    @staticmethod
    def _damped(task, start, orders):
        """Initial gains. A precise y' draws mu' towards it and the state dynamics draw mu to mu_d - tau mu', so the integral action gets
        a proportional part tau y. kappa_a is two fifths of the stability limit."""
        models = [task.loops(plant, {})[0].robot for plant in task.plant]
        delay = max(model['dead_time'] + model['lag'] for model in models) + 1.0 / start['action_rate']
        states = start['state_variances'] + orders * start['state_variances'][-1:]
        gains = {'controller.orders': orders, 'controller.tau': 0.2 * delay, 'controller.kappa_mu': 10.0, 'controller.kappa_a': start['kappa_a'],
                 'controller.state_variances': [0.01] + states[1:orders + 1],
                 'controller.sensory_variances': (start['sensory_variances'][:1] + [10.0] + orders * [1e12])[:orders + 1]}
        margins = [task.loops(plant, gains)[0].certify().gain_margin for plant in task.plant]
        gains['controller.kappa_a'] *= 0.4 * min([margin for margin in margins if margin > 0.0], default=2.5)
        return gains

    def gains(self, logarithms):
        found = {key: list(value) if isinstance(value, list) else value for key, value in self.start.items()}
        for (key, i), x in zip(self.places, logarithms):
            value = float('{:.4g}'.format(math.exp(x)))
            if i is None:
                found[key] = value
            else:
                found[key][i] = value
        return found

    def vector(self, gains):
        return numpy.clip(numpy.log([gains[key] if i is None else gains[key][i] for key, i in self.places]), self.low, self.high)


def linear_search(task, space):
    """Gains of least linear_cost()."""
    return space.gains(search.descend(lambda x: linear_cost(task, space.gains(x)), space.vector(space.start), space.low, space.high,
                                      0.1 * (space.high - space.low), 100 * task.evaluations)[0])


def searched(task, run=map):
    """What the best gains do, as assess(); run: as map()."""
    space = Space(task)
    gains = space.start if task.predictive() else linear_search(task, space)
    judged, step, best = first_trials(task), math.log(2.0) if task.predictive() else 0.15, None
    for _ in range(ROUNDS):
        limit = math.inf

        def evaluate(x):
            nonlocal limit
            found = cost(task, space.gains(x), judged, limit)
            limit = min(limit, found)
            return found

        gains = space.gains(search.descend(evaluate, space.vector(gains), space.low, space.high, step, task.evaluations)[0])
        found = assess(task, gains, run)
        if best is None or (len(found.missed), found.settling) < (len(best.missed), best.settling):
            best = found
        judged, step = judged + found.worst[:JOINING], 0.5 * step
    return best
