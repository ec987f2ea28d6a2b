#!/usr/bin/python3
"""One HTML page with every table and figure of the thesis next to ours.

Usage: thesis_report.py RESULTS OUTPUT.html
Reads what `experiments run all --out RESULTS` wrote. The page needs no other file; the same results give the same bytes.
"""

import argparse
import itertools
import math
import multiprocessing
import pathlib
import sys

import answers
import bars
import claims
import figures
import hypothesis
import studies
from markup import cell, fixed, rendered, seconds, table
from results import Results

# What the fit has to reach, as mean |ln(ours/thesis)|: tables, how they were used, name of the bar.
BARS = [
    (('5-1', '5-2', '5-4', '5-5', '5-6', '5-9'), 'box', 'box'),
    (('3-1a', '3-1b'), 'ground', 'ground'),
    (('3-1a', '3-1b', '5-1', '5-2', '5-4', '5-5', '5-6', '5-9'), 'all tables of step responses', 'all'),
]

FITTED = [  # key of the plant, words, unit
    ('dead_time', 'dead time', 's'),
    ('motor_lag', 'motor lag', 's'),
    ('velocity_loop_integral', 'velocity loop integral', '1/s'),
    ('acceleration_limit', 'acceleration limit', 'm/s²'),
]

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
    if not run.bounded:
        return cell('unstable', style='no')
    return cell(seconds(run[f'{name}_s']))


def theirs(run, name, unstable):
    return cell('unstable' if unstable else seconds(run[f'thesis_{name}_s']))


def residual(run):
    errors = dict(run.errors())
    return [cell(fixed(errors[name], sign=True) if name in errors else '') for name in ('settling', 'rise')]


def step_table(results, name, thesis):
    """Ours and theirs for every row, with both integrators where the thesis' own one cannot run."""
    rows = []
    entries = thesis['rows']
    shared = common(results.runs[name])
    for entry, group in zip(entries, grouped(results.runs[name])):
        compared = figures.comparable(group)[0]
        shown = group if any(not run.bounded for run in group) else [compared]
        for run in shown:
            is_compared = run is compared
            rows.append([
                cell(entry['row'], True, 'key'), cell(entry.get('column', ''), True, 'key'), cell(settings(run, shared), True),
                cell(run['integrator'] or '–', True), ours(run, 'settling'), theirs(run, 'settling', entry.get('unstable')),
                ours(run, 'rise'), theirs(run, 'rise', entry.get('unstable')),
                *(residual(run) if is_compared else [cell(''), cell('')]),
                cell(seconds(run['overshoot_pct']) if run.bounded else ''), cell(note_of(entry), True, 'note')
            ])
    return table(['<row', '<column', '<setting', '<integrator', 'settling ours [s]', 'thesis [s]', 'rise ours [s]', 'thesis [s]',
                  'ln settling', 'ln rise', 'overshoot [%]', '<note'], rows)


def note_of(entry):
    parts = []
    if 'printed' in entry:
        parts.append(f'printed "{entry["printed"]}"')
    if 'note' in entry:
        parts.append(entry['note'])
    return '; '.join(parts)


def grouped(runs):
    """Runs of one condition (both integrators) together, in order."""
    return [list(group) for _, group in itertools.groupby(runs, key=lambda run: run.conditions())]


COLUMNS = (  # of our numbers: column, heading, digits, with a sign
    ('settling_s', 'settling [s]', 2, False), ('rise_s', 'rise [s]', 2, False), ('overshoot_pct', 'overshoot [%]', 1, False),
    ('steady_error_pct', 'steady-state error [%]', 2, True), ('tracking_rms_mps', 'tracking, RMS [m/s]', 3, False),
    ('tracking_rms_radps', '[rad/s]', 3, False), ('belief_rms_mps', 'belief, RMS [m/s]', 4, False), ('belief_rms_radps', '[rad/s]', 4, False),
    ('effective_track', 'learned track [m]', 3, False))


def run_table(runs):
    """Our numbers where the thesis prints none."""
    shared = common(runs)
    shown = [column for column in COLUMNS if any(run[column[0]] is not None for run in runs)]
    rows = [[cell(settings(run, shared), True), cell(run['integrator'] or '–', True)] +
            [cell('unstable' if name == 'settling_s' else '', style='no') if not run.bounded else
             cell('–' if run[name] is None else fixed(run[name], digits, sign)) for name, _, digits, sign in shown] for run in runs]
    return table(['<setting', '<integrator'] + [heading for _, heading, _, _ in shown], rows)


def square_table(runs):
    rows = []
    shared = common(runs)
    for run in runs:
        share = cell(f'{100 * claims.share_reached(run):.0f} %') if run.bounded else cell('unstable', style='no')
        rows.append([cell(settings(run, shared), True), cell(run['integrator'], True), share])
    return table(['<setting', '<integrator', 'largest velocity / set point'], rows)


BOUNDS = {'tau': 1e-5, 'kappa_mu': 1e3, 'kappa_a': 1e3}  # of the search for usable ranges


def limit_text(run, parameter):
    value = run[parameter]
    if abs(value / BOUNDS[parameter] - 1.0) < 1e-6:
        return f'no limit down to {value:g}' if parameter == 'tau' else f'no limit up to {value:g}'
    return f'{value:.3g}'


def range_table(results, thesis):
    """Table 5-7: the thesis' limits and the four that were searched."""
    remaining = iter(results.runs['table_5-7'])
    rows = []
    for entry in thesis['rows']:
        parameter = entry['parameter']
        found = {}
        for integrator in ('euler', 'exact'):
            found[integrator, 'loop'] = limit_text(next(remaining), parameter)
            found[integrator, 'belief'] = '–' if parameter == 'kappa_a' else limit_text(next(remaining), parameter)
        rows.append([cell(figures.NAMES[parameter], True), cell(entry['limit'], True), cell(entry['column'], True), cell(f'{entry["value"]:g}')]
                    + [cell(found[key]) for key in (('euler', 'loop'), ('euler', 'belief'), ('exact', 'loop'), ('exact', 'belief'))])
    return table(['<parameter', '<limit', '<belief update', 'thesis', 'euler, on the plant', 'euler, spectral radius',
                  'exact, on the plant', 'exact, spectral radius'], rows)


def parameter_table(results, thesis):
    """A table of the thesis' controller parameters and our presets."""
    presets = {name: results.config(name)['controller'] for name in ('standard', 'improved')}
    rows = []
    for entry in thesis['rows']:
        for preset in ('standard', 'improved'):
            if preset in entry:
                value = presets[preset][entry['parameter']]
                agrees = value == entry[preset]
                rows.append([cell(entry['parameter'], True), cell(preset, True), cell(str(value)),
                             cell(str(entry[preset])), cell('same' if agrees else 'differs', style='yes' if agrees else 'no'),
                             cell(note_of(entry), True, 'note')])
    return table(['<parameter', '<controller', 'ours', 'thesis', 'agreement', '<note'], rows)


def tested_table(thesis):
    rows = [[cell(figures.NAMES[entry['parameter']], True), cell(', '.join(f'{v:g}' for v in entry['values']), True),
             cell(note_of(entry), True, 'note')] for entry in thesis['rows']]
    return table(['<parameter', '<values', '<note'], rows)


def claim_table(verdicts, name):
    rows = [[cell(place, True, 'key'), cell(text, True),
             cell('agrees' if verdict.agrees else 'differs', style='yes' if verdict.agrees else 'no'),
             cell(verdict.ours, True)] for experiment, place, text, verdict in verdicts if experiment == name]
    return table(['<where', '<the thesis says', 'ours', '<our numbers'], rows)


def figure_groups(experiment):
    """Panels of one figure of the thesis together: 5-3a and 5-3b are figure 5-3."""
    panels = experiment.get('figures', [])
    return [(key, list(group)) for key, group in itertools.groupby(panels, key=lambda p: p['figure'].rstrip('ab'))]


def draw(key):
    """Image of one figure, (experiment, figure)."""
    name, figure = key
    experiment = draw.results.experiments[name]
    return figures.figure_image(draw.results.runs[name], dict(figure_groups(experiment))[figure], experiment['kind'] == 'squares')


def draw_all(results):
    """All images, by experiment and figure, with progress lines as scripts/ read them. The processes inherit the results."""
    draw.results = results
    keys = [(name, figure) for name, experiment in results.experiments.items() for figure, _ in figure_groups(experiment)]
    images = {}
    with multiprocessing.get_context('fork').Pool() as pool:
        for key, image in zip(keys, pool.imap(draw, keys)):
            images[key] = image
            print(f'[{100 * len(images) // len(keys):3d}%] figures', file=sys.stderr, flush=True)
    return images


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
        notes.append(answers.number_of_orders(results).text)
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
            for name, thesis in results.tables.items() if thesis['kind'] in makers]


BEYOND = ('comparison', 'belief_accuracy')  # kinds of experiments that the thesis has not


def reproduced(results):
    """Names of the experiments that reproduce the thesis or its figures."""
    return [name for name, experiment in results.experiments.items() if experiment['kind'] not in BEYOND]


def figures_shown(results):
    """The figures of the thesis that are here, in order."""
    shown = [figure for name in reproduced(results) for figure, _ in figure_groups(results.experiments[name])]
    return list(dict.fromkeys(shown))


def plant_table(results):
    plants = {name: results.config(name)['plant'] for name in ('plant_box', 'plant')}
    rows = [[cell(words, True), cell(f'{plants["plant_box"][key]:g}'), cell(f'{plants["plant"][key]:g}'), cell(unit, True)]
            for key, words, unit in FITTED]
    return table(['<fitted parameter', 'box', 'ground', '<unit'], rows)


REPEATABLE = 0.15  # ln: the thesis' own repeats of one condition differ by more


def errors_of(results, tables):
    """Cells of the errors of some tables: how many, absolute and signed mean, how many within the thesis' own repeatability."""
    errors = results.errors(tables)
    near = sum(1 for error in errors if abs(error) <= REPEATABLE)
    mean = sum(abs(error) for error in errors) / len(errors)
    return mean, [cell(str(len(errors))), cell(f'{mean:.3f}'), cell(fixed(sum(errors) / len(errors), 3, True)), cell(f'{near}')]


def bar_table(results):
    rows = []
    for tables, words, name in BARS:
        bar = results.bars['thesis_fit'][name]
        error, cells = errors_of(results, tables)
        rows.append([cell(', '.join(tables), True), cell(words, True), *cells, cell(f'{bar:.3f}'),
                     cell('met' if error <= bar else 'missed', style='yes' if error <= bar else 'no')])
    for tables in sorted({t for group, _, _ in BARS for t in group}):
        rows.append([cell(tables, True), cell('alone', True), *errors_of(results, [tables])[1], cell(''), cell('')])
    return table(['<tables', '<used as', 'values', 'mean |ln(ours/thesis)|', 'mean ln(ours/thesis)', 'within 15 %', 'bar', 'verdict'], rows)


def fit_sentence(results):
    """Signed errors of the box, and what the fit trades for what."""
    tables = BARS[0][0]

    def errors(what, names):
        return [error for name in names for run in results.comparable(f'table_{name}') for kind, error in run.errors() if kind == what]

    def words(what):
        found = errors(what, tables)
        percent = 100 * math.expm1(sum(found) / len(found))
        return 'right' if abs(percent) < 2 else f'{abs(percent):.0f} % too {"short" if percent < 0 else "long"}'

    settling = errors('settling', tables)
    means = {name: sum(errors('settling', [name])) / len(errors('settling', [name])) for name in tables}
    worst = max(means, key=lambda name: abs(means[name]))
    near = sum(1 for error in settling if abs(error) <= REPEATABLE)
    return (f'On the box our settling times are {words("settling")} on average, most in Table {worst} (mean ln {fixed(means[worst], sign=True)}), '
            f'and our rise times are {words("rise")}: the fit trades one for the other. {near} of {len(settling)} settling times lie within '
            '15 % of the thesis\'.')


def evaluate(results):
    return [(name, place, text, claim(results)) for name, place, text, claim in claims.CLAIMS]


def page(results, images):
    verdicts = evaluate(results)
    sections = {name: experiment_section(results, images, verdicts, name) for name in results.experiments}
    return rendered(tables=list(results.tables), figures=figures_shown(results), plants=plant_table(results), bars=bar_table(results),
                    answers=answers.answered(results), fit=fit_sentence(results), verdicts=verdicts,
                    agreed=sum(verdict.agrees for *_, verdict in verdicts), data=data_sections(results),
                    experiments=[sections[name] for name in reproduced(results)],
                    beyond=[section for name, section in sections.items() if name not in reproduced(results)],
                    beyond_bars=bars.bar_table(results), studies=list(studies.sections(results)))


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
