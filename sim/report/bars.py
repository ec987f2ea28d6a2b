"""The bars of the predictive controller: what was asked for (sim/lab/acceptance.yaml), and what the experiments reached."""

from markup import link

# Experiment, its bar with the words that ask for it, the column, and the controller in whose multiples it counts.
BARS = (
    ('predictive_steps', 'settling_over_open_loop', "settles in at most {:.2f} times the differential drive's time", 'settling_s', 'diff_drive'),
    ('predictive_steps', 'overshoot', 'overshoot at most {:g} %', 'overshoot_pct', None),
    ('predictive_steps', 'steady_error', 'steady-state error at most {:g} %', 'steady_error_pct', None),
    ('predictive_steps', 'settling_over_improved', "at 0.5 m/s settles in at most {:g} times improved's time", 'settling_s', 'improved'),
    ('predictive_limits', 'settling_over_limit', "settles in at most {:.2f} times the limit's time", 'settling_s', 'plant_limit'),
    ('predictive_perturbations', 'settling', 'settles within {:g} s with every perturbation', 'settling_s', None),
    ('predictive_perturbations', 'steady_error', 'steady-state error at most {:g} %', 'steady_error_pct', None),
    ('predictive_squares', 'tracking_over_improved', "root-mean-square tracking error at most {:g} times improved's", 'tracking_rms_mps', 'improved'),
    ('slip_turns', 'steady_error', 'steady-state error of the yaw rate at most {:g} % within 3 s', 'steady_error_pct', None),
    ('belief_accuracy', 'error_over_kalman_filter', "belief of the forward speed at most {:g} times the Kalman filter's RMS", 'belief_rms_mps',
     'kalman_filter'),
    ('belief_accuracy', 'error_over_kalman_filter', "belief of the yaw rate at most {:g} times the Kalman filter's RMS", 'belief_rms_radps',
     'kalman_filter'))


def size(run, column):
    return abs(run[column]) if run.bounded and run[column] is not None else float('inf')


def reached(results, name, bar, column, other):
    """Values of `predictive` by plant, in multiples of another controller in the same case."""
    found = {}
    for run in results.runs[name]:
        if run['controller'] != 'predictive' or (bar == 'settling_over_improved' and run['step_mps'] != 0.5):
            continue
        alike = [size(one, column) for one in results.runs[name] if one['controller'] == other and
                 all(one[key] == run[key] for key in ('plant', 'step_mps', 'step_radps', 'label'))]
        found.setdefault(run['plant'], []).append(size(run, column) / (alike[0] if other else 1.0))
    return found


def bar_table(results):
    rows = []
    for name, bar, words, column, other in BARS:
        most, found = results.bars[name][bar], reached(results, name, bar, column, other)
        rows.append({'experiment': link(name, results.experiments[name]['title']), 'bar': words.format(most),
                     'verdict': 'met' if max(map(max, found.values())) <= most else 'missed',
                     'reached': '; '.join(f'{plant}: {min(values):.2f} to {max(values):.2f}' for plant, values in found.items())})
    return rows
