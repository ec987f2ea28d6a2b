"""Published controllers of a plant with dead time, compared with `predictive`; all tuned by the same search under the same margins.

Each wheel has a regulator around a path that its motors can follow. The command of the path is fed forward; the
regulator corrects the deviation e of the measured speed from the predicted one [rad/s]. So a step on a robot that
equals its model is the same for all of them, and they differ in their response to disturbances.
"""

import collections
import math
import typing

import jackal_aic
import numpy
import scipy.linalg
import yaml

import engine
import kalman
import search
from linear import PERIOD, TICKS, Flow, delay, figures as linear_figures, shifted

MS, GAIN_MARGIN, DELAY_MARGIN = 1.6, 2.0, 0.05  # what every structure keeps: peak of the sensitivity, margins [-, s]
LONGER = 1.5  # dead time of the robot / of the model
UNSTABLE, EVALUATIONS, STEPS = 5.0, 150, (0.5, 0.2, 0.1)
COLUMNS = ('structure', 'plant', 'ms_limit', 'kept', 'ms', 'gain_margin', 'delay_margin_s', 'iae_of_bound', 'noise_gain',
           'ms_longer_dead_time', 'values')


# ---- regulators: a deviation e of the speed in, a command v out [rad/s]

class Pid:
    """v = -(k_p e + k_i int e dt + k_d de/dt)."""

    def __init__(self, proportional, integral, derivative=0.0):
        self.gains = proportional, integral, derivative
        self.integral = self.last = 0.0

    def act(self, e):
        p, i, d = self.gains
        self.integral += PERIOD * e
        rate, self.last = (e - self.last) / PERIOD, e
        return -(p * e + i * self.integral + d * rate)


def simc(model, radius, tau_c):
    """PI by the rules of Skogestad (SIMC, 2003)."""
    delay = model['dead_time'] + 0.5 * PERIOD  # with that of the hold
    lag = max(model['lag'], 0.05 * PERIOD)
    gain, integral = lag / (model['gain'] * (tau_c + delay)), min(lag, 4.0 * (tau_c + delay))
    return Pid(gain, gain / integral)


class SmithPredictor:
    """PI with the predictor of Smith (1957): it acts on the predicted deviation, assuming no further disturbance."""

    def __init__(self, model, radius, proportional, integral):
        self.pi = Pid(proportional, integral)
        self.delayed, self.prompt = Flow(model, radius, TICKS, delay(model)), Flow(model, radius, TICKS, 0)
        self.commands = numpy.zeros(len(self.delayed.inputs))
        self.late, self.early = numpy.zeros((2, 3))

    def act(self, e):
        v = self.pi.act(e - self.late[0] + self.early[0])
        self.late = self.delayed(self.late, shifted(self.commands, v))
        self.early = self.prompt(self.early, self.commands[:1])
        return v


class Lqg:
    """LQG for a plant with dead time: v = -(d + K (w, z)(t + dead time)) / gain, with the predicted state at the time
    when the present command begins to act."""

    def __init__(self, model, radius, speed_noise, disturbance_noise, command_weight, measurement_variance=9e-4):
        ticks = delay(model)
        self.gain = model['gain']
        self.next, self.arrival = Flow(model, radius, TICKS, ticks), Flow(model, radius, ticks, ticks)
        step, command, _ = kalman.drive_train(model, radius)
        transition, process = kalman.over_ticks(step, kalman.TICK * numpy.array([speed_noise, 0.0, disturbance_noise]), TICKS)
        output = numpy.array([[1.0, 0.0, 0.0]])
        self.filter = kalman.stationary_gain(transition, process, output, numpy.array([[measurement_variance]]))[:, 0]
        prompt = Flow(model, radius, TICKS, 0)
        a, b = prompt.transition[:2, :2], prompt.inputs[0][:2, None] / self.gain
        if model['velocity_loop_integral'] <= 0.0:
            a, b = a[:1, :1], b[:1]
        weights = numpy.diag([1.0, 0.0][:len(a)])
        p = scipy.linalg.solve_discrete_are(a, b, weights, numpy.array([[command_weight]]))
        feedback = (b.T @ p @ a) / (command_weight + b.T @ p @ b)
        self.feedback = numpy.array(feedback[0].tolist() + [0.0] * (2 - len(a)) + [1.0])
        self.state, self.commands = numpy.zeros(3), numpy.zeros(len(self.next.inputs))

    def act(self, e):
        self.state = self.state + self.filter * (e - self.state[0])
        underway = numpy.append(0.0, self.commands)[:len(self.arrival.inputs)]  # without the present command
        v = -(self.feedback @ self.arrival(self.state, underway)) / self.gain
        self.state = self.next(self.state, shifted(self.commands, v))
        return v


class ActiveInference:
    """The controller of Pezzato, Ferrari and Hernandez Corbato (2020): beliefs of speed, acceleration and jerk descend the free energy,
    and the action descends it through the speed and its change, summed over both orders:

        F = 1/2 (e_y^2 + s e_y'^2 + e_mu^2 + e_mu'^2),   e_y = y - mu, e_y' = y' - mu', e_mu = mu' + mu/tau, e_mu' = mu'' + mu'/tau
        d mu/dt = D mu - kappa_mu dF/d mu,   dv/dt = -kappa_a (e_y + s e_y').

    s: precision of the change / precision of the speed; the goal is zero deviation.
    """

    TAU, KAPPA_MU = 0.1, 20.0  # s, 1/s

    def __init__(self, model, radius, kappa_a, change_precision):
        self.kappa_a, self.s = kappa_a, change_precision
        k, r = self.KAPPA_MU, 1.0 / self.TAU
        flow = numpy.array([[-k * (1.0 + r * r), 1.0 - k * r, 0.0], [-k * r, -k * (self.s + 1.0 + r * r), 1.0 - k * r],
                            [0.0, -k * r, -k]])
        sensed = numpy.array([[k, 0.0], [0.0, k * self.s], [0.0, 0.0]])
        whole = scipy.linalg.expm(PERIOD * numpy.block([[flow, sensed], [numpy.zeros((2, 5))]]))
        self.transition, self.sensed = whole[:3, :3], whole[:3, 3:]
        self.belief, self.v, self.last = numpy.zeros(3), 0.0, 0.0

    def act(self, e):
        y = numpy.array([e, (e - self.last) / PERIOD])
        self.last = e
        self.belief = self.transition @ self.belief + self.sensed @ y
        self.v -= PERIOD * self.kappa_a * ((y[0] - self.belief[0]) + self.s * (y[1] - self.belief[1]))
        return float(self.v)


class UnbiasedActiveInference:
    """Unbiased active inference (Baioumy, Pezzato, Ferrari and Hawes 2022): the goal is a density of the action and not
    of the state, p(v | mu): a PI law of the belief. So the belief is only a filter of the measurement:

        mu <- mu + share (y - mu),   v = -(k_p mu + k_i int mu dt).
    """

    def __init__(self, model, radius, share, proportional, integral):
        self.share, self.pi, self.belief = share, Pid(proportional, integral), 0.0

    def act(self, e):
        self.belief += self.share * (e - self.belief)
        return self.pi.act(self.belief)


# ---- a controller of both wheels

class PathWheel:
    """A wheel on a path that its motors can follow, and a regulator around it."""

    SETTLED = 1e-9  # rad/s

    def __init__(self, model, radius, regulator):
        self.gain, self.regulator, self.delay = model['gain'], regulator, delay(model)
        step, command, self.limit = kalman.drive_train(model, radius)
        self.step, self.input = step.tolist(), command.tolist()
        prompt = Flow(model, radius, TICKS, 0)
        self.over_period, self.by_command = prompt.transition[0].tolist(), float(prompt.inputs[0, 0])
        self.w = self.z = self.forward = 0.0  # on the path, without the dead time
        self.path = collections.deque([0.0] * (self.delay + 1), self.delay + 1)  # w, tick by tick

    def act(self, wanted, measured):
        v = self.regulator.act(measured - self.path[0])
        if abs(self.path[0] - wanted) < self.SETTLED and abs(self.w - wanted) < self.SETTLED:
            return self.forward + v
        largest = TICKS * self.limit
        goal = self.w + min(largest, max(-largest, wanted - self.w))
        self.forward = (goal - self.over_period[0] * self.w - self.over_period[1] * self.z) / self.by_command
        self.advance()
        return self.forward + v

    def advance(self):
        """Advances along the path by a period."""
        (a, b, _), (c, d, _), _ = self.step
        for _ in range(TICKS):
            change = a * self.w + b * self.z + self.input[0] * self.forward - self.w
            if abs(change) > self.limit:
                self.w += math.copysign(self.limit, change)
            else:
                self.w, self.z = self.w + change, c * self.w + d * self.z + self.input[1] * self.forward
            self.path.append(self.w)


class Baseline(jackal_aic.VelocityController):
    """A regulator for each wheel; make() makes one."""

    def __init__(self, plant, make):
        values = engine.settings(plant, 'predictive')
        self.model, geometry = values['plant_model'], values['geometry']
        self.radius, self.make = geometry['wheel_radius'], make
        self.kinematics = jackal_aic.Kinematics(geometry['wheel_radius'], geometry['effective_track'], geometry['slip_factor'])

    def reset(self):
        self.wheels = [PathWheel(self.model, self.radius, self.make(self.model, self.radius)) for _ in range(2)]

    def act(self, set_point, observation):
        wanted = self.kinematics.wheel_speeds(set_point.forward, set_point.yaw_rate)
        measured = observation.wheel_left, observation.wheel_right
        return [wheel.act(*speeds) for wheel, *speeds in zip(self.wheels, wanted, measured)]


# ---- tuning

class Tunable(typing.NamedTuple):
    name: str
    start: float
    low: float
    high: float


class Structure(typing.NamedTuple):
    """Tuned parameters, and regulator(model, radius, *values); None: `predictive` with these keys."""

    tuned: tuple
    regulator: typing.Any = None


_SPEED, _DISTURBANCE = Tunable('speed_process_noise', 0.01, 1e-4, 10.0), Tunable('disturbance_process_noise', 0.01, 1e-5, 100.0)
STRUCTURES = {
    'simc_pi': Structure((Tunable('tau_c', 0.1, 1e-3, 2.0),), simc),
    'pid': Structure((Tunable('proportional', 0.1, 1e-3, 10.0), Tunable('integral', 3.0, 1e-2, 100.0),
                      Tunable('derivative', 1e-3, 1e-5, 0.3)), lambda model, radius, *gains: Pid(*gains)),
    'smith_pi': Structure((Tunable('proportional', 0.3, 1e-3, 10.0), Tunable('integral', 5.0, 1e-2, 200.0)), SmithPredictor),
    'lqg': Structure((_SPEED, _DISTURBANCE, Tunable('command_weight', 1.0, 1e-3, 1e4)), Lqg),
    'active_inference': Structure((Tunable('kappa_a', 1.0, 1e-2, 100.0), Tunable('change_precision', 0.01, 1e-5, 1.0)), ActiveInference),
    'unbiased_active_inference': Structure((Tunable('share', 0.5, 0.02, 1.0), Tunable('proportional', 0.1, 1e-3, 10.0),
                                            Tunable('integral', 3.0, 1e-2, 100.0)), UnbiasedActiveInference),
    'predictive': Structure((Tunable('speed_process_noise', 0.01, 1e-4, 1.0), _DISTURBANCE,
                             Tunable('action_learning_rate', 0.7, 0.05, 1.0))),
    'predictive_preset': Structure(()),
}


def controller(name, plant, values):
    """A controller of a structure with these values, as linear.figures() and simulate() take it."""
    structure = STRUCTURES[name]
    if structure.regulator is None:
        return {'predictive.' + tunable.name: value for tunable, value in zip(structure.tuned, values)}
    return Baseline(plant, lambda model, radius: structure.regulator(model, radius, *values))


def figures(name, plant, values, dead_time_factor=1.0):
    return linear_figures(plant, controller(name, plant, [float(value) for value in values]), dead_time_factor)


def excess(found):
    """Logarithms of Ms, gain and delay margin over their bars; negative if the bar is kept."""
    if not found['stable']:
        return [UNSTABLE] * 3
    ratios = found['peak_sensitivity'] / MS, GAIN_MARGIN / found['gain_margin'], DELAY_MARGIN / found['delay_margin']
    return [min(UNSTABLE, max(-UNSTABLE, math.log(ratio))) if ratio > 0.0 else -UNSTABLE for ratio in ratios]


def cost(name, plant, values):
    """Logarithm of the IAE, and a penalty for what is beyond the bounds."""
    found = figures(name, plant, values)
    beyond = sum(max(0.0, value + 1e-3) for value in excess(found))
    return (min(UNSTABLE, math.log(found['iae'])) if found['stable'] else UNSTABLE) + 1e3 * beyond


def tune(name, plant, start, steps=STEPS, evaluations=EVALUATIONS):
    """Values of a structure with the least IAE within the bounds, searched from a start."""
    tuned = STRUCTURES[name].tuned
    if not tuned:
        return []
    best = numpy.log(start)
    low, high = (numpy.log([getattr(tunable, end) for tunable in tuned]) for end in ('low', 'high'))
    for step in steps:  # restarts at the best, because a simplex becomes flat along a bound
        best, _ = search.descend(lambda x: cost(name, plant, numpy.exp(x)), best, low, high, step, evaluations, 1e-3)
    return numpy.exp(best).tolist()


def searched(item):
    """Values of a structure on a plant by the whole search."""
    return tune(*item, [tunable.start for tunable in STRUCTURES[item[0]].tuned])


def kept(name, plant):
    """Values that the search found once."""
    found = engine.read_yaml('sim/lab/baselines.yaml')[plant].get(name, {})
    return [found[tunable.name] for tunable in STRUCTURES[name].tuned]


def row(item):
    """A row of the table: a structure on a plant with its tuned values."""
    name, plant, values = item
    found = figures(name, plant, values)
    return {'structure': name, 'plant': plant, 'ms_limit': MS, 'kept': int(max(excess(found)) <= 0.0), 'ms': found['peak_sensitivity'],
            'gain_margin': found['gain_margin'], 'delay_margin_s': found['delay_margin'],
            'iae_of_bound': found['iae'] / found['least_iae'], 'noise_gain': found['noise'],
            'ms_longer_dead_time': figures(name, plant, values, LONGER)['peak_sensitivity'],
            'values': ' '.join('{}={:.3g}'.format(t.name, v) for t, v in zip(STRUCTURES[name].tuned, values))}


def gains_text(items, values):
    """The text of sim/lab/baselines.yaml."""
    found = {plant: {} for plant in engine.PLANTS}
    for (name, plant), gains in zip(items, values):
        if gains:
            found[plant][name] = {tunable.name: float('{:.6g}'.format(gain)) for tunable, gain in zip(STRUCTURES[name].tuned, gains)}
    head = '# Gains of the structures of baselines.py on each plant, as `experiments baselines --search --out DIR` finds them.\n'
    return head + yaml.safe_dump(found, sort_keys=False, default_flow_style=None, width=120)


def write(out, search_gains=False, jobs=0):
    """search_gains: by the whole search, and writes them, too; else those that are kept."""
    out, items = engine.directory(out), [(name, plant) for plant in engine.PLANTS for name in STRUCTURES]
    if search_gains:
        values = engine.parallel(searched, items, jobs, 'tuning')
        engine.write(out / 'baselines.yaml', gains_text(items, values))
    else:
        values = [kept(*item) for item in items]
    rows = engine.parallel(row, [(*item, found) for item, found in zip(items, values)], jobs, 'baselines')
    engine.save(out, 'baselines.csv', rows, COLUMNS)
