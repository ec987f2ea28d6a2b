"""Statements of the thesis about its tables and figures, and the verdict of our runs."""

import math
import typing

RATES = (50.0, 1000.0)  # Hz, of the belief update
LIMITS = {'tau': 'τ', 'kappa_mu': 'κ_μ'}


class Verdict(typing.NamedTuple):
    """Whether our runs agree, and our numbers in a sentence."""

    agrees: bool
    ours: str


def select(runs, **wanted):
    """The runs with these values."""
    return [run for run in runs if all(matches(run[column], value) for column, value in wanted.items())]


def pick(runs, **wanted):
    """The only run with these values."""
    found = select(runs, **wanted)
    if len(found) != 1:
        raise LookupError(f'{len(found)} runs with {wanted}')
    return found[0]


def by(runs, parameter, reverse=False, **wanted):
    """The runs with these values, sorted by a parameter."""
    return sorted(select(runs, **wanted), key=lambda run: run[parameter], reverse=reverse)


def matches(a, b):
    return math.isclose(a, b, rel_tol=1e-9) if isinstance(a, float) and not isinstance(b, str) else a == b


def seconds(value):
    return f'{value:.2f} s' if value is not None else 'never'


def pair(run):
    return f'{seconds(run["settling_s"])} / {seconds(run["rise_s"])}'


def is_less(a, b):
    """Less by more than 2 %; smaller differences count as equal."""
    return a is not None and b is not None and a < 0.98 * b


def falls(values):
    return all(is_less(b, a) for a, b in zip(values, values[1:]))


def final_command(run):
    return run.series('command')[1][-50:].mean()


def about(check):
    """Makes check(results, about what) a function of what it is about, whose result is a function of the results."""
    return lambda *what, **wanted: lambda results: check(results, *what, **wanted)


@about
def faster(results, winner, loser, cases, columns=('settling_s', 'rise_s')):
    """In each case the winner is less in all columns. winner, loser: experiment, words and values that select the run."""
    parts, agrees = [], True
    for case in cases:
        first, second = (pick(results.comparable(name), **wanted, **case) for name, _, wanted in (winner, loser))
        agrees &= all(is_less(first[column], second[column]) for column in columns)
        parts.append(', '.join([f'{value:g}' if isinstance(value, float) else value for value in case.values()] +
                               [f'{winner[1]} {pair(first)}, {loser[1]} {pair(second)}']))
    return Verdict(agrees, '; '.join(parts))


@about
def settles_high(results, name, words, **wanted):
    """The differential drive ends above its set point."""
    errors = [run['steady_error_pct'] for run in select(results.comparable(name), controller='diff_drive', **wanted)]
    return Verdict(all(e > 1.0 for e in errors), 'steady-state error ' + ', '.join(f'{e:+.2f} %' for e in errors) + words)


def ground_and_box(results):
    ground, box = (pick(results.comparable('figure_4-1'), plant=plant) for plant in ('ground', 'box'))
    ratio = ground['settling_s'] / box['settling_s']
    return Verdict(abs(math.log(ratio)) < 0.2, f'{pair(ground)} on the ground, {pair(box)} on the box')


def ground_needs_more(results):
    ground, box = (final_command(pick(results.comparable('figure_4-1'), plant=plant)) for plant in ('ground', 'box'))
    return Verdict(ground > 1.005 * box, f'{ground:.3f} rad/s on the ground, {box:.3f} rad/s on the box '
                   '(our velocity loop has no offset under load)')


@about
def model_follows(results, name, parameter):
    """Compares the rise times of model and robot: equal within a fifth at every value."""
    model, robot = ([run['rise_s'] for run in by(results.comparable(name), parameter, parameter == 'tau', plant=plant)]
                    for plant in ('state_space', 'box'))
    ratios = [ours / theirs for ours, theirs in zip(robot, model)]
    return Verdict(falls(model) and falls(robot) and all(abs(math.log(ratio)) < 0.2 for ratio in ratios),
                   '; '.join(f'{words} rise ' + ', '.join(map(seconds, rises)) for words, rises in (('model', model), ('robot', robot))) +
                   '; robot / model ' + ', '.join(f'{ratio:.2f}' for ratio in ratios))


def model_stays_stable(results):
    runs = results.runs['figure_4-4']
    model = pick(runs, plant='state_space')
    rings = all(not run.bounded or run['settling_s'] is None for run in select(runs, plant='box'))
    return Verdict(model.bounded and rings, f'model settles in {seconds(model["settling_s"])}; robot ' +
                   ('never settles' if rings else 'settles'))


def action_trails(results):
    run = results.runs['figure_4-5'][0]
    first = [run.trace['time_s'][run.trace[column] != 0.0].iloc[0] for column in ('belief_mps', 'velocity_mps')]
    return Verdict(math.isclose(first[1] - first[0], 0.1, abs_tol=1e-6),
                   f'belief moves at {first[0] - 0.5:.1f} s, action at {first[1] - 0.5:.1f} s after the step')


@about
def with_euler(results, name, stable, words='', **wanted):
    """Whether the runs with the thesis' own integrator are all stable, or all unstable."""
    euler, exact = (select(results.runs[name], integrator=integrator, **wanted) for integrator in ('euler', 'exact'))
    return Verdict(all(run.bounded == stable for run in euler),
                   f'euler {"settles" if euler[0].bounded else "diverges" + words}; exact {pair(exact[0])}')


def spreads(results, name):
    """Longest settling time / shortest, minus 1, over the frequencies of a table, at 0.3, 0.5 and 1 m/s."""
    times = [[run['settling_s'] for run in select(results.comparable(name), step_mps=step)] for step in (0.3, 0.5, 1.0)]
    return [max(found) / min(found) - 1.0 for found in times]


@about
def frequency_alone(results, name):
    found = spreads(results, name)
    return Verdict(max(found) < 0.15, 'settling varies by ' + ', '.join(f'{100 * s:.0f} %' for s in found) + ' at 0.3, 0.5, 1 m/s')


@about
def gets_faster(results, name, parameter, columns, reverse):
    parts, agrees = [], True
    for rate in RATES:
        runs = [run for run in by(results.comparable(name), parameter, reverse, belief_hz=rate) if run['thesis_settling_s']]
        for column in columns:
            values = [run[column] for run in runs]
            agrees &= is_less(values[-1], values[0])
            parts.append(f'{rate:.0f} Hz {column.split("_")[0]} ' + ', '.join(map(seconds, values)))
    return Verdict(agrees, '; '.join(parts))


def rings(results):
    times = {rate: [run['settling_s'] for run in by(results.comparable('table_5-6'), 'kappa_a', belief_hz=rate)] for rate in RATES}
    return Verdict(all(is_less(t[1], t[0]) and is_less(t[0], t[3]) for t in times.values()),
                   'κ_a 8, 10, 15, 20: ' + '; '.join(f'{rate:.0f} Hz settling ' + ', '.join(map(seconds, t)) for rate, t in times.items()))


def slow_rings_more(results):
    slow, fast = (pick(results.comparable('table_5-6'), kappa_a=20.0, belief_hz=rate)['overshoot_pct'] for rate in RATES)
    return Verdict(slow > fast, f'overshoot {slow:.0f} % at 50 Hz, {fast:.0f} % at 1 kHz')


def share_reached(run):
    """Largest velocity over the largest set point."""
    return run.trace['velocity_mps'].max() / run.trace['set_point_mps'].max()


def square_waves(results):
    standard, improved = ([share_reached(run) for run in select(results.comparable('table_5-10'), controller=controller)]
                          for controller in ('standard', 'improved'))
    words = 'largest velocity / set point: standard {}, improved {}'.format(
        *(', '.join(f'{100 * s:.0f} %' for s in shares) for shares in (standard, improved)))
    return Verdict(max(standard) < 0.99 <= min(improved), words)


def limits(results, parameter, integrator='euler'):
    """(rate [Hz], ours of the belief update alone, the thesis') of Table 5-7."""
    standard = results.config('standard')['controller'][parameter]
    searched = [run for run in select(results.runs['table_5-7'], integrator=integrator, plant=None) if run[parameter] != standard]
    return [(entry['set']['belief_rate'], pick(searched, belief_hz=float(entry['set']['belief_rate']))[parameter], entry['value'])
            for entry in results.tables['5-7']['rows'] if entry['parameter'] == parameter]


@about
def largest_values(results, parameter):
    """The limit of Euler's belief update is the thesis' within a factor of 1.5."""
    found = limits(results, parameter)
    return Verdict(all(abs(math.log(ours / theirs)) < math.log(1.5) for _, ours, theirs in found),
                   '; '.join(f'{rate} Hz: {LIMITS[parameter]} = {ours:.2g} (thesis {theirs:g})' for rate, ours, theirs in found))


def best_kappa_a(results):
    parts, agrees = [], True
    for rate in RATES:
        runs = by(results.comparable('table_5-6'), 'kappa_a', belief_hz=rate)
        best = min(runs, key=lambda run: run['settling_s'])['kappa_a']
        agrees &= best == 10.0
        parts.append(f'{rate:.0f} Hz: {best:g} of {", ".join(format(run["kappa_a"], "g") for run in runs)} settles first')
    return Verdict(agrees, '; '.join(parts))


def overshoot_of(run, column):
    """Overshoot of a signal over its final value [%]."""
    _, values = run.series(column)
    return 100.0 * (values.max() / values[-50:].mean() - 1.0)


def commands_overshoot(results):
    parts, agrees = [], True
    for rate in RATES:
        runs = [run for run in by(results.comparable('table_5-4'), 'tau', True, belief_hz=rate) if run['thesis_settling_s']]
        values = [overshoot_of(run, 'command') for run in runs]
        agrees &= values == sorted(values)
        parts.append(f'{rate:.0f} Hz, τ {", ".join(format(run["tau"], "g") for run in runs)}: {", ".join(f"{v:.1f}" for v in values)} %')
    return Verdict(agrees, '; '.join(parts))


def beliefs_overshoot(results):
    slow, fast = (overshoot_of(pick(results.comparable('table_5-5'), kappa_mu=0.1, belief_hz=rate), 'belief_mps') for rate in RATES)
    return Verdict(slow > 5.0 > fast, f'κ_μ 0.1: {slow:.0f} % at 50 Hz, {fast:.0f} % at 1 kHz')


def noise(results, column):
    """Standard deviation of a signal at the end of Table 5-2's step to 0.5 m/s, at 50, 100 and 1000 Hz, in thousandths of its unit."""
    runs = [pick(results.comparable('table_5-2'), step_mps=0.5, belief_hz=rate) for rate in (50.0, 100.0, 1000.0)]
    return [1e3 * run.trace[column][-100:].std(ddof=0) for run in runs]


def rate_filters_noise(results):
    command, belief = noise(results, 'command_left_radps'), noise(results, 'belief_mps')
    return Verdict(falls(command) and falls(belief),
                   'noise at 50, 100, 1000 Hz: command of a wheel ' + ', '.join(f'{v:.2f}' for v in command) + ' mrad/s, believed velocity ' +
                   ', '.join(f'{v:.3f}' for v in belief) + ' mm/s')


AIC, DRIVE = ('table_3-1a', 'active inference', {}), ('table_3-1b', 'differential drive', {})
IMPROVED = ('figure_5-24', 'improved', {'controller': 'improved'}), ('figure_5-24', 'differential drive', {'controller': 'diff_drive'})

# Experiment, place in the thesis, statement, function for the verdict of our runs.
CLAIMS = [
    ('table_3-1a', 'Tables 3-1a, 3-1b', 'At 0.1 and 0.5 m/s the differential drive settles and rises faster.',
     faster(DRIVE, AIC, ({'step_mps': 0.1}, {'step_mps': 0.5}))),
    ('table_3-1b', 'Section 3-4', 'The differential drive settles at higher values than asked.',
     settles_high('table_3-1b', ' (our wheels follow their commands exactly; plant.wheel_gain above 1 would show it)')),
    ('figure_3-4', 'Figure 3-5', 'At 1 m/s the active inference controller rises faster.',
     faster(AIC, DRIVE, ({'step_mps': 1.0},), ('rise_s',))),
    ('figure_4-1', 'Figure 4-1a', 'Convergence is the same on the ground and on the box.', ground_and_box),
    ('figure_4-1', 'Figure 4-1b', 'On the ground the drive commands converge to a higher value.', ground_needs_more),
    ('figure_4-2', 'Figure 4-2', 'Changing τ changes model and robot alike.', model_follows('figure_4-2', 'tau')),
    ('figure_4-3', 'Figure 4-3', 'Changing κ_a changes model and robot alike.', model_follows('figure_4-3', 'kappa_a')),
    ('figure_4-4', 'Figure 4-4', 'The robot becomes unstable where the model is stable.', model_stays_stable),
    ('figure_4-5', 'Figure 4-5', 'The action starts one step after the belief and trails it.', action_trails),
    ('figure_5-1', 'Figure 5-1a', 'τ = 0.001 at 1 kHz is stable.',
     with_euler('figure_5-1', True, ' by the thesis\' own equations: h κ_μ Π_μ/τ² = 6.7, bound 1.75', belief_hz=1000.0)),
    ('figure_5-1', 'Figure 5-1b', 'τ = 0.001 at 50 Hz is unstable, on the robot and in simulation.',
     with_euler('figure_5-1', False, belief_hz=50.0)),
    ('table_5-1', 'Section 5-2', 'The update frequency of the whole controller changes nothing.', frequency_alone('table_5-1')),
    ('table_5-2', 'Section 5-3', 'The update frequency of the belief loop changes nothing.', frequency_alone('table_5-2')),
    ('table_5-4', 'Section 5-4-1', 'Settling and rise time fall with τ (0.03, 0.01, 0.001).',
     gets_faster('table_5-4', 'tau', ('settling_s', 'rise_s'), True)),
    ('table_5-4', 'Table 5-4', 'τ = 0.001 at 50 Hz is unstable.', with_euler('table_5-4', False, tau=0.001, belief_hz=50.0)),
    ('table_5-5', 'Section 5-4-2', 'Settling and rise time fall with κ_μ (0.01 to 1).',
     gets_faster('table_5-5', 'kappa_mu', ('settling_s', 'rise_s'), False)),
    ('table_5-5', 'Table 5-5', 'κ_μ = 1 at 50 Hz is unstable.', with_euler('table_5-5', False, kappa_mu=1.0, belief_hz=50.0)),
    ('table_5-6', 'Section 5-4-3', 'The rise time falls with κ_a.', gets_faster('table_5-6', 'kappa_a', ('rise_s',), False)),
    ('table_5-6', 'Section 5-4-3', 'The settling time first falls with κ_a, then rises because of ringing.', rings),
    ('table_5-6', 'Section 5-4-3', 'The overshoot is higher at 50 Hz.', slow_rings_more),
    ('table_5-5', 'Table 5-5', 'κ_μ = 0.5 at 50 Hz is stable.', with_euler('table_5-5', True, kappa_mu=0.5, belief_hz=50.0)),
    ('table_5-5', 'Figure 5-16a', 'The belief overshoots at 50 Hz, not at 1 kHz.', beliefs_overshoot),
    ('table_5-4', 'Figure 5-12', 'The commands overshoot more with a smaller τ.', commands_overshoot),
    ('table_5-7', 'Table 5-7', 'τ may be as small as 0.005 at 50 Hz and 0.0002 at 1 kHz.', largest_values('tau')),
    ('table_5-7', 'Table 5-7', 'κ_μ may be as large as 0.1 at 50 Hz and 3 at 1 kHz.', largest_values('kappa_mu')),
    ('table_5-6', 'Table 5-7', 'Of κ_a = 8, 10, 15, 20, 10 is the largest that improves the response.', best_kappa_a),
    ('table_5-2', 'Chapter 6', 'A higher update frequency filters noise better.', rate_filters_noise),
    ('table_5-9', 'Table 5-9', 'The improved controller settles and rises faster.',
     faster(*(('table_5-9', name, {'controller': name}) for name in ('improved', 'standard')), ({},))),
    ('table_5-10', 'Section 5-5-2', 'The improved controller reaches the set point of the square waves, the standard one fails to.',
     square_waves),
    ('figure_5-24', 'Section 5-5-3', 'The improved controller settles and rises faster than the differential drive (on the box).',
     faster(*IMPROVED, ({'plant': 'box'},))),
    ('figure_5-24', 'Section 5-5-3', 'The same on the ground.',
     faster(*IMPROVED, ({'plant': 'ground'},))),
    ('figure_5-24', 'Section 5-5-3', 'The differential drive settles at a higher value than asked.',
     settles_high('figure_5-24', ' on the box', plant='box')),
    ('table_5-5', 'Figure D-1', 'κ_μ = 1 at 50 Hz: the belief becomes infinite.',
     with_euler('table_5-5', False, kappa_mu=1.0, belief_hz=50.0)),
    ('table_5-4', 'Figure D-2', 'τ = 0.001 at 50 Hz: velocity and belief become unstable.',
     with_euler('table_5-4', False, tau=0.001, belief_hz=50.0)),
]
