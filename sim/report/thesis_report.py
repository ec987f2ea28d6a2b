#!/usr/bin/python3
"""One HTML page with every table and figure of the thesis next to ours.

Usage: thesis_report.py RESULTS OUTPUT.html
Reads what `experiments run all --out RESULTS` wrote. The page needs no other file; the same results give the same bytes.
"""

import argparse
import itertools
import pathlib
import sys

import answers
import bars
import claims
import figures
import hypothesis
from markup import fixed, rendered
from results import Results, engine, thesis as lab

# What the fit has to reach, as mean |ln(ours/thesis)|: tables, how they were used, name of the bar.
BARS = [
    (('5-1', '5-2', '5-4', '5-5', '5-6', '5-9'), 'box', 'box'),
    (('3-1a', '3-1b'), 'ground', 'ground'),
    (('3-1a', '3-1b', '5-1', '5-2', '5-4', '5-5', '5-6', '5-9'), 'all tables of step responses', 'all'),
]

COLUMNS = (  # of our numbers: column, heading, digits, with a sign
    ('settling_s', 'settling [s]', 2, False), ('rise_s', 'rise [s]', 2, False), ('overshoot_pct', 'overshoot [%]', 1, False),
    ('steady_error_pct', 'steady-state error [%]', 2, True), ('tracking_rms_mps', 'tracking, RMS [m/s]', 3, False),
    ('tracking_rms_radps', 'tracking, RMS [rad/s]', 3, False), ('belief_rms_mps', 'belief, RMS [m/s]', 4, False),
    ('belief_rms_radps', 'belief, RMS [rad/s]', 4, False), ('effective_track', 'learned track [m]', 3, False))

REPEATABLE = 0.15  # ln: the thesis' own repeats of one condition differ by more
FITTED = {'dead_time': 's', 'motor_lag': 's', 'velocity_loop_integral': '1/s', 'acceleration_limit': 'm/s²'}  # keys of the plant, and units

GAINS = (('belief_hz', 'belief {:g} Hz'), ('action_hz', 'action {:g} Hz'), ('tau', 'τ {:g}'), ('kappa_mu', 'κ_μ {:g}'), ('kappa_a', 'κ_a {:g}'),
         ('orders', 'p {:g}'))


def conditions(run):
    """The conditions of a run in words."""
    parts = [figures.WORDS.get(run['controller'], run['controller']), figures.WORDS.get(run['plant'], run['plant'] or 'belief update alone')]
    parts += [f'{run[column]:g} {unit}' for column, unit in (('step_mps', 'm/s'), ('step_radps', 'rad/s')) if run[column]]
    parts += [words.format(run[column]) for column, words in GAINS if run[column] is not None]
    if run.label:
        parts.append(run.label)
    return parts


def common(runs):
    """Conditions that all runs of a table share."""
    shared = set(conditions(runs[0])).intersection(*(conditions(run) for run in runs))
    return [part for part in conditions(runs[0]) if part in shared]


def settings(run, shared=()):
    """The conditions of a run in words, but for those that all of its table share."""
    return ', '.join(part for part in conditions(run) if part not in shared) or '–'


def ours(run, name):
    return fixed(run[f'{name}_s']) if run.bounded else 'unstable'


def step_table(results, name, thesis):
    """Ours and theirs for every row, with both integrators where the thesis' own one cannot run."""
    rows, shared = [], common(results.runs[name])
    groups = itertools.groupby(results.runs[name], key=lambda run: run.conditions())  # by both integrators
    for entry, group in zip(thesis['rows'], [list(found) for _, found in groups]):
        compared = figures.comparable(group)[0]
        for run in group if any(not run.bounded for run in group) else [compared]:
            theirs = {kind: 'unstable' if entry.get('unstable') else fixed(run[f'thesis_{kind}_s']) for kind in ('settling', 'rise')}
            errors = dict(run.errors()) if run is compared else {}
            rows.append({
                'row': entry['row'], 'column': entry.get('column', ''), 'setting': settings(run, shared), 'integrator': run['integrator'] or '–',
                'settling ours [s]': ours(run, 'settling'), 'settling thesis [s]': theirs['settling'], 'rise ours [s]': ours(run, 'rise'),
                'rise thesis [s]': theirs['rise'],
                **{'ln ' + kind: fixed(errors[kind], sign=True) if kind in errors else '' for kind in theirs},
                'overshoot [%]': fixed(run['overshoot_pct']) if run.bounded else '', 'note': note_of(entry)})
    return rows


def note_of(entry):
    printed = [f'printed "{entry["printed"]}"'] if 'printed' in entry else []
    return '; '.join(printed + [entry['note']] if 'note' in entry else printed)


def run_table(runs):
    """Our numbers where the thesis prints none."""
    shared, shown = common(runs), [column for column in COLUMNS if any(run[column[0]] is not None for run in runs)]
    return [{'setting': settings(run, shared), 'integrator': run['integrator'] or '–',
             **{heading: fixed(run[name], digits, sign) if run.bounded else 'unstable' if name == 'settling_s' else ''
                for name, heading, digits, sign in shown}} for run in runs]


def square_table(runs):
    shared = common(runs)
    return [{'setting': settings(run, shared), 'integrator': run['integrator'],
             'largest velocity / set point': f'{100 * claims.share_reached(run):.0f} %' if run.bounded else 'unstable'} for run in runs]


def limit_text(run, parameter):
    value = run[parameter]
    if value in (lab.LEAST, lab.MOST):
        return f'no limit down to {value:g}' if parameter == 'tau' else f'no limit up to {value:g}'
    return f'{value:.3g}'


def range_table(results, thesis):
    """Table 5-7: the thesis' limits and the four that were searched."""
    remaining, rows = iter(results.runs['table_5-7']), []
    for entry in thesis['rows']:
        parameter = entry['parameter']
        row = {'parameter': figures.NAMES[parameter], 'limit': entry['limit'], 'belief update': entry['column'], 'thesis': f'{entry["value"]:g}'}
        for integrator in ('euler', 'exact'):
            row[integrator + ', on the plant'] = limit_text(next(remaining), parameter)
            row[integrator + ', spectral radius'] = '–' if parameter == 'kappa_a' else limit_text(next(remaining), parameter)
        rows.append(row)
    return rows


def parameter_table(results, thesis):
    """A table of the thesis' controller parameters and our presets."""
    rows = []
    for entry, preset in itertools.product(thesis['rows'], ('standard', 'improved')):
        if preset in entry:
            value = results.config(preset)['controller'][entry['parameter']]
            rows.append({'parameter': entry['parameter'], 'controller': preset, 'ours': str(value), 'thesis': str(entry[preset]),
                         'agreement': 'same' if value == entry[preset] else 'differs', 'note': note_of(entry)})
    return rows


def tested_table(thesis):
    return [{'parameter': figures.NAMES[entry['parameter']], 'values': ', '.join(f'{v:g}' for v in entry['values']), 'note': note_of(entry)}
            for entry in thesis['rows']]


def claim_table(verdicts, name):
    return [{'where': place, 'the thesis says': text, 'ours': 'agrees' if verdict.agrees else 'differs', 'our numbers': verdict.ours}
            for experiment, place, text, verdict in verdicts if experiment == name]


def figure_groups(experiment):
    """The panels of each figure."""
    panels = [dict(figure, **part) for figure in experiment.get('figures', ()) for part in figure.get('parts', [{}])]
    return [(key, list(group)) for key, group in itertools.groupby(panels, key=lambda panel: panel['figure'])]


def draw_all(results):
    """All images, by experiment and figure."""
    items = {(name, figure): (results.runs[name], panels, experiment['kind'] == 'squares')
             for name, experiment in results.experiments.items() for figure, panels in figure_groups(experiment)}
    return dict(zip(items, engine.parallel(figures.figure_image, items.values(), title='figures')))


def figure_section(results, images, name):
    """Title, image and notes of each figure of an experiment."""
    section = []
    for figure, panels in figure_groups(results.experiments[name]):
        image, diverges = images[name, figure]
        notes = []
        if any(p['signal'] == 'measured' for p in panels):
            notes.append('Dashed: set point. Full marker: our settling time; open: the thesis\'.')
        if diverges:
            notes.append('A diverging belief is drawn on a logarithmic axis until it leaves the numbers of the machine.')
        section.append({'title': f'Figure {figure}', 'image': image, 'notes': ' '.join(notes)})
    return section


def numbers_of(results, name):
    """The table of an experiment, by its kind."""
    experiment = results.experiments[name]
    runs = results.runs[name]
    if experiment['kind'] == 'thesis_steps':
        return step_table(results, name, results.tables[experiment['table']])
    if experiment['kind'] == 'usable_range':
        return range_table(results, results.tables[experiment['table']])
    if experiment['kind'] == 'squares':
        return square_table(runs)
    return run_table(runs)


def notes_of(results, name):
    experiment = results.experiments[name]
    notes = [experiment.get('note'), results.tables[experiment['table']].get('note') if 'table' in experiment else None]
    if experiment['kind'] == 'squares':
        notes.append(f'Ours: period {experiment["period"]} s, {experiment["cycles"]} periods.')
    shared = common(results.runs[name])
    if shared and experiment['kind'] != 'usable_range':
        notes.append('In all rows: ' + ', '.join(shared) + '.')
    if name == 'orders':
        notes.append(answers.number_of_orders(results).ours)
    return [note for note in notes if note]


def experiment_section(results, images, verdicts, name):
    experiment = results.experiments[name]
    heading = f'Table {experiment["table"]}: ' if 'table' in experiment else ''
    return {'name': name, 'title': heading + experiment['title'], 'notes': notes_of(results, name), 'numbers': numbers_of(results, name),
            'claims': claim_table(verdicts, name), 'hypothesis': hypothesis.section(results) if name == 'table_5-7' else None,
            'figures': figure_section(results, images, name)}


def data_sections(results):
    """The tables of the thesis that hold settings, no results."""
    makers = {'tested_values': tested_table, 'controller_parameters': lambda thesis: parameter_table(results, thesis)}
    return [{'name': name, 'title': thesis['title'], 'table': makers[thesis['kind']](thesis)}
            for name, thesis in results.tables.items() if thesis.get('kind') in makers]


def reproduced(results):
    """Names of the experiments that reproduce the thesis or its figures."""
    return [name for name, experiment in results.experiments.items() if experiment['kind'] != 'comparison']


def figures_shown(results):
    """The figures of the thesis that are here, in order."""
    shown = [figure for name in reproduced(results) for figure, _ in figure_groups(results.experiments[name])]
    return list(dict.fromkeys(shown))


def plant_table(results):
    box, ground = (results.config(name)['plant'] for name in ('plant_box', 'plant'))
    return [{'fitted parameter': key.replace('_', ' '), 'box': f'{box[key]:g}', 'ground': f'{ground[key]:g}', 'unit': unit}
            for key, unit in FITTED.items()]


def bar_table(results):
    """Errors of the tables of step responses, together and alone; the signs tell what the fit trades for what."""
    whole = [(*group, figure) for group in BARS for figure in (None, 'settling', 'rise')]
    rows = []
    for tables, words, name, figure in whole + [((name,), 'alone', None, figure) for name in sorted(BARS[-1][0]) for figure in (None, 'settling')]:
        errors = results.errors(tables, figure)
        mean, bar = sum(map(abs, errors)) / len(errors), results.bars['thesis_fit'].get(name if figure is None else None)
        rows.append({'tables': ', '.join(tables), 'used as': words, 'figure': figure or 'both', 'values': len(errors),
                     'mean |ln(ours/thesis)|': f'{mean:.3f}', 'mean ln(ours/thesis)': fixed(sum(errors) / len(errors), 3, True),
                     'within 15 %': sum(abs(error) <= REPEATABLE for error in errors), 'bar': f'{bar:.3f}' if bar else '',
                     'verdict': '' if not bar else 'met' if mean <= bar else 'missed'})
    return rows


def evaluate(results):
    return [(name, place, text, claim(results)) for name, place, text, claim in claims.CLAIMS]


def page(results, images):
    verdicts = evaluate(results)
    sections = {name: experiment_section(results, images, verdicts, name) for name in results.experiments}
    return rendered(tables=list(results.tables), figures=figures_shown(results), plants=plant_table(results), bars=bar_table(results),
                    answers=answers.answered(results), verdicts=verdicts,
                    agreed=sum(verdict.agrees for *_, verdict in verdicts), data=data_sections(results),
                    experiments=[sections[name] for name in reproduced(results)],
                    beyond=[section for name, section in sections.items() if name not in reproduced(results)],
                    beyond_bars=bars.bar_table(results))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n', maxsplit=1)[0])
    parser.add_argument('results', help='directory with the CSV files of the experiments')
    parser.add_argument('output', help='HTML file to write')
    arguments = parser.parse_args()
    try:
        results = Results(arguments.results)
        text = page(results, draw_all(results))
        pathlib.Path(arguments.output).write_text(text)
    except (ValueError, OSError) as error:
        sys.exit(f'thesis_report: {error}')


if __name__ == '__main__':
    main()
