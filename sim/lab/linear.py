"""Robustness and performance of a controller of 50 Hz on a linear drive train, measured by driving it.

Samples and actions are 20 ms apart. From one sample to the next the loop is linear and time-invariant: the answer y to an impulse on one
sample has the sensitivity S = 1 / (1 + L) as its transform, which gives the loop L.
"""

import functools
import math

import jackal_aic
import numpy
import scipy.signal

import engine
import kalman

PERIOD, TICKS = 0.02, 20  # s, and ticks of the simulation, between actions
WARM_UP, PERIODS, TAIL = 150, 400, 50  # periods until belief and path are steady, of an answer, and at its end, where it has faded
SPEED, IMPULSE, ROUNDING = 0.5, 1e-3, 1e-9  # m/s; rad/s, far below every limit; rad/s
FADING = 0.9  # of a second in the middle of an answer, at its end
MOMENT = 10  # ticks from a sample to a disturbance of the motors
FREQUENCIES = numpy.geomspace(0.5, math.pi / PERIOD, 301)  # rad/s, up to half the rate of the samples
TRANSFORM = numpy.exp(-1j * PERIOD * numpy.outer(FREQUENCIES, numpy.arange(PERIODS)))
UNLIMITED = 1000.0  # m/s^2, no limit in a linear drive


class Flow:
    """x = (w, z, d) of a drive train with dead time over some ticks, given commands that change once a period.

    x <- transition x + sum of inputs[n] v_n, with v_0 the command that is issued at the beginning and v_n that of n periods before.
    """

    def __init__(self, model, radius, ticks, delay):
        step, command, _ = kalman.drive_train(model, radius)
        powers = [numpy.eye(3)]
        for _ in range(ticks):
            powers.append(step @ powers[-1])
        self.transition, self.inputs = powers[ticks], numpy.zeros(((delay + TICKS - 1) // TICKS + 1, 3))
        for i in range(ticks):
            self.inputs[max(0, (delay - i + TICKS - 1) // TICKS)] += powers[ticks - 1 - i] @ command

    def __call__(self, state, commands):
        """state: shape (3,) or (wheels, 3). commands: the newest first, shape (periods,) or (wheels, periods)."""
        return state @ self.transition.T + commands @ self.inputs


def shifted(commands, newest):
    """Commands, of a wheel or of each, after another period."""
    commands[..., 1:] = commands[..., :-1]
    commands[..., 0] = newest
    return commands


def delay(model):
    """Dead time in ticks."""
    return int(round(model['dead_time'] / kalman.TICK))


def _answers(act, model, values):
    """Samples and commands per period of the left and the right wheel after the warm-up, with an impulse on a sample of the right one,
    shape (PERIODS, 2) each. act: takes an Observation to the commands."""
    flow, ticks = Flow(model, values['geometry']['wheel_radius'], TICKS, delay(model)), WARM_UP + PERIODS
    states, commands = numpy.zeros((2, 3)), numpy.zeros((2, len(flow.inputs)))
    samples, driven = numpy.empty((ticks, 2)), numpy.empty((ticks, 2))
    for k in range(ticks):
        samples[k] = states[:, 0] + (0.0, IMPULSE if k == WARM_UP else 0.0)
        driven[k] = act(jackal_aic.Observation(k * PERIOD, *samples[k], 0.0, valid=('left', 'right', 'acceleration')))  # a gyro couples wheels
        states = flow(states, shifted(commands, driven[k]))
    return samples[WARM_UP:], driven[WARM_UP:]


def _acting(plant, controller, values):
    """How a controller, or `predictive` with overrides, acts on an observation. Margins are those of the model as it is configured."""
    if not isinstance(controller, dict):
        set_point = jackal_aic.SetPoint(SPEED, 0.0)
        controller.reset()
        return lambda observation: controller.act(set_point, observation)
    model = dict(values['plant_model'], acceleration_limit=UNLIMITED)
    model = {'plant_model.' + key: value for key, value in model.items() if value != ''}
    core = jackal_aic.PredictiveController(jackal_aic.Parameters('predictive', plant, overrides=dict(
        model, **{'predictive.learn_drive_train': False}, **controller)))
    core.set_set_point(SPEED, 0.0)

    def act(observation):
        core.observe(observation)
        core.update_belief()
        command = core.update_action()
        for _ in range(TICKS - 1):
            core.update_belief()
        return command

    return act


@functools.lru_cache(maxsize=None)
def _open_loop(model, radius):
    """Speed of a wheel, tick by tick over an answer: after a unit step of the motors' input at MOMENT, and after a command of one period."""
    model = dict(model)
    step, command, _ = kalman.drive_train(model, radius)
    disturbed, commanded, begin = numpy.zeros((PERIODS * TICKS, 3)), numpy.zeros((PERIODS * TICKS, 3)), delay(model)
    for i in range(PERIODS * TICKS - 1):
        disturbed[i, 2] = float(i >= MOMENT)
        disturbed[i + 1] = step @ disturbed[i]
        commanded[i + 1] = step @ commanded[i] + (command if begin <= i < begin + TICKS else 0.0)
    return disturbed[:, 0], commanded[:, 0]


def _fades(samples, rounding):
    """True if the last second of an answer is smaller than the one in its middle."""
    largest = [numpy.max(numpy.abs(samples[end - TAIL:end])) for end in (PERIODS, PERIODS // 2)]
    return bool(numpy.all(numpy.isfinite(samples)) and largest[0] <= max(rounding, FADING * largest[1]))


def _crossings(values):
    """Indices after which a function changes its sign, and where between them it is zero."""
    before = numpy.flatnonzero((values[:-1] < 0.0) != (values[1:] < 0.0))
    return before, values[before] / (values[before] - values[before + 1])


def figures(plant, controller, dead_time_factor=1.0):
    """stable, peak_sensitivity (Ms), gain_margin, delay_margin [s]; iae after a unit step of the motors' input and the least_iae that any
    controller can have [s]; noise of the command per that of the encoders.

    controller: a VelocityController, or overrides of `predictive`. dead_time_factor: of the robot's dead time over the model's.
    """
    values = engine.settings(plant, 'predictive')
    radius, model = values['geometry']['wheel_radius'], dict(values['plant_model'])
    model['dead_time'] *= dead_time_factor
    disturbed, commanded = _open_loop(tuple(sorted(model.items())), radius)
    least = kalman.TICK * numpy.sum(numpy.abs(disturbed[MOMENT:TICKS + delay(model)]))
    found = {'stable': False, 'peak_sensitivity': math.inf, 'gain_margin': 0.0, 'delay_margin': 0.0, 'iae': math.inf, 'noise': math.inf,
             'least_iae': least}
    samples, commands = _answers(_acting(plant, controller, values), model, values)
    steady = samples[:, 0] - numpy.mean(samples[-TAIL:, 0])
    samples, commands = ((series[:, 1] - series[:, 0]) / IMPULSE for series in (samples, commands))
    if not _fades(steady, ROUNDING) or not _fades(samples, ROUNDING / IMPULSE):
        return found
    sensitivity = TRANSFORM @ samples
    loop = 1.0 / sensitivity - 1.0
    i, part = _crossings(loop.imag)
    real = numpy.append((loop[i] + part * (loop[i + 1] - loop[i])).real, loop[-1].real)  # at half the rate of the samples L is real
    i, part = _crossings(numpy.abs(loop) - 1.0)
    omega, at = (series[i] + part * (series[i + 1] - series[i]) for series in (FREQUENCIES, loop))
    # The wheel answers the sample of each period by its commands after an impulse: u_k = sum of c_(k-j) d_j.
    driven = numpy.zeros(PERIODS * TICKS)
    driven[::TICKS] = numpy.convolve(commands, disturbed[::TICKS])[:PERIODS]
    error = disturbed + scipy.signal.fftconvolve(driven, commanded)[:PERIODS * TICKS]
    return dict(found, stable=True, peak_sensitivity=float(numpy.max(numpy.abs(sensitivity))),
                gain_margin=float(min(-1.0 / real[(real < 0.0) & (real > -1.0)], default=math.inf)),
                delay_margin=float(min((numpy.angle(at) + math.pi) / omega, default=math.inf)),
                iae=float(kalman.TICK * numpy.sum(numpy.abs(error))), noise=float(numpy.sqrt(numpy.sum(commands**2))))
