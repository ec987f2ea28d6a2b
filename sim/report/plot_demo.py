#!/usr/bin/python3
"""Tables and figures of scripts/demo, from what step_recorder wrote for each robot and controller.

Usage: plot_demo.py RECORDINGS OUTPUT CONTROLLER...
Reads RECORDINGS/<robot>/<controller>/response.csv and metrics.csv; writes OUTPUT/demo.csv, demo_metrics.csv and demo.png (the
stock controller and ours on a slow straight line and in a turn); prints the tables.
"""

import csv
import pathlib
import sys

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt

# Okabe and Ito's palette: distinct for every kind of colour vision.
BLACK, BLUE, VERMILION = '#000000', '#0072B2', '#D55E00'

ROBOTS = ('nominal', 'slow', 'real')
FIRST_PICTURE = (('slow', '0.2 m/s'), ('real', '0.5 rad/s'))  # robot and step of each panel
FIRST_LINES = {'diff_drive': ('stock controller', VERMILION), 'predictive': ('this package', BLUE)}

LONG_GAP = 0.06  # s between two commands: three periods of a 50 Hz controller

TABLES = [  # column of metrics.csv, heading, format
    ('steady_error_pct', 'Steady-state error, % of the set point', '+.1f'),
    ('settling_s', 'Settling time, s (within 5 % of the final speed, whichever that is)', '.2f'),
]


def read_table(path):
    """Rows of a CSV file as dictionaries."""
    with open(path, newline='') as file:
        return list(csv.DictReader(file))


def column(rows, name):
    """A column as numbers, NaN where a cell is empty."""
    return [float(row[name]) if row[name] else float('nan') for row in rows]


def shown(value, form):
    """A number, whose zero has no sign."""
    text = format(value, form)
    return text.lstrip('+-') if float(text) == 0.0 else text


def table_lines(metrics, name, heading, form):
    """A table for the terminal: one line per robot and step, one column per controller."""
    controllers = list(next(iter(metrics.values())))
    lines = [['robot', 'step', *controllers]]
    for robot, tables in metrics.items():
        for rows in zip(*(tables[controller] for controller in controllers)):
            cells = ['unstable' if row['bounded'] != '1' else shown(float(row[name]), form) if row[name] else 'never'
                     for row in rows]
            lines.append([robot, rows[0]['step'], *cells])
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return [heading] + ['  ' + '  '.join(cell.ljust(width) if i < 2 else cell.rjust(width)
                                         for i, (cell, width) in enumerate(zip(line, widths))).rstrip() for line in lines]


def warnings(metrics):
    """One line per controller with late commands of a busy machine, whose figures are unreliable."""
    for controllers in metrics.values():
        for controller, steps in controllers.items():
            gap = max(float(step['command_gap_s']) for step in steps)
            if gap > LONG_GAP:
                yield (f'Note: {controller} sent no command for {gap:.2f} s, because this machine was busy. '
                       'Its figures are too bad; scripts/demo --speed 0.5 gives it more time.')


def write_joined(path, tables):
    """Writes the tables of all robots and controllers as one, with both in the first columns."""
    rows = [{'robot': robot, 'controller': controller, **row} for robot, controllers in tables.items()
            for controller, table in controllers.items() for row in table]
    with open(path, 'w', newline='') as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def plot_first_picture(path, responses, metrics):
    """Two panels with two lines each: the error of the stock controller, and ours."""
    figure, grid = plt.subplots(1, 2, figsize=(8.3, 3.2))
    for axes, (robot, name) in zip(grid, FIRST_PICTURE):
        height, unit = float(name.split()[0]), name.split()[1]
        axes.axhline(height, color=BLACK, lw=1.2, ls='--')
        for controller, (label, colour) in FIRST_LINES.items():
            step = next(row for row in metrics[robot][controller] if row['step'] == name)
            signal = 'forward' if unit == 'm/s' else 'yaw_rate'
            time, part = window(responses[robot][controller], step)
            axes.plot(time, column(part, 'true_' + signal), color=colour, lw=2.5)
            error = float(step['steady_error_pct'])
            axes.annotate(f'{label}\n{shown(error, "+.1f")} %', (1.02, height * (1.0 + error / 100.0)), color=colour, va='center',
                          xycoords=('axes fraction', 'data'), fontsize=11, fontweight='bold', annotation_clip=False)
        axes.set_title(f'Asked for {name}' + (' (turn)' if unit == 'rad/s' else ''), loc='left', fontsize=13, fontweight='bold')
        axes.set_xlabel('seconds', fontsize=11)
        axes.set_ylabel(unit, fontsize=11)
        axes.set_ylim(0.0, 1.15 * height)
        axes.set_xlim(-0.25, 2.5)
        axes.tick_params(labelsize=11)
        for side in ('top', 'right'):
            axes.spines[side].set_visible(False)
    figure.subplots_adjust(left=0.085, right=0.82, top=0.89, bottom=0.17, wspace=0.95)
    figure.savefig(path, dpi=100)


def window(rows, step):
    """The rows around a step and their times since the step."""
    begin, end = float(step['begin_s']), float(step['end_s'])
    rows = [row for row in rows if begin - 0.25 <= float(row['time']) <= min(end, begin + 2.5)]
    return [float(row['time']) - begin for row in rows], rows


def main(recordings, output, controllers):
    def read(file):
        return {robot: {name: read_table(recordings / robot / name / file) for name in controllers} for robot in ROBOTS}

    responses, metrics = read('response.csv'), read('metrics.csv')
    write_joined(output / 'demo.csv', responses)
    write_joined(output / 'demo_metrics.csv', metrics)
    plot_first_picture(output / 'demo.png', responses, metrics)
    tables = [line for table in TABLES for line in [*table_lines(metrics, *table), '']]
    print('\n'.join([*tables, *warnings(metrics)]))


if __name__ == '__main__':
    if len(sys.argv) < 4:
        sys.exit(__doc__.strip())
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:])
