"""Searches gains that settle fastest on simulated robots, keep their margins, and pass all trials (trials.py).

For the thesis' structure it searches tau, kappa_mu, kappa_a and the variances of all orders, for each number of orders.
It starts on the linear models in the whole space (differential evolution) and continues on the simulated robots (Nelder
and Mead) in rounds. The worst failed trials of a round join the trials of the next one. For the predictive structure it
searches the gains of PREDICTIVE on the simulated robots. Scales are logarithmic; the same task gives the same gains.
"""

import math

import numpy
import scipy.optimize

import engine
import search
from trials import assess, drive, first_trials, loops_of, penalty

ROUNDS, JOINING = 4, 3  # of the local search, and trials that join after each
UNSTABLE = 100.0  # s, the cost of gains without their margins; above every other
RESPONSE, BAND = 2.5, 0.035  # s of a linear response, and its band: narrower than the 5 % of the settling time
STABLE = 1.0 - 1e-12  # a spectral radius below is stable
PREDICTIVE = {'action_learning_rate': (0.1, 1.0), 'reference_time': (1e-3, 1.0), 'speed_process_noise': (1e-4, 10.0),
              'disturbance_process_noise': (1e-4, 10.0), 'yaw_process_noise': (1e-6, 0.1), 'dead_time_deviation': (1e-3, 0.1),
              'yaw_delay_deviation': (0.01, 0.5)}
THESIS = {'tau': (1e-4, 1.0), 'kappa_mu': (1e-3, 1e3), 'kappa_a': (0.3, 300.0)}


def margin_violation(task, loops):
    """Excess of a spectral radius over the margins' bound, at both ends of the phase; negative if the margins are
    kept."""
    worst = -1.0
    for loop in loops:
        for phase in (loop.longest_phase, 0.0):
            for gain, delay in ((task.gain_margin, 0.0), (1.0, task.delay_margin), (1.0, 0.0)):
                worst = max(worst, min(loop.spectral_radius(gain, delay, phase), 1e3) - STABLE)
                if worst >= 0.0:
                    return worst
    return worst


def linear_cost(task, gains):
    """The longest settling time to BAND [s] of a step of the linear model, over robots and both ends of the phase.
    Penalties for margins and overshoot are added, and a small part of the error's area, which guides the search where
    the settling time is flat."""
    worst = 0.0
    for robot in task.robots:
        loop = loops_of(task, robot, gains)[0]
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
    violation = margin_violation(task, [loop for robot in task.robots for loop in loops_of(task, robot, gains)])
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
    """Logarithms of the gains that are searched, as overrides of four digits. orders: of the thesis' structure; None: the predictive
    one. The sensory variance of order 0 stays: scaling all variances and both learning rates together changes nothing."""

    def __init__(self, task, orders):
        start, rate = task.gains(), task.robots[0].values['sensor_rate']
        if orders is None:
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
        """Initial gains. A precise y' draws mu' towards it and the state dynamics draw mu to mu_d - tau mu', so the
        integral action gets a proportional part tau y. kappa_a is two fifths of the stability limit."""
        models = [loops_of(task, robot, {})[0].robot for robot in task.robots]
        delay = max(model['dead_time'] + model['lag'] for model in models) + 1.0 / start['action_rate']
        states = start['state_variances'] + orders * start['state_variances'][-1:]
        gains = {'controller.orders': orders, 'controller.tau': 0.2 * delay, 'controller.kappa_mu': 10.0, 'controller.kappa_a': start['kappa_a'],
                 'controller.state_variances': [0.01] + states[1:orders + 1],
                 'controller.sensory_variances': (start['sensory_variances'][:1] + [10.0] + orders * [1e12])[:orders + 1]}
        margins = [loops_of(task, robot, gains)[0].certify().gain_margin for robot in task.robots]
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

    def evaluate(x):
        return linear_cost(task, space.gains(x))

    population, evaluations = 6 * len(space.low), task.linear_evaluations
    start = numpy.random.RandomState(task.seed).uniform(space.low, space.high, (population, len(space.low)))
    start[0] = space.vector(space.start)
    found = scipy.optimize.differential_evolution(evaluate, list(zip(space.low, space.high)), init=start, seed=task.seed, polish=False, tol=0.0,
                                                  maxiter=max(1, evaluations // population - 1))
    best = [search.descend(evaluate, x, space.low, space.high, 0.1 * (space.high - space.low), evaluations // 4) for x in (start[0], found.x)]
    return space.gains(min(best, key=lambda pair: pair[1])[0])


def local_search(task, gains, space):
    """What the best gains on the simulated robots do, set out from some."""
    judged, step, best = first_trials(task), math.log(2.0) if task.predictive() else 0.15, None
    for _ in range(ROUNDS):
        limit = math.inf

        def evaluate(x):
            nonlocal limit
            found = cost(task, space.gains(x), judged, limit)
            limit = min(limit, found)
            return found

        gains = space.gains(search.descend(evaluate, space.vector(gains), space.low, space.high, step, task.evaluations)[0])
        found = assess(task, gains)
        if best is None or (len(found.missed), found.settling()) < (len(best.missed), best.settling()):
            best = found
        judged, step = judged + list(found.worst[:JOINING]), 0.5 * step
    return best


def _run(work):
    task, orders, searches = work
    if not searches:
        return assess(task, {})
    space = Space(task, orders)
    return local_search(task, space.start if orders is None else linear_search(task, space), space)


def searched(task, jobs=0):
    """Assessments by name: of the start, and of what each search finds. jobs: processes; 0 takes all cores."""
    orders = [None] if task.predictive() else list(range(task.orders[0], task.orders[1] + 1))
    *found, start = engine.parallel(_run, [(task, order, True) for order in reversed(orders)] + [(task, None, False)], jobs, 'Searching')
    names = ['predictive' if order is None else 'orders {}'.format(order) for order in orders]
    return dict([('start', start)] + list(zip(names, reversed(found))))
