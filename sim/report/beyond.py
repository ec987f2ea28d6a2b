"""The section "Beyond the thesis": the predictive controller compared with the others, and its bars."""

import itertools
import statistics

import figures
from markup import cell, fixed, link, table
from beyond_bars import BARS

KINDS = ('comparison', 'perturbations', 'perturbation_pairs', 'belief_accuracy')  # of the experiments shown here

WORST = 10  # pairs listed

def beyond(results):
    """Names of the experiments shown here, in order."""
    return [name for name, experiment in results.experiments.items() if experiment['kind'] in KINDS]


def word(name):
    return figures.WORDS.get(name, name)


def figure(value, digits=2, ok=True, sign=False):
    """A number as a cell, in red where it misses its bar."""
    if value is None:
        return cell('never' if not ok else '–', style='' if ok else 'no')
    return cell(fixed(value, digits, sign), style='' if ok else 'no')


def by_case(runs):
    """(plant, case): {controller: run}, plant by plant. A case is named by its label, and by its steps if labels repeat."""
    labels = [run.label for run in runs if (run['plant'], run['controller']) == (runs[0]['plant'], runs[0]['controller'])]
    told_by_label = len(set(labels)) == len(labels)
    cases = {}
    for run in sorted(runs, key=lambda run: run['plant']):
        steps = ' and '.join(f'{run[column]:g} {unit}' for column, unit in (('step_mps', 'm/s'), ('step_radps', 'rad/s')) if run[column])
        case = ', '.join(filter(None, ['' if told_by_label and run.label else steps, run.label]))
        cases.setdefault((run['plant'], case), {})[run['controller']] = run
    return cases


def controllers_of(runs):
    return list(dict.fromkeys(run['controller'] for run in runs))


def wide_table(runs, columns):
    """A row per case, for each controller a group of cells. columns: heading, function of (run, runs of the case)."""
    controllers = controllers_of(runs)
    headings = ['<plant', '<case'] + [heading for _ in controllers for heading, _ in columns]
    groups = [('', 2)] + [(word(controller), len(columns)) for controller in controllers]
    rows = []
    for (plant, case), group in by_case(runs).items():
        cells = [cell(plant, True), cell(case, True)]
        for controller in controllers:
            run = group.get(controller)
            cells += [content(run, group) if run else cell('') for _, content in columns]
        rows.append(cells)
    return table(headings, rows, groups)


def settling_bar(limit):
    """Content of a settling time; limit: of the predictive controller, from the runs of the case [s]."""

    def content(run, group):
        if not run.bounded:
            return cell('unstable', style='no')
        settling = run['settling_s']
        is_ours = run['controller'] == 'predictive'
        return figure(settling, 2, not is_ours or (settling is not None and settling <= limit(group)))

    return content


def bounded(column, digits, bar=None, sign=False):
    """Content of a figure whose size the predictive controller has to keep within a bar, if there is one."""

    def content(run, _):
        value = run[column]
        has_bar = bar is not None and run['controller'] == 'predictive'
        return figure(value, digits, not has_bar or (value is not None and abs(value) <= bar), sign)

    return content


def overshoot(bar=None):
    return bounded('overshoot_pct', 1, bar)


def steady_error(bar=None):
    return bounded('steady_error_pct', 2, bar, True)


def steps_table(results, name):
    bars = results.bars['predictive_steps']
    limit = lambda group: bars['settling_over_open_loop'] * group['diff_drive']['settling_s']
    return wide_table(results.runs[name], [('settling [s]', settling_bar(limit)), ('overshoot [%]', overshoot(bars['overshoot'])),
                                           ('error [%]', steady_error(bars['steady_error']))])


def perturbation_table(results, name):
    bars = results.bars['predictive_perturbations']
    return wide_table(results.runs[name], [('settling [s]', settling_bar(lambda _: bars['settling'])), ('overshoot [%]', overshoot()),
                                           ('error [%]', steady_error(bars['steady_error']))])


def pair_table(results, name):
    rows = []
    for (plant, controller), group in itertools.groupby(results.runs[name], key=lambda run: (run['plant'], run['controller'])):
        runs = list(group)
        stable = [run for run in runs if run.bounded]
        times = [run['settling_s'] if run['settling_s'] is not None else float('inf') for run in stable]
        rows.append([cell(plant, True), cell(word(controller), True), cell(str(len(runs))),
                     cell(str(len(runs) - len(stable)), style='no' if len(stable) < len(runs) else ''),
                     *(cell(str(sum(t <= bound for t in times))) for bound in (0.5, 0.8, 1.0)),
                     figure(statistics.median(times) if times else None), figure(max(times, default=None)),
                     figure(max((abs(run['steady_error_pct']) for run in stable), default=None))])
    counts = table(['<plant', '<controller', 'pairs', 'unstable', 'settled in 0.5 s', 'in 0.8 s', 'in 1.0 s', 'median [s]',
                    'slowest [s]', 'largest error [%]'], rows)
    return [('', counts), (f'The {WORST} slowest of the predictive controller:', worst_pairs(results.runs[name]))]


def worst_pairs(runs):
    ours = [run for run in runs if run['controller'] == 'predictive']
    ours.sort(key=lambda run: run['settling_s'] if run.bounded and run['settling_s'] is not None else float('inf'), reverse=True)
    rows = [[cell(run['plant'], True), cell(run.label, True),
             figure(run['settling_s']) if run.bounded else cell('unstable', style='no'), figure(run['overshoot_pct'], 1),
             figure(run['steady_error_pct'], 2, sign=True)] for run in ours[:WORST]]
    return table(['<plant', '<pair', 'settling [s]', 'overshoot [%]', 'error [%]'], rows)


def square_table(results, name):
    rms = lambda run, _: figure(run['tracking_rms_mps'], 3)
    ratio = lambda run, group: figure(run['tracking_rms_mps'] / group['improved']['tracking_rms_mps'], 2,
                                      run['controller'] != 'predictive'
                                      or run['tracking_rms_mps'] <= 0.7 * group['improved']['tracking_rms_mps'])
    return wide_table(results.runs[name], [('RMS error [m/s]', rms), ('/ improved', ratio)])


def slip_table(results, name):
    bias = lambda run, _: figure(run['belief_bias_pct'], 1, sign=True)
    return wide_table(results.runs[name], [('error of the yaw rate [%]', steady_error(2.0)), ('of its belief [%]', bias)])


def belief_table(results, name):
    rows = []
    for run in results.runs[name]:
        reference = next(r for r in results.runs[name] if r['controller'] == 'kalman_filter' and r['plant'] == run['plant'])
        cells = [cell(run['plant'], True), cell(word(run['controller']), True)]
        for column in ('belief_rms_mps', 'belief_rms_radps'):
            ratio = run[column] / reference[column]
            cells += [cell(f'{run[column]:.4f}'), figure(ratio, 2, run['controller'] != 'predictive' or ratio <= 1.05)]
        rows.append(cells)
    return table(['<plant', '<belief of', 'forward speed, RMS [m/s]', '/ Kalman filter', 'yaw rate, RMS [rad/s]', '/ Kalman filter'], rows)


def rate_table(results, name):
    rows = [[cell(run['plant'], True), cell(f'{run["belief_hz"]:g}'), figure(run['settling_s'], 3), figure(run['overshoot_pct'], 1),
             figure(run['steady_error_pct'], 2, sign=True)] for run in results.runs[name]]
    return table(['<plant', 'belief [Hz]', 'settling [s]', 'overshoot [%]', 'error [%]'], rows)


def sliding_table(results, name):
    rows = [[cell(run.label, True), figure(run['effective_track'], 3),
             *(cell(f'{run[column]:.4f}') for column in ('belief_rms_mps', 'belief_rms_radps', 'tracking_rms_mps', 'tracking_rms_radps'))]
            for run in results.runs[name]]
    return table(['<case', 'effective track [m]', 'speed [m/s]', 'yaw rate [rad/s]', 'speed [m/s]', 'yaw rate [rad/s]'], rows,
                 [('', 1), ('believed', 1), ('error of the belief, RMS', 2), ('tracking error, RMS', 2)])


TABLES = {
    'predictive_steps': steps_table,
    'predictive_perturbations': perturbation_table,
    'predictive_pairs': pair_table,
    'predictive_squares': square_table,
    'predictive_rates': rate_table,
    'belief_accuracy': belief_table,
    'slip_turns': slip_table,
    'sliding_speed': sliding_table,
    'slip_straight': perturbation_table,
}


def tables_of(results, name):
    """The tables of an experiment, each with the words above it."""
    tables = TABLES[name](results, name)
    return [{'words': words, 'table': numbers} for words, numbers in (tables if isinstance(tables, list) else [('', tables)])]


def bar_table(results):
    rows = []
    for name, text, judge in BARS:
        met, reached = judge(results)
        rows.append([cell(link(name, results.experiments[name]['title']), True), cell(text.format(**results.bars[name]), True) if name in results.bars else cell(text, True),
                     cell('met' if met else 'missed', True, 'yes' if met else 'no'), cell(reached, True)])
    return table(['<experiment', '<bar', '<verdict', '<reached'], rows)


def section(results, images):
    """Everything beyond the thesis. images: by (experiment, figure)."""
    sections = []
    for name in beyond(results):
        experiment = results.experiments[name]
        shown = [(title, image) for (owner, title), (image, _) in images.items() if owner == name]
        sections.append({'name': name, 'title': experiment['title'], 'note': experiment.get('note'), 'tables': tables_of(results, name),
                         'images': shown})
    return {'bars': bar_table(results), 'sections': sections}
