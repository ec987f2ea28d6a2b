"""The research questions of the thesis (section 1-1) and its future work (section 6-1), each answered by our runs in a sentence."""

import claims
from claims import Verdict, pick, seconds, select


def faster_and_accurate(results):
    runs = results.comparable('table_5-9')
    standard, improved = pick(runs, controller='standard'), pick(runs, controller='improved')
    theirs = [seconds(run['thesis_settling_s']) for run in (standard, improved)]
    error = max(abs(run['steady_error_pct']) for run in (standard, improved))
    return Verdict(claims.is_less(improved['settling_s'], standard['settling_s']) and error < 1.0,
                   f'A belief update at 1 kHz allows a smaller τ: at 0.5 m/s the robot settles in {seconds(improved["settling_s"])} instead of '
                   f'{seconds(standard["settling_s"])} ({theirs[1]} instead of {theirs[0]} in the thesis), with a steady-state error of at most '
                   f'{error:.2f} %; it overshoots by {improved["overshoot_pct"]:.1f} % instead of {standard["overshoot_pct"]:.1f} %.')


def controls_the_jackal(results):
    runs = results.comparable('table_3-1a')
    error = max(abs(run['steady_error_pct']) for run in runs)
    times = [run['settling_s'] for run in runs]
    drives = [pick(results.comparable('table_3-1b'), step_mps=run['step_mps'])['settling_s'] for run in runs]
    faster = [f'{run["step_mps"]:g}' for run, drive in zip(runs, drives) if drive < run['settling_s']]
    return Verdict(error < 1.0 and faster,
                   f'Yes: on the ground it settles in {seconds(min(times))} to {seconds(max(times))} at 0.1 to 1 m/s, with an error of at most '
                   f'{error:.2f} %; the differential drive is faster at {", ".join(faster)} m/s '
                   f'({seconds(min(drives))} to {seconds(max(drives))}).')


def state_space_model(results):
    ratios = []
    for name, parameter in (('figure_4-2', 'tau'), ('figure_4-3', 'kappa_a')):
        runs = results.comparable(name)
        ratios += [pick(runs, plant='box', **{parameter: model[parameter]})['rise_s'] / model['rise_s']
                   for model in select(runs, plant='state_space')]
    return Verdict((min(ratios) < 0.8 or max(ratios) > 1.25) and claims.model_stays_stable(results).agrees,
                   f'For the direction of a change, not for its size: the robot rises in {min(ratios):.2f} to {max(ratios):.2f} times the '
                   "model's time, and it is unstable where the model is stable, because the model has no dead time.")


def simulator(results):
    noisy, silent = (pick(results.comparable('figure_5-1'), belief_hz=1000.0, label=label)['settling_s'] for label in ('with noise', 'without noise'))
    return Verdict(abs(noisy / silent - 1.0) < 0.1, f'Gazebo was not run here; our simulated robot settles in {seconds(noisy)} with the noise '
                                                    f'of its sensors and in {seconds(silent)} without.')


def frequency_and_accuracy(results):
    most = max(claims.spreads(results, 'table_5-1') + claims.spreads(results, 'table_5-2'))
    noise = claims.noise(results, 'command_left_radps')
    return Verdict(most < 0.15 and noise[-1] > 0.98 * noise[0],
                   f'No: settling changes by at most {100 * most:.0f} %, and the commands are as noisy at 1 kHz '
                   f'({noise[-1]:.2f} mrad/s) as at 50 Hz ({noise[0]:.2f} mrad/s).')


def frequency_and_tuning(results):
    tau, kappa = (claims.limits(results, parameter) for parameter in ('tau', 'kappa_mu'))
    free = (claims.limits(results, parameter, 'exact') for parameter in ('tau', 'kappa_mu'))  # the ends of the search
    unlimited = [max(found[1] / limit[1], limit[1] / found[1]) > 100.0 for pair in zip(free, (tau, kappa)) for found, limit in zip(*pair)]
    return Verdict(tau[1][1] < 0.5 * tau[0][1] and kappa[1][1] > 2.0 * kappa[0][1] and all(unlimited),
                   f'Yes: from 50 Hz to 1 kHz the smallest τ of the Euler step falls from {tau[0][1]:.2g} s to {tau[1][1]:.2g} s and the largest '
                   f'κ_μ rises from {kappa[0][1]:.2g} to {kappa[1][1]:.2g}; the exact step has no limit.')


def largest_values(results):
    tau, kappa = (claims.limits(results, parameter) for parameter in ('tau', 'kappa_mu'))
    pairs = [f'{words} {ours:.2g} ({theirs:g})' for limits, words in ((tau, 'τ'), (kappa, 'κ_μ')) for _, ours, theirs in limits]
    return Verdict(all(ours > theirs for _, ours, theirs in tau),
                   f'With Euler, at 50 Hz and 1 kHz, in brackets the thesis: {", ".join(pairs)}; its τ is below what its printed '
                   f'equations allow, at 1 kHz by a factor of {tau[1][1] / tau[1][2]:.0f}.')


def half_a_metre(results, *controllers):
    """(plant, settling times of these controllers) of the steps to 0.5 m/s."""
    for plant in ('box', 'ground'):
        runs = select(results.runs['predictive_steps'], plant=plant, step_mps=0.5)
        yield (plant, *(pick(runs, controller=name)['settling_s'] for name in controllers))


def several_parameters(results):
    found = list(half_a_metre(results, 'tuned', 'improved'))
    return Verdict(not any(claims.is_less(tuned, improved) for _, tuned, improved in found),
                   'All parameters at once (<code>tuned</code>) gain nothing over <code>improved</code>: ' + ', '.join(
                       f'{tuned:.3f} s and {improved:.3f} s ({plant})' for plant, tuned, improved in found) + '.')


def other_descent(results):
    runs = claims.by(results.runs['newton'], 'tau', True, integrator='exact')
    improved = pick(results.comparable('table_5-9'), controller='improved')['settling_s']
    times = [run['settling_s'] for run in runs]
    return Verdict(not claims.is_less(times[-1], improved),
                   f'Newton\'s method reaches the minimum of F in each step: at 50 Hz it settles in {", ".join(f"{t:.2f}" for t in times)} s for '
                   f'τ = {", ".join(format(run["tau"], "g") for run in runs)}; <code>improved</code> ({seconds(improved)}) is at that limit '
                   'already, and dead time and action set it.')


def number_of_orders(results):
    times = {run['orders']: run['settling_s'] for run in select(results.comparable('orders'), controller='standard')}
    slower = times[0] / times[3] - 1.0
    spread = max(times[p] for p in times if p >= 1) / min(times[p] for p in times if p >= 1) - 1.0
    return Verdict(slower > 0.05 and spread < 0.01, f'p = 0 settles {100 * slower:.0f} % later than p = 3; from p = 1 on the times differ by '
                                                    f'{100 * spread:.1f} % at most.')


def better_dynamics(results):
    found = list(half_a_metre(results, 'predictive', 'improved'))
    return Verdict(all(claims.is_less(predictive, improved) for _, predictive, improved in found),
                   'A model that predicts the path to the set point is the <code>predictive</code> controller: ' + ', '.join(
                       f'{seconds(predictive)} instead of {seconds(improved)} ({plant})' for plant, predictive, improved in found) + '.')


# What the thesis asks, our answer, where it is shown.
ANSWERS = [
    ('How can the response time be decreased, while remaining an accurate controller?', faster_and_accurate, 'table_5-9'),
    ('Develop an active inference velocity controller for a Jackal.', controls_the_jackal, 'table_3-1a'),
    ('Can a state space model be used to analyze and simulate it?', state_space_model, 'figure_4-2'),
    ('Can Gazebo be used to simulate it?', simulator, 'figure_5-1'),
    ('Does a higher update frequency affect the accuracy?', frequency_and_accuracy, 'table_5-2'),
    ('Does a higher update frequency affect the tuning parameters?', frequency_and_tuning, 'table_5-7'),
    ('What are the maximum values of the tuning parameters?', largest_values, 'table_5-7'),
    ('Future work: more than one parameter at once.', several_parameters, 'predictive_steps'),
    ('Future work: another method of gradient descent.', other_descent, 'newton'),
    ('Future work: the number of generalised orders.', number_of_orders, 'orders'),
    ('Future work: other state dynamics.', better_dynamics, 'predictive_steps'),
]


def answered(results):
    """(question, answer, place) of each; the answer agrees while its figures say what it says."""
    return [(question, answer(results), place) for question, answer, place in ANSWERS]
