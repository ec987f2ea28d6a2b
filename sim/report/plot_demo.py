#!/usr/bin/env python3
"""Table and figures of scripts/demo, from what step_recorder wrote for each robot and controller.

Usage: plot_demo.py RECORDINGS OUTPUT CONTROLLER...
Reads RECORDINGS/<robot>/<controller>/response.csv and metrics.csv; writes OUTPUT/demo.csv, demo_metrics.csv, demo.png (how the
controllers compare on each robot) and demo_signals.png (what each of them measured, believed and sent); prints the table.
"""

import csv
import pathlib
import sys

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt

TITLES = {
    'diff_drive': 'Differential drive (open loop)',
    'standard': 'Standard active inference',
    'improved': 'Improved active inference',
    'predictive': 'Predictive active inference',
}

# Okabe and Ito's palette: distinct for every kind of colour vision.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION = '#000000', '#E69F00', '#56B4E9', '#009E73', '#0072B2', '#D55E00'

ROBOTS = {  # directory: what it is
    'nominal': 'the robot as it is known',
    'worn': 'worn: weak battery (-20 %), 8 kg on top, 5° uphill',
    'real': 'real: uneven ground, tyres that differ, delays, ...',
}
COLOURS = {'diff_drive': VERMILION, 'standard': SKY, 'improved': ORANGE, 'predictive': BLUE}

LONG_GAP = 0.06  # s between two commands: three periods of a 50 Hz controller

METRICS = [  # column of metrics.csv, heading, format
    ('settling_s', 'settling [s]', '.2f'),
    ('rise_s', 'rise [s]', '.2f'),
    ('overshoot_pct', 'overshoot [%]', '.1f'),
    ('steady_error_pct', 'steady-state error [%]', '+.2f'),
]


def title_of(controller):
    return TITLES.get(controller, controller.replace('_', ' ').capitalize())


def read_table(path):
    """Rows of a CSV file as dictionaries."""
    with open(path, newline='') as file:
        return list(csv.DictReader(file))


def column(rows, name):
    """A column as numbers, NaN where a cell is empty."""
    return [float(row[name]) if row[name] else float('nan') for row in rows]


def table_lines(metrics):
    """The table for the terminal: one line per robot, step and controller."""
    header = ['robot', 'controller', 'step'] + [heading for _, heading, _ in METRICS]
    body = []
    for robot, controllers in metrics.items():
        for step in range(len(next(iter(controllers.values())))):
            for controller, steps in controllers.items():
                row = steps[step]
                cells = [format(float(row[name]), form) if row[name] else 'never' for name, _, form in METRICS]
                if row['bounded'] != '1':
                    cells = ['unstable'] + ['-'] * (len(METRICS) - 1)
                body.append([robot, title_of(controller), row['step']] + cells)
    widths = [max(len(line[i]) for line in [header] + body) for i in range(len(header))]

    def line(cells):
        return '  '.join(cell.ljust(width) if i < 3 else cell.rjust(width)
                         for i, (cell, width) in enumerate(zip(cells, widths))).rstrip()

    return [line(header), '  '.join('-' * width for width in widths)] + [line(cells) for cells in body]


def warnings(metrics):
    """One line per controller that the machine did not serve in time, whose figures therefore say little."""
    for controllers in metrics.values():
        for controller, steps in controllers.items():
            gap = max(float(step['command_gap_s']) for step in steps)
            if gap > LONG_GAP:
                yield (f'Note: {title_of(controller)} sent no command for {gap:.2f} s, because this machine was busy. '
                       'Its figures are too bad; scripts/demo --speed 0.5 gives it more time.')


def write_joined(path, tables):
    """Writes the tables of all robots and controllers as one, with both in the first columns."""
    rows = [{'robot': robot, 'controller': controller, **row} for robot, controllers in tables.items()
            for controller, table in controllers.items() for row in table]
    with open(path, 'w', newline='') as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def quantity_of(step):
    """Signal, name and unit of what a step steps."""
    return ('forward', 'forward speed', 'm/s') if step['step'].endswith(' m/s') else ('yaw_rate', 'yaw rate', 'rad/s')


def plain(axes):
    """Removes from an axis what carries no data."""
    axes.grid(color='0.9')
    for side in ('top', 'right'):
        axes.spines[side].set_visible(False)


def plot_comparison(path, responses, metrics):
    """A column per robot, a row per step: the true velocity that each controller reached."""
    steps = next(iter(next(iter(metrics.values())).values()))
    figure, grid = plt.subplots(len(steps), len(responses), figsize=(6.0 * len(responses), 3.3 * len(steps)), sharex=True,
                                sharey='row', squeeze=False)
    for i, (robot, controllers) in enumerate(responses.items()):
        grid[0, i].set_title(ROBOTS.get(robot, robot), fontsize=12, fontweight='bold', pad=10)
        for controller, rows in controllers.items():
            for k, step in enumerate(metrics[robot][controller]):
                signal, quantity, unit = quantity_of(step)
                time, part = window(rows, step)
                axes = grid[k, i]
                if controller == next(iter(controllers)):
                    axes.step(time, column(part, 'set_' + signal), where='post', color=BLACK, lw=1.2, ls='--', label='set point')
                axes.plot(time, column(part, 'true_' + signal), color=COLOURS.get(controller, '0.5'), lw=2.0,
                          ls='-.' if controller == 'diff_drive' else '-', label=title_of(controller))
                grid[k, 0].set_ylabel(f'true {quantity} [{unit}]')
    for axes in grid.flat:
        plain(axes)
    for axes in grid[-1]:
        axes.set_xlabel('time since the step [s]')
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='upper center', ncol=len(labels), frameon=False)
    figure.tight_layout(rect=(0.0, 0.0, 1.0, 0.95))
    figure.align_ylabels(grid[:, 0])
    figure.savefig(path, dpi=110)


def plot_velocity(axes, time, rows, signal, step):
    """Set point, true, measured and believed velocity of one step, with its settling time."""
    axes.step(time, column(rows, 'set_' + signal), where='post', color=BLACK, lw=1.2, ls='--', label='set point')
    axes.plot(time, column(rows, 'measured_' + signal), color=SKY, ls='', marker='.', ms=4, label='measured')
    axes.plot(time, column(rows, 'true_' + signal), color=BLUE, lw=1.8, label='true')
    axes.plot(time, column(rows, 'believed_' + signal), color=VERMILION, lw=1.4, label='believed')
    if step['settling_s']:
        settled = float(step['settling_s'])
        axes.axvline(settled, color=GREEN, lw=1.2, ls=':')
        axes.annotate(f'settled in {settled:.2f} s', (settled, 0.04), xycoords=('data', 'axes fraction'),
                      xytext=(5, 0), textcoords='offset points', color=GREEN, va='bottom')


def plot_commands(axes, time, rows):
    """Wheel speeds sent; the dashes keep both visible where they are equal."""
    axes.step(time, column(rows, 'command_left'), where='post', color=ORANGE, lw=2.2, label='command, left wheels')
    axes.step(time, column(rows, 'command_right'), where='post', color=BLACK, lw=1.0, ls=(0, (4, 3)),
              label='command, right wheels')


def window(rows, step):
    """The rows around a step and their times since the step."""
    begin, end = float(step['begin_s']), float(step['end_s'])
    rows = [row for row in rows if begin - 0.25 <= float(row['time']) <= min(end, begin + 2.5)]
    return [float(row['time']) - begin for row in rows], rows


def plot_signals(path, responses, metrics):
    """A column per controller; per step a row of velocities and below it one of commands."""
    steps = next(iter(metrics.values()))
    figure, grid = plt.subplots(2 * len(steps), len(responses), figsize=(4.2 * len(responses), 5.2 * len(steps)),
                                sharex=True, sharey='row', squeeze=False, gridspec_kw={'height_ratios': [3, 2] * len(steps)})
    for i, (controller, rows) in enumerate(responses.items()):
        grid[0, i].set_title(title_of(controller), fontsize=12, fontweight='bold', pad=12)
        for k, step in enumerate(metrics[controller]):
            signal, quantity, unit = quantity_of(step)
            time, part = window(rows, step)
            plot_velocity(grid[2 * k, i], time, part, signal, step)
            plot_commands(grid[2 * k + 1, i], time, part)
            grid[2 * k, 0].set_ylabel(f'{quantity} [{unit}]')
            grid[2 * k + 1, 0].set_ylabel('wheel command [rad/s]')
    for axes in grid.flat:
        plain(axes)
    for axes in grid[-1]:
        axes.set_xlabel('time since the step [s]')
    handles, labels = (velocity + command for velocity, command in zip(grid[0, 0].get_legend_handles_labels(),
                                                                       grid[1, 0].get_legend_handles_labels()))
    figure.legend(handles, labels, loc='upper center', ncol=len(labels), frameon=False)
    figure.tight_layout(rect=(0.0, 0.0, 1.0, 0.975))
    figure.align_ylabels(grid[:, 0])
    figure.savefig(path, dpi=110)


def main(recordings, output, controllers):
    def read(file):
        return {robot: {name: read_table(recordings / robot / name / file) for name in controllers} for robot in ROBOTS}

    responses, metrics = read('response.csv'), read('metrics.csv')
    write_joined(output / 'demo.csv', responses)
    write_joined(output / 'demo_metrics.csv', metrics)
    plot_comparison(output / 'demo.png', responses, metrics)
    plot_signals(output / 'demo_signals.png', responses['nominal'], metrics['nominal'])
    print('\n'.join([*table_lines(metrics), *warnings(metrics)]))


if __name__ == '__main__':
    if len(sys.argv) < 4:
        sys.exit(__doc__.strip())
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:])
