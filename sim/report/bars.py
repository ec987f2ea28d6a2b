"""The bars of the predictive controller: what was asked for (sim/lab/acceptance.yaml), and what the experiments reached."""

from markup import cell, link, table


def runs_of(results, name, controller='predictive'):
    return [run for run in results.runs[name] if run['controller'] == controller]


def like(results, name, run, controller):
    """The run of another controller in the same case."""
    return next(other for other in runs_of(results, name, controller)
                if all(other[c] == run[c] for c in ('plant', 'step_mps', 'step_radps', 'label')))


def settling(run):
    return run['settling_s'] if run.bounded and run['settling_s'] is not None else float('inf')


def largest(results, name, column):
    return max(abs(run[column]) if run[column] is not None else float('inf') for run in runs_of(results, name))


def as_fast_as_open_loop(results):
    name = 'predictive_steps'
    worst = max(settling(run) / like(results, name, run, 'diff_drive')['settling_s'] for run in runs_of(results, name))
    return worst <= results.bars[name]['settling_over_open_loop'], f'at most {worst:.2f} times'


def within(name, column, bar, unit):
    """A column whose size has to keep within a bar of its experiment."""

    def judge(results):
        worst = largest(results, name, column)
        return worst <= results.bars[name][bar], f'at most {worst:.2f} {unit}'

    return judge


def faster_than_improved(results):
    name = 'predictive_steps'
    ratios = {run['plant']: settling(run) / settling(like(results, name, run, 'improved'))
              for run in runs_of(results, name) if run['step_mps'] == 0.5}
    limits = {run['plant']: settling(run) / settling(like(results, name, run, 'improved'))
              for run in runs_of(results, name, 'diff_drive') if run['step_mps'] == 0.5}
    words = ', '.join(f'{ratio:.2f} on the {plant} (open loop: {limits[plant]:.2f})' for plant, ratio in ratios.items())
    bar = results.bars[name]['settling_over_improved']
    if min(ratios['ground'], limits['ground']) > bar:
        words += '; on the ground the acceleration limit leaves nothing to gain'
    return all(ratio <= bar for ratio in ratios.values()), words


def quick_when_perturbed(results):
    worst = max(runs_of(results, 'predictive_perturbations'), key=settling)
    return settling(worst) <= results.bars['predictive_perturbations']['settling'], f'at most {settling(worst):.2f} s ({worst["plant"]}, {worst.label})'


def square_waves(results):
    name = 'predictive_squares'
    ours = [run['tracking_rms_mps'] / like(results, name, run, 'improved')['tracking_rms_mps'] for run in runs_of(results, name)]
    limit = [run['tracking_rms_mps'] / like(results, name, run, 'improved')['tracking_rms_mps']
             for run in runs_of(results, name, 'plant_limit')]
    bar = results.bars[name]['tracking_over_improved']
    excess = max(100.0 * (a / b - 1.0) for a, b in zip(ours, limit))
    words = f'{min(ours):.2f} to {max(ours):.2f}; dead time and acceleration limit alone cost {min(limit):.2f} to {max(limit):.2f}'
    if max(limit) > bar:
        words += ', so the bar is out of reach on this plant'
    return max(ours) <= bar, words + f'; predictive is within {excess:.1f} % of that limit'


def as_good_as_kalman(column, unit):

    def judge(results):
        name = 'belief_accuracy'
        ratios = {run['plant']: run[column] / like(results, name, run, 'kalman_filter')[column] for run in runs_of(results, name)}
        return max(ratios.values()) <= results.bars[name]['error_over_kalman_filter'], ', '.join(f'{ratio:.2f} on the {plant}' for plant, ratio in ratios.items()) + f' ({unit})'

    return judge


# Experiment, what was asked for with the bars of the experiment in braces, function of the results that tells (met, what was reached).
BARS = [
    ('predictive_steps', 'settles in at most {settling_over_open_loop:.2f} times the differential drive\'s time, at 0.1, 0.3, 0.5, 1 m/s, '
     'box and ground', as_fast_as_open_loop),
    ('predictive_steps', 'overshoot at most {overshoot:g} %', within('predictive_steps', 'overshoot_pct', 'overshoot', '%')),
    ('predictive_steps', 'steady-state error at most {steady_error:g} %', within('predictive_steps', 'steady_error_pct', 'steady_error', '%')),
    ('predictive_steps', 'at 0.5 m/s settles in at most {settling_over_improved:g} times improved\'s time', faster_than_improved),
    ('predictive_perturbations', 'settles within {settling:g} s with every perturbation', quick_when_perturbed),
    ('predictive_perturbations', 'steady-state error at most {steady_error:g} %',
     within('predictive_perturbations', 'steady_error_pct', 'steady_error', '%')),
    ('predictive_squares', 'root-mean-square tracking error at most {tracking_over_improved:g} times improved\'s', square_waves),
    ('slip_turns', 'steady-state error of the yaw rate at most {steady_error:g} % within 3 s',
     within('slip_turns', 'steady_error_pct', 'steady_error', '%')),
    ('belief_accuracy', 'belief of the forward speed at most {error_over_kalman_filter:g} times the Kalman filter\'s RMS',
     as_good_as_kalman('belief_rms_mps', 'forward speed')),
    ('belief_accuracy', 'belief of the yaw rate at most {error_over_kalman_filter:g} times the Kalman filter\'s RMS',
     as_good_as_kalman('belief_rms_radps', 'yaw rate')),
]


def bar_table(results):
    rows = []
    for name, text, judge in BARS:
        met, reached = judge(results)
        rows.append([cell(link(name, results.experiments[name]['title']), True), cell(text.format(**results.bars.get(name, {})), True),
                     cell('met' if met else 'missed', True, 'yes' if met else 'no'), cell(reached, True)])
    return table(['<experiment', '<bar', '<verdict', '<reached'], rows)
