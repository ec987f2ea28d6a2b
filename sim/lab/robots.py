"""Random robots, over all differences between a real robot and its model."""

import itertools
import typing

import jackal_aic

import motions
from draws import Draws
from engine import CONTROLLERS, PLANTS

# Keys of plant.* and their ranges. Sources: doc/reference/simulated_jackal.md.
REALITY = (('wheel_offset', 0.0, 0.5), ('wheel_breakaway', 0.0, 0.8), ('wheel_radius_left', 0.095, 0.098),
           ('wheel_radius_right', 0.095, 0.098), ('battery_sag', 0.0, 0.2), ('battery_discharge', 0.0, 0.1), ('payload', 0.0, 8.0),
           ('payload_x', -0.08, 0.08), ('payload_y', -0.08, 0.08), ('payload_z', 0.0, 0.2), ('friction', 0.35, 0.9),
           ('slope', -5.0, 5.0), ('roughness', 0.0, 0.005), ('roughness_length', 0.5, 2.0), ('ramp', -6.0, 6.0),
           ('ramp_start', 0.5, 10.0), ('ramp_length', 1.0, 5.0), ('patch_friction', 0.5, 1.0), ('patch_size', 0.3, 3.0),
           ('kerb_distance', 0.5, 20.0), ('kerb_height', 0.0, 0.015), ('feedback_rate', 45.0, 50.0), ('feedback_repeats', 0.0, 0.05),
           ('measurement_loss', 0.0, 0.02), ('encoder_noise', 0.0, 0.03), ('encoder_filter', 0.0, 0.05), ('gyro_bias', 0.0, 0.005),
           ('vibration_x', 0.3, 2.7), ('vibration_y', 0.3, 2.7), ('vibration_z', 0.3, 1.0), ('vibration_gyro', 0.005, 0.02),
           ('stamp_jitter', 0.0, 0.005), ('network_delay', 0.0, 0.02))
ENCODER_STEPS = (0.0065, 0.06, 0.1)  # rad/s


def reality(seed):
    """A robot on some ground, as overrides of `real`."""
    draw = Draws(seed)
    robot = {'plant.' + key: float('{:.4g}'.format(draw.between(low, high))) for key, low, high in REALITY}
    robot['plant.encoder_step'] = draw.one_of(ENCODER_STEPS)
    robot['plant.seed'] = seed
    return robot


# ---- robots without identification

RATIOS = ('dead_time', 'motor_lag', 'wheel_gain', 'acceleration_limit')


def scaled(plant, ratios):
    """Overrides of a robot whose drive train has these multiples of a plant's."""
    return {'plant.' + key: plant[key] * ratio for key, ratio in zip(RATIOS, ratios)}


def assumed_model():
    """The assumed Jackal (config/jackal_model.yaml), by the keys of plant_model.*."""
    values = jackal_aic.Parameters('predictive', 'assumed').values()
    return {key[len('plant_model.'):]: value for key, value in values.items() if key.startswith('plant_model.')}


def unidentified():
    """Dead time, lag, gain and acceleration limit in multiples of the assumed ones."""
    return [(1.0, 1.0, 1.0, 1.0), *itertools.product((0.5, 2.0), (0.5, 2.0), (0.8, 1.2), (0.5, 1.0, 3.0))]


# ---- hours of driving without a fault

class QuietDrive(typing.NamedTuple):
    controller: str
    plant: str
    words: str
    overrides: dict
    ratios: tuple
    identified: bool
    motion: motions.Motion

    def __str__(self):
        parts = ['{} on {}'.format(self.controller, self.plant), self.words]
        parts += ['{}={:g}'.format(key, value) for key, value in self.overrides.items()]
        parts += ['{} x {:g}'.format(*pair) for pair in zip(('dead time', 'lag', 'gain', 'limit'), self.ratios)]
        return ', '.join(parts)


def _ratio(draw, low, high):
    return low * (high / low)**draw.between(0.0, 1.0)


def _quiet_motion(draw, duration):
    kind = ('turn', 'circle', 'straight', 'arcs', 'joystick', 'stand')[draw.below(6)]
    if kind == 'arcs':
        points, time = [], motions.REST
        while time < duration:
            points.append((time, *motions.arc(draw)))
            time += draw.between(5.0, 60.0)
        return kind, motions.Motion(tuple(points), duration)
    if kind == 'joystick':
        return kind, motions.Motion(motions.joystick_points(draw, duration), duration)
    set_point = motions.arc(draw) if kind == 'circle' else (0.0, 0.0)
    if kind in ('turn', 'straight'):
        value = draw.sign() * _ratio(draw, 0.1, 2.0)
        set_point = (value, 0.0) if kind == 'straight' else (0.0, value)
    return '{} {:g} m/s {:g} rad/s'.format(kind, *set_point), motions.Motion(((motions.REST, *set_point),), duration)


def quiet_drive(seed, number, duration, identified=True, real=False):
    """The healthy robot of a number and its drive: any preset on ground or box with any sensors. Its motors accelerate
    by half to three times their model; without identification dead time, lag and gain differ, too. `real`: a random
    robot and ground."""
    draw = Draws(seed * 1000003 + number)
    controller, plant = draw.one_of(CONTROLLERS), draw.one_of(PLANTS)
    limit = _ratio(draw, 0.5, 3.0)
    ratios = (1.0, 1.0, 1.0, limit) if identified else (_ratio(draw, 0.5, 2.0), _ratio(draw, 0.5, 2.0), draw.between(0.8, 1.2), limit)
    overrides = {'plant.encoder_step': draw.one_of((0.0, 0.0065, 0.0131, 0.06, 0.1)),
                 'plant.encoder_noise': draw.one_of((0.0, 0.003, 0.03)), 'plant.stamp_jitter': draw.one_of((0.0, 0.008)),
                 'plant.seed': 1 + draw.below(1000)}
    words, motion = _quiet_motion(draw, duration)
    if real:
        plant, overrides = 'real', reality(seed * 1000003 + number)
    return QuietDrive(controller, plant, words, overrides, ratios, identified, motion)
