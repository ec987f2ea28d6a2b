"""The thesis' tables and figures, and the comparisons beyond them: the kinds of scenarios.yaml."""

import functools
import itertools
import math
import types

import numpy
import pandas

import engine
import kalman
import metrics
import motions
from state_space import step_response

INTEGRATORS = ('euler', 'exact')
TRUE_TRACK = 0.547  # m, of the robot that turns in place on the ground
STRIDE, PRECISION = 2.0**0.25, 0.005  # of the search for a usable range
LEAST, MOST = 1e-5, 1e3  # of that search


# ---- the thesis' tables

def table(name):
    """A table as printed (sim/thesis/tables.yaml)."""
    tables = {found['table']: found for found in engine.read_yaml('sim/thesis/tables.yaml')['tables']}
    if name not in tables:
        raise ValueError("table = '{}': unknown; known: {}".format(name, ', '.join(tables)))
    return tables[name]


def steps(name):
    """Rows of a table with controller, plant and overrides filled in."""
    found = table(name)
    for row in found['rows']:
        yield dict(row, table=name, controller=row.get('controller', found.get('controller')),
                   plant=found.get('support', 'box'),
                   overrides={'controller.' + key: value for key, value in row.get('set', {}).items()})


def with_integrator(overrides, integrator):
    return dict(overrides, **{'controller.integrator': integrator})


def belief_converges(controller, overrides):
    """True if one step of the belief update alone has a spectral radius below 1."""
    return engine.settings('box', controller, overrides)['belief_radius'] < 1.0


def comparable_integrator(row):
    """The thesis' own euler where its belief update converges, else exact."""
    if row['controller'] == 'diff_drive':
        return 'exact'
    return 'euler' if belief_converges(row['controller'], with_integrator(row['overrides'], 'euler')) else 'exact'


def overrides_of(row, integrator):
    return row['overrides'] if row['controller'] == 'diff_drive' else with_integrator(row['overrides'], integrator)


def thesis_step(row, integrator):
    """The step of a row of a table; `integrator` of an active inference controller."""
    return engine.result(row['plant'], row['controller'], motions.step(row['step']), overrides_of(row, integrator), True,
                         columns={'thesis_settling_s': row.get('settling'), 'thesis_rise_s': row.get('rise')})


def thesis_steps(node):
    for row in steps(node['table']):
        for integrator in INTEGRATORS if row['controller'] != 'diff_drive' else ('exact',):
            yield functools.partial(thesis_step, row, integrator)


# ---- runs of one loop

def printed(controller, plant, motion, overrides, label=''):
    """Runs of a loop as the thesis prints it, by both integrators unless the run names its own."""
    own = controller == 'diff_drive' or 'controller.integrator' in overrides
    for integrator in (None,) if own else INTEGRATORS:
        yield functools.partial(engine.result, plant, controller, motion,
                                overrides if own else with_integrator(overrides, integrator), True, label)


def computed(name, time, set_speed, speed, believed=math.nan, command=0.0):
    """A drive straight on that is computed and not simulated."""
    nothing = numpy.zeros_like(time)
    return types.SimpleNamespace(
        controller_name=name, time=time, set_speed=nothing + set_speed, set_yaw_rate=nothing, speed=speed, yaw_rate=nothing,
        measured_speed=speed, measured_yaw_rate=nothing, believed_speed=nothing + believed, believed_yaw_rate=nothing,
        command_left=nothing + command, command_right=nothing + command)


def state_space(controller, overrides, height, label):
    """The point mass of chapter 4: its output is the velocity, its belief the belief."""
    motion, values = motions.step(height), engine.settings('box', controller, with_integrator(overrides, 'euler'))
    time, output, belief = step_response(values['controller'], height, motions.STEP_TIME)
    drive = computed('state_space', time + motions.REST, height, output, belief, output / values['geometry']['wheel_radius'])
    row = {'controller': controller, 'plant': 'state_space', 'label': label, **engine.described(values),
           **engine.step_columns(motion), **metrics.response(drive, motion)}
    return row, drive


def listed_steps(node):
    for run in node['runs']:
        label, each = run.get('label', ''), run.get('each', {})
        listed = [run[key] if isinstance(run[key], list) else [run[key]] for key in ('controller', 'plant', 'step')]
        for controller, plant, height, *values in itertools.product(*listed, *each.values()):
            overrides = dict(run.get('set', {}), **dict(zip(each, values)))
            if plant == 'state_space':
                yield functools.partial(state_space, controller, overrides, height, label)
            else:
                yield from printed(controller, plant, motions.step(height), overrides, label)


def squares(node):
    for row in table(node['table'])['rows']:
        motion = motions.square(row['minimum'], row['maximum'], node['period'], node['cycles'])
        for controller in node['controllers']:
            yield from printed(controller, node['plant'], motion, {})


# ---- usable ranges

def search_limit(start, bound, usable):
    """The last usable value on the way from a start to a bound, in steps of a quarter octave, then halved to 0.5 %."""
    stride, before = STRIDE if bound > start else 1.0 / STRIDE, start
    inside = min if bound > start else max
    while before != bound:
        after = inside(before * stride, bound)
        if usable(after):
            before = after
            continue
        while abs(after - before) > PRECISION * abs(before):
            middle = math.sqrt(before * after)
            before, after = (middle, after) if usable(middle) else (before, middle)
        return before
    return bound


def usable(row, integrator, on_plant):
    """The last usable value of a parameter: a step to 0.5 m/s on the plant settles, for kappa_a no later than with the standard one; or
    the belief update alone converges."""
    overrides, motion, key = with_integrator(row['overrides'], integrator), motions.step(0.5), 'controller.' + row['parameter']
    start = engine.settings(row['plant'], row['controller'], overrides)['controller'][row['parameter']]

    def respond(value):
        return engine.result(row['plant'], row['controller'], motion, dict(overrides, **{key: value}), True)[0]

    longest = (respond(start)['settling_s'] or 0.0) if row['parameter'] == 'kappa_a' else motions.STEP_TIME

    def is_usable(value):
        if not on_plant:
            return belief_converges(row['controller'], dict(overrides, **{key: value}))
        found = respond(value)
        return bool(found['bounded'] and found['settling_s'] is not None and found['settling_s'] <= longest)

    limit = search_limit(start, LEAST if row['limit'] == 'minimum' else MOST, is_usable)
    if on_plant:
        return respond(limit), None
    values = engine.settings('box', row['controller'], dict(overrides, **{key: limit}))
    return {'controller': row['controller'], 'bounded': True, **engine.described(values)}, None


def usable_ranges(node):
    for row, integrator in itertools.product(steps(node['table']), INTEGRATORS):
        for on_plant in (True, False) if row['parameter'] != 'kappa_a' else (True,):
            yield functools.partial(usable, row, integrator, on_plant)


# ---- beyond the thesis

def plant_limit(plant, motion, label):
    """Bound of every controller without preview: the set points of both sides after the dead time, within the acceleration limit."""
    values = engine.settings(plant, 'predictive')
    largest, delay = values['plant']['acceleration_limit'] * motions.TICK, values['plant']['dead_time']
    half = 0.5 * (values['plant_model']['effective_track'] or values['geometry']['effective_track'])
    time = numpy.arange(int(round(motion.duration / motions.TICK))) * motions.TICK
    wanted = numpy.array([motion.at(t) for t in time.tolist()])
    sides, left, right = numpy.zeros_like(wanted), 0.0, 0.0
    for i, t in enumerate(time.tolist()):
        forward, yaw_rate = motion.at(t - delay)
        left += max(-largest, min(largest, forward - half * yaw_rate - left))
        right += max(-largest, min(largest, forward + half * yaw_rate - right))
        sides[i] = left, right
    drive = computed('diff_drive', time, wanted[:, 0], sides.mean(axis=1))
    drive.set_yaw_rate, drive.yaw_rate = wanted[:, 1], (sides[:, 1] - sides[:, 0]) / (2.0 * half)
    row = {'controller': 'plant_limit', 'plant': plant, 'label': label, **engine.step_columns(motion),
           **metrics.response(drive, motion), **metrics.errors(drive, motion)}
    return row, drive


def kalman_filter(plant, motion, label):
    """The same drive by `predictive`, with the estimate of a Kalman filter instead of the belief."""
    row, drive = engine.result(plant, 'predictive', motion, label=label)
    drive.sampled = numpy.isin(drive.time, engine.drive(plant, 'predictive', motion, samples_only=True).time)
    drive.believed_speed, drive.believed_yaw_rate = kalman.filtered(drive, engine.settings(plant, 'predictive'), TRUE_TRACK)
    return dict(row, controller='kalman_filter', **metrics.errors(drive, motion)), drive


def comparison(node):
    for case in node['cases']:
        unknown = set(case) - {'label', 'profile', 'set', 'set_for', 'plants'}
        if unknown:
            raise ValueError("case: unknown key '{}'".format(sorted(unknown)[0]))
        motion, label = motions.read(case.get('profile', node.get('profile'))), case.get('label', '')
        for plant, controller in itertools.product(case.get('plants', node['plants']), node['controllers']):
            overrides = {**node.get('set', {}), **case.get('set', {}), **case.get('set_for', {}).get(controller, {})}
            if controller in COMPUTED:
                yield functools.partial(COMPUTED[controller], plant, motion, label)
            else:
                yield functools.partial(engine.result, plant, controller, motion, overrides, False, label, True)


COMPUTED = {'plant_limit': plant_limit, 'kalman_filter': kalman_filter}
KINDS = {'thesis_steps': thesis_steps, 'steps': listed_steps, 'squares': squares, 'usable_range': usable_ranges,
         'comparison': comparison}


# ---- experiments

def experiments():
    """All experiments of scenarios.yaml, in order."""
    return engine.read_yaml('sim/lab/scenarios.yaml')['experiments']


def experiment(name):
    for node in experiments():
        if node['name'] == name:
            return node
    raise ValueError("experiment = '{}': unknown; known: all, {}".format(name, ', '.join(node['name'] for node in experiments())))


def runs(node):
    """The drives of an experiment: functions that return a row and the drive (None for a search)."""
    if node['kind'] not in KINDS:
        raise ValueError("kind = '{}': unknown; known: {}".format(node['kind'], ', '.join(KINDS)))
    return list(KINDS[node['kind']](node))


def numbered(item):
    """Runs one drive of a campaign: its row, and its trace if it is no search."""
    name, index, run = item
    row, drive = run()
    row['experiment'] = name
    return row, engine.trace(index, row.get('label', ''), drive) if drive is not None else None


def results(name, jobs=0):
    """The results of an experiment as a table (pandas.DataFrame)."""
    items = [(name, index, run) for index, run in enumerate(runs(experiment(name)))]
    return engine.frame([row for row, _ in engine.parallel(numbered, items, jobs, name)])


def run(names, out, jobs=0):
    """Runs experiments and writes NAME.csv and NAME_traces.csv into a directory."""
    out = engine.directory(out)
    items = [(name, index, found) for name in names for index, found in enumerate(runs(experiment(name)))]
    found = engine.parallel(numbered, items, jobs, 'experiments')
    for name in names:
        rows, traces = zip(*(result for item, result in zip(items, found) if item[0] == name))
        driven = [trace for trace in traces if trace is not None] or [pandas.DataFrame(columns=engine.TRACE_COLUMNS)]
        engine.write(out / (name + '.csv'), engine.csv_text(engine.frame(rows)))
        engine.write(out / (name + '_traces.csv'), engine.csv_text(pandas.concat(driven)))
    return engine.frame([row for row, _ in found])
