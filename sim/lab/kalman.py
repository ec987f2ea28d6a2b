"""The best linear estimator of the drive train with a constant gain, the reference for `predictive`'s belief."""

import numpy
import scipy.linalg

TICK = 0.001  # s


def drive_train(model, radius):
    """Map of (w, z, d) and of a command over a tick below the acceleration limit (include/jackal_aic/model/drive_train.hpp)."""
    response = -numpy.expm1(-TICK / model['lag']) if model['lag'] > 0.0 else 1.0
    k = model['velocity_loop_integral'] * TICK
    of_r = numpy.array([response, k * (1.0 - 0.5 * response), 0.0])
    transition = numpy.array([[1.0 - response, response, of_r[0]], [-of_r[1], 1.0 - 0.5 * k * response, of_r[1]], [0.0, 0.0, 1.0]])
    return transition, model['gain'] * of_r, model['acceleration_limit'] / radius * TICK


def over_ticks(step, fluctuation, count):
    """Transition and covariance of the fluctuations over some ticks."""
    transition, process = numpy.eye(len(step)), numpy.zeros_like(step)
    for _ in range(count):
        process = step @ process @ step.T + numpy.diag(fluctuation)
        transition = step @ transition
    return transition, process


def stationary_gain(transition, process, output, noise):
    """P C' (C P C' + R)^-1 with the solution P of the filter's Riccati equation."""
    covariance = scipy.linalg.solve_discrete_are(transition.T, output.T, process, noise)
    return covariance @ output.T @ numpy.linalg.inv(output @ covariance @ output.T + noise)


def filtered(drive, values, track):
    """Speed and yaw rate of a steady-state Kalman filter with the commands and samples of a drive.

    values: of settings(); track: the true effective track [m], known to the filter (not on the box).
    """
    model, geometry, gains = values['plant_model'], values['geometry'], values['controller']
    radius, box = geometry['wheel_radius'], model['on_box']
    per_difference = radius * geometry['slip_factor'] / (geometry['effective_track'] if box else track)
    step, command_input, limit = drive_train(model, radius)
    output = numpy.zeros((2 if box else 3, 6))
    output[0, 0] = output[1, 3] = 1.0
    if not box:
        output[2, 0], output[2, 3] = -per_difference, per_difference
    wheel = [gains['speed_process_noise'], 0.0, gains['disturbance_process_noise']]
    plant = values['plant']
    noise = numpy.diag([plant['encoder_noise']**2] * 2 + ([] if box else [plant['gyro_noise']**2]))
    transition, process = over_ticks(scipy.linalg.block_diag(step, step), TICK * numpy.array(2 * wheel),
                                     int(round(1.0 / (model['sensor_rate'] * TICK))))
    gain = stationary_gain(transition, process, output, noise)

    delay = int(round(model['dead_time'] / TICK))
    commands = numpy.stack([drive.command_left, drive.command_right], axis=1)
    acting = numpy.vstack([numpy.zeros((delay + 1, 2)), commands])  # the command of a tick acts in the next, after the dead time
    samples = numpy.stack([drive.measured_left, drive.measured_right, drive.measured_yaw_rate], axis=1)[:, :len(output)]
    state, wheels = numpy.zeros((2, 3)), numpy.zeros((len(commands), 2))
    for i, sampled in enumerate(drive.sampled):
        if i > 0:
            moved = state @ step.T + numpy.outer(acting[i], command_input)
            change = moved[:, 0] - state[:, 0]
            limited = numpy.abs(change) > limit
            moved[limited] = state[limited]
            moved[limited, 0] += numpy.clip(change[limited], -limit, limit)
            state = moved
        if sampled:
            flat = state.ravel()
            state = (flat + gain @ (samples[i] - output @ flat)).reshape(2, 3)
        wheels[i] = state[:, 0]
    return 0.5 * radius * (wheels[:, 0] + wheels[:, 1]), per_difference * (wheels[:, 1] - wheels[:, 0])
