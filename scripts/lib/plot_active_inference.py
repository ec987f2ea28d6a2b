#!/usr/bin/python3
"""Figure of doc/concepts/active_inference.md: set point, belief, true motion and action of the thesis' improved controller.

Usage: plot_active_inference.py PICTURE
"""

import sys

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402

import jackal_aic  # noqa: E402

# Okabe and Ito's palette: distinct for every kind of colour vision.
BLACK, ORANGE, BLUE, VERMILION = '#000000', '#E69F00', '#0072B2', '#D55E00'

WHEEL_RADIUS, TRACK = 0.098, 0.5621  # m, of the controller


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.0))
    slow = {'plant.wheel_offset': 0.5}
    for axis, set_point, title in zip(axes, ((0.2, 0.0), (0.0, 0.5)), ('0.2 m/s, wheels 0.5 rad/s slow', '0.5 rad/s, wheels 0.5 rad/s slow')):
        drive = jackal_aic.simulate('ground', 'improved', [(0.5, *set_point)], duration=2.5, overrides=slow)
        turn = set_point[0] == 0.0
        action = WHEEL_RADIUS * (drive.command_right - drive.command_left) / TRACK if turn else 0.5 * WHEEL_RADIUS * (drive.command_left + drive.command_right)
        axis.plot(drive.time, action, color=ORANGE, linewidth=1.0, label='action')
        axis.plot(drive.time, drive.yaw_rate if turn else drive.speed, color=BLUE, label='true')
        axis.plot(drive.time, drive.believed_yaw_rate if turn else drive.believed_speed, color=VERMILION, linewidth=2.5, label='belief')
        axis.plot(drive.time, drive.set_yaw_rate if turn else drive.set_speed, '--', color=BLACK, linewidth=0.8, label='set point')
        axis.set_title(title, fontsize=10)
        axis.set_xlabel('time [s]')
        axis.set_ylabel('yaw rate [rad/s]' if turn else 'forward speed [m/s]')
        axis.grid(alpha=0.3)
    axes[0].legend(loc='lower right', fontsize=8)
    figure.tight_layout()
    figure.savefig(sys.argv[1], dpi=100, metadata={'Software': None})


if __name__ == '__main__':
    main()
