#!/usr/bin/python3
"""Figures of doc/concepts: active_inference.png, certificate.png, drive_gate.png and fault_detection.png.

Usage: plot_concepts.py DIRECTORY
"""

import pathlib
import sys

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402
import numpy  # noqa: E402

import jackal_aic  # noqa: E402

# Okabe and Ito's palette: distinct for every kind of colour vision.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION = '#000000', '#E69F00', '#56B4E9', '#009E73', '#0072B2', '#D55E00'

WHEEL_RADIUS, TRACK = 0.098, 0.5621  # m, of the controller


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=100, metadata={'Software': None})
    plt.close(figure)


def panels(path, cases, legend, **shared):
    """Each case with an axis; draws a legend and saves the figure when all are plotted."""
    figure, axes = plt.subplots(1, len(cases), figsize=(9.0, 3.0), **shared)
    yield from zip(axes, cases)
    axes[0].legend(loc=legend, fontsize=8)
    save(figure, path)


def plot(axis, title, label, time, lines):
    """Lines (values, label, style) over time."""
    for values, words, style in lines:
        axis.plot(time, values, label=words, **style)
    axis.set_title(title, fontsize=10)
    axis.set_xlabel('time [s]')
    axis.set_ylabel(label)
    axis.grid(alpha=0.3)


def active_inference(path):
    """Set point, belief, true motion and action of the thesis' improved controller on a robot whose wheels are slow."""
    cases = (('0.2 m/s, wheels 0.5 rad/s slow', 'forward speed [m/s]', (0.5, 0.2, 0.0), lambda d: (
                  0.5 * WHEEL_RADIUS * (d.command_left + d.command_right), d.speed, d.believed_speed, d.set_speed)),
             ('0.5 rad/s, wheels 0.5 rad/s slow', 'yaw rate [rad/s]', (0.5, 0.0, 0.5), lambda d: (
                  WHEEL_RADIUS * (d.command_right - d.command_left) / TRACK, d.yaw_rate, d.believed_yaw_rate, d.set_yaw_rate)))
    styles = (('action', dict(color=ORANGE, linewidth=1.0)), ('true', dict(color=BLUE)), ('belief', dict(color=VERMILION, linewidth=2.5)),
              ('set point', dict(color=BLACK, linewidth=0.8, linestyle='--')))
    for axis, (title, label, set_point, series) in panels(path, cases, 'lower right'):
        drive = jackal_aic.simulate('ground', 'improved', [set_point], duration=2.5, overrides={'plant.wheel_offset': 0.5})
        plot(axis, title, label, drive.time, [(values, *style) for values, style in zip(series(drive), styles)])


def certificate(path):
    """Limit of stability on the ground: factor of the gain against extra dead time, at the worst of five phases."""
    gains, delays = numpy.linspace(0.0, 4.0, 41), numpy.linspace(-0.08, 0.32, 41)
    figure, axis = plt.subplots(figsize=(5.6, 3.2))
    for controller, colour in (('predictive', BLUE), ('improved', VERMILION)):
        loop = jackal_aic.linear_loops('ground', controller)[0]
        radius = [[max(loop.spectral_radius(gain, delay, phase) for phase in numpy.linspace(0.0, loop.longest_phase, 5)) for gain in gains] for delay in delays]
        axis.contour(gains, 1e3 * delays, numpy.array(radius), levels=[1.0], colors=[colour])
        margins = loop.certify()
        axis.plot([], [], color=colour, label=controller)
        axis.plot([margins.gain_margin], [0.0], 's', color=colour, markersize=5)
        axis.plot([1.0], [1e3 * margins.delay_margin], 'o', color=colour, markersize=5)
    axis.plot([], [], 's', color=BLACK, markersize=5, label='gain margin')
    axis.plot([], [], 'o', color=BLACK, markersize=5, label='delay margin')
    axis.plot([1.0], [0.0], '+', color=BLACK, markersize=9, label='the model')
    axis.text(0.15, -60, 'stable')
    axis.text(2.6, 110, 'unstable')
    axis.set_xlabel('factor of the gain')
    axis.set_ylabel('extra dead time [ms]')
    axis.grid(alpha=0.3)
    axis.legend(loc='upper right', fontsize=8)
    save(figure, path)


def drive_gate(path):
    """Command and true speed of a robot that loses its wheel speeds for a second, and of one whose right wheels are blocked for two."""
    cases = (('Stop: wheel speeds missing from 2 to 3 s', 'forward speed [m/s]', jackal_aic.Fault('lost', 2.0, 'all', 0.0, 1.0)),
             ('Fault: right wheels blocked from 2 to 4 s', '', jackal_aic.Fault('blocked', 2.0, 'right', 0.0, 2.0)))
    for axis, (title, label, fault) in panels(path, cases, 'lower left', sharey=True):
        drive = jackal_aic.simulate('ground', jackal_aic.Parameters('predictive', 'ground'), [(0.5, 1.0, 0.0)], duration=6.0, faults=fault)
        command = WHEEL_RADIUS * 0.5 * (drive.command_left + drive.command_right)
        plot(axis, title, label, drive.time, [(drive.set_speed, 'set point', dict(color=BLACK, linewidth=0.8, linestyle='--')),
                                              (command, 'command', dict(color=VERMILION)), (drive.speed, 'true speed', dict(color=BLUE))])


def fault_detection(path):
    """A frozen encoder and a gyro with a bias: what they measure, what the robot does, what the controller believes."""
    cases = (('Left encoder frozen from 2 to 4 s', 'speed of the left wheels [m/s]', jackal_aic.Fault('freeze', 2.0, 'left', 0.0, 2.0),
              [(0.5, 0.5, 0.0), (3.0, 1.0, 0.0)], lambda d: (WHEEL_RADIUS * d.measured_left, WHEEL_RADIUS * d.wheel_left, d.believed_speed)),
             ('Gyro reads 0.4 rad/s too much from 2 to 4 s', 'yaw rate [rad/s]', jackal_aic.Fault('bias', 2.0, 'gyro', 0.4, 2.0),
              [(0.5, 0.5, 0.5)], lambda d: (d.measured_yaw_rate, d.yaw_rate, d.believed_yaw_rate)))
    for axis, (title, label, fault, set_points, series) in panels(path, cases, 'right'):
        drive = jackal_aic.simulate('ground', jackal_aic.Parameters('predictive', 'ground'), set_points, duration=6.0, faults=fault)
        plot(axis, title, label, drive.time, [(values, words, dict(color=colour, linewidth=1.0)) for values, words, colour in zip(
            series(drive), ('measured', 'true', 'believed'), (VERMILION, BLACK, BLUE))])
        reports = [time for time, words, _ in drive.findings if words]
        ends = [time for time, words, _ in drive.findings if not words] + [drive.time[-1]]
        axis.axvspan(reports[0], ends[0], color=ORANGE, alpha=0.2, label='reported')


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    directory = pathlib.Path(sys.argv[1])
    active_inference(directory / 'active_inference.png')
    certificate(directory / 'certificate.png')
    drive_gate(directory / 'drive_gate.png')
    fault_detection(directory / 'fault_detection.png')


if __name__ == '__main__':
    main()
