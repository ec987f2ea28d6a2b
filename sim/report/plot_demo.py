#!/usr/bin/python3
"""Tables and picture of scripts/demo, from what step_recorder wrote for each robot and controller.

Usage: plot_demo.py RECORDINGS PICTURE CONTROLLER...
Reads RECORDINGS/<robot>/<controller>/response.csv and metrics.csv; draws the stock controller and ours on a slow straight line and in
a turn; prints the tables.
"""

import pathlib
import sys

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402
import pandas  # noqa: E402

from markup import fixed  # noqa: E402
from results import engine, read, rows_of  # noqa: E402

# Okabe and Ito's palette: distinct for every kind of colour vision.
BLACK, BLUE, VERMILION = '#000000', '#0072B2', '#D55E00'

ROBOTS = ('nominal', 'slow', 'real')
PICTURE = (('slow', '0.2 m/s', 'true_forward'), ('real', '0.5 rad/s', 'true_yaw_rate'))  # robot, step and signal of each panel
LINES = {'diff_drive': ('stock controller', VERMILION), 'predictive': ('this package', BLUE)}
# Column: heading, digits, whether with a sign.
TABLES = {'steady_error_pct': ('Steady-state error, % of the set point', 1, True),
          'settling_s': ('Settling time, s (within 5 % of the final speed, whichever that is)', 2, False)}


def table(metrics, column, digits, sign, controllers):
    """One line per robot and step, one column per controller."""
    lines = []
    for robot in ROBOTS:
        for rows in zip(*(rows_of(metrics[robot, controller]) for controller in controllers)):
            cells = ['unstable' if not row['bounded'] else 'never' if row[column] is None else fixed(row[column], digits, sign) for row in rows]
            lines.append(dict(zip(['robot', 'step', *controllers], [robot, rows[0]['step'], *cells])))
    return engine.shown(pandas.DataFrame(lines))


def draw(path, responses, metrics):
    """Two panels with two lines each: the error of the stock controller, and ours."""
    figure, grid = plt.subplots(1, 2, figsize=(8.3, 3.2))
    for axes, (robot, name, signal) in zip(grid, PICTURE):
        height, unit = float(name.split()[0]), name.split()[1]
        axes.axhline(height, color=BLACK, lw=1.2, ls='--')
        for controller, (label, colour) in LINES.items():
            begin, end, error = metrics[robot, controller].set_index('step').loc[name, ['begin_s', 'end_s', 'steady_error_pct']]
            response = responses[robot, controller]
            drawn = response[response['time'].between(begin - 0.25, min(end, begin + 2.5))]
            axes.plot(drawn['time'] - begin, drawn[signal], color=colour, lw=2.5)
            axes.annotate(f'{label}\n{fixed(error, 1, True)} %', (1.02, height * (1.0 + error / 100.0)), color=colour, va='center',
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


def main(recordings, picture, controllers):
    responses, metrics = ({(robot, name): read(recordings / robot / name / file) for robot in ROBOTS for name in controllers}
                          for file in ('response.csv', 'metrics.csv'))
    draw(picture, responses, metrics)
    for column, (heading, digits, sign) in TABLES.items():
        print(heading, table(metrics, column, digits, sign, controllers), '', sep='\n')


if __name__ == '__main__':
    if len(sys.argv) < 4:
        sys.exit(__doc__.strip())
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:])
