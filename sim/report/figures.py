"""The figures of the report: SVG with the same bytes on every run."""

import base64
import io

import matplotlib
import numpy

matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402

from claims import matches  # noqa: E402
from results import REST, comparable  # noqa: E402

# Okabe and Ito's palette: distinct for every kind of colour vision.
COLOURS = ('#0072B2', '#D55E00', '#009E73', '#E69F00', '#56B4E9', '#CC79A7', '#000000', '#8C8C00', '#7F7F7F')

SIGNALS = {  # signal: column of the trace, axis label
    'measured': ('measured_mps', 'velocity [m/s]'),
    'belief': ('belief_mps', 'believed velocity [m/s]'),
    'command': ('command', 'drive command [rad/s]'),
    'velocity': ('velocity_mps', 'velocity [m/s]'),
    'yaw_rate': ('yaw_rate_radps', 'yaw rate [rad/s]'),
    'believed_yaw_rate': ('belief_radps', 'yaw rate [rad/s]'),
}

# What each line is, where a panel draws more than one signal of a run.
PARTS = {'measured': 'action', 'belief': 'belief', 'yaw_rate': 'true', 'believed_yaw_rate': 'believed'}

SET_POINTS = {'yaw_rate': 'set_point_radps', 'believed_yaw_rate': 'set_point_radps'}  # others: the forward speed

UNITS = {'tau': 's', 'belief_hz': 'Hz', 'step_mps': 'm/s'}
NAMES = {'belief_hz': 'belief', 'step_mps': 'step', 'kappa_mu': 'κ_μ', 'kappa_a': 'κ_a', 'tau': 'τ'}
WORDS = {
    'diff_drive': 'differential drive', 'standard': 'standard', 'improved': 'improved', 'state_space': 'state-space model',
    'predictive': 'predictive', 'tuned': 'tuned', 'plant_limit': 'limit of the plant', 'kalman_filter': 'Kalman filter',
    'box': 'on the box', 'ground': 'on the ground'
}

RUNAWAY = 3.0  # m/s beyond which a velocity has diverged
MANY = 6  # lines of a panel, above which its legend is outside
ENDLESS = 1e12  # m/s where the axis of a diverging belief ends


plt.rcParams.update({  # the first make the bytes reproducible
    'svg.hashsalt': 'jackal_aic', 'svg.fonttype': 'none', 'path.simplify': True, 'path.simplify_threshold': 0.2,
    'font.size': 9, 'axes.grid': True, 'grid.alpha': 0.3, 'axes.spines.top': False, 'axes.spines.right': False
})


def label(run, columns):
    """Label that distinguishes this line."""
    parts = []
    for column in columns:
        value = run[column]
        if value is None:
            continue
        if isinstance(value, float):
            parts.append(f'{NAMES.get(column, column)} {value:g} {UNITS.get(column, "")}'.strip())
        else:
            parts.append(WORDS.get(value, value))
    return ', '.join(parts)


def selected(runs, panel):
    """Runs of a panel: by integrator, then by the values it selects."""
    wanted = panel.get('integrator', 'comparable')
    if wanted == 'comparable':
        runs = comparable(runs)
    elif wanted != 'all':
        runs = [run for run in runs if run['integrator'] == wanted]
    for column, value in panel.get('select', {}).items():
        runs = [run for run in runs if matches(run[column], value)]
    return runs


def integrators(runs, panel):
    """The integrator of each line, and the addition to the title if all lines share it. Only for panels of the thesis
    that do not show it otherwise."""
    named = [run['integrator'] for run in runs]
    if 'integrator' in panel['by'] or any(run['controller'] in ('predictive', 'tuned') for run in runs) or not any(named):
        return [''] * len(runs), ''
    if len(set(named)) == 1:
        return [''] * len(runs), f' ({named[0]})'
    return [name or '' for name in named], ''


def mark_settling(axis, run, colour):
    """Ours as a full, the thesis' as an open marker, on the lower edge of the 5 % band."""
    height = 0.95 * run['step_mps']
    if run['settling_s']:
        axis.plot(run['settling_s'], height, marker='v', color=colour, markersize=5, linestyle='')
    if run['thesis_settling_s']:
        axis.plot(run['thesis_settling_s'], height, marker='v', color=colour, fillstyle='none', markersize=7, linestyle='')


def draw_panel(axis, runs, panel, square):
    """One panel; returns True if a line diverges out of it."""
    names = panel['signal'] if isinstance(panel['signal'], list) else [panel['signal']]
    diverges = False
    chosen = selected(runs, panel)
    start = 0.0 if square else REST
    at_lines, in_title = integrators(chosen, panel)
    for i, run in enumerate(chosen):
        for j, name in enumerate(names):
            colour = COLOURS[(i * len(names) + j) % len(COLOURS)]
            column, _ = SIGNALS[name]
            times, values = run.series(column, start)
            values = numpy.where(numpy.abs(values) < ENDLESS, values, numpy.nan)
            text = ', '.join(filter(None, (label(run, panel['by']), PARTS[name] if len(names) > 1 else '', at_lines[i])))
            if not run.bounded:
                text += ' (unstable)'
            axis.plot(times, values, color=colour, linewidth=1.3, label=text)
            if name != 'command':
                diverges = diverges or bool(numpy.any(numpy.abs(values) > RUNAWAY))
            if name == 'measured' and run.bounded and not square and len(names) == 1:
                mark_settling(axis, run, colour)
    draw_set_points(axis, chosen, names, start)
    if diverges:
        axis.set_yscale('symlog', linthresh=1.0)
        axis.set_ylim(-ENDLESS, ENDLESS)
        axis.set_yticks([-ENDLESS, -1e8, -1e4, 0, 1e4, 1e8, ENDLESS])
    axis.set_title(panel['title'] + in_title, fontsize=9)
    axis.set_xlabel('time [s]' if square else 'time after the step [s]')
    axis.set_ylabel(SIGNALS[names[0]][1])
    unstable = any(not run.bounded for run in chosen)
    axis.set_xlim(*panel.get('window', (0.0, None) if square else (-REST if unstable else -0.1, 2.5)))
    lines = len(axis.get_legend_handles_labels()[0])
    if lines > MANY:
        axis.legend(fontsize=7, loc='center left', bbox_to_anchor=(1.0, 0.5), frameon=False)
    elif lines:
        axis.legend(fontsize=7, loc='best')
    return diverges


def draw_set_points(axis, runs, names, start):
    if 'command' in names:
        return
    drawn = set()
    for run in runs:
        times, values = run.series(SET_POINTS.get(names[0], 'set_point_mps'), start)
        if tuple(values) not in drawn:
            axis.plot(times, values, color='#555555', linewidth=0.8, linestyle='--', zorder=0)
            drawn.add(tuple(values))


def figure_image(item):
    """Panels in rows of two as an SVG data URI, and whether a line diverges. item: runs, panels, whether they are square waves."""
    runs, panels, square = item
    across = min(len(panels), 2)
    down = -(-len(panels) // across)
    figure, axes = plt.subplots(down, across, figsize=(5.0 * across, 3.2 * down), squeeze=False)
    diverges = [draw_panel(axis, runs, panel, square) for axis, panel in zip(axes.flat, panels)]
    for axis in axes.flat[len(panels):]:
        axis.remove()
    figure.tight_layout()
    buffer = io.BytesIO()
    figure.savefig(buffer, format='svg', metadata={'Date': None, 'Creator': None})
    plt.close(figure)
    return 'data:image/svg+xml;base64,' + base64.b64encode(buffer.getvalue()).decode(), any(diverges)
