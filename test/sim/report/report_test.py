"""The sentences of the report against runs of now: answers, statements, and what the notes say (a part of python/lab_test.py)."""

import functools
import io
import pathlib
import re
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(SOURCE / 'sim/report'), str(SOURCE / 'test/python')]

import answers  # noqa: E402
import claims  # noqa: E402
import hypothesis  # noqa: E402
import thesis_report  # noqa: E402
from drives import run  # noqa: E402
import metrics  # noqa: E402
import pandas  # noqa: E402
import thesis  # noqa: E402
from results import Results  # noqa: E402


def experiments(*arguments):
    said, status = run('experiments', *arguments)
    assert status == 0, said
    return said


def row(*arguments):
    """The row of results of a step or square wave."""
    return pandas.read_csv(io.StringIO(experiments(*arguments, '--csv', '-'))).loc[0]


@functools.lru_cache(maxsize=None)
def results():
    """All experiments, run once."""
    with tempfile.TemporaryDirectory() as directory:
        experiments('run', 'all', '--out', directory)
        return Results(directory)


class Report(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.results = results()

    def test_every_answer_holds_and_is_one_sentence(self):
        for question, answer, _ in answers.answered(self.results):
            self.assertTrue(answer.agrees, question + ' ' + answer.ours)
            self.assertEqual(len(re.findall(r'\.(?: |$)', answer.ours)), 1, answer.ours)

    def test_an_answer_that_the_runs_do_not_support_is_found(self):
        improved = claims.pick(self.results.comparable('table_5-9'), controller='improved')
        kept = improved.row['settling_s']
        improved.row['settling_s'] = 0.9
        self.assertFalse(answers.faster_and_accurate(self.results).agrees)
        improved.row['settling_s'] = kept

    def test_the_page_of_evidence_counts_the_statements(self):
        verdicts = thesis_report.evaluate(self.results)
        page = (SOURCE / 'doc/evidence.md').read_text()
        counted = re.search(r'its (\d+) statements about its tables and figures hold here \| (\d+)', page).groups()
        agreed = sum(verdict.agrees for *_, verdict in verdicts)
        self.assertEqual((int(counted[0]), int(counted[1])), (len(verdicts), agreed),
                         '\n'.join(f'{verdict.agrees} {place}: {text} {verdict.ours}' for _, place, text, verdict in verdicts))

    def test_the_page_begins_with_the_answers(self):
        images = {(name, figure): ('data:,', False) for name, experiment in self.results.experiments.items()
                  for figure, _ in thesis_report.figure_groups(experiment)}
        page = thesis_report.page(self.results, images)
        places = [page.index(text) for text in ('The research questions', 'statements of the thesis hold', 'Contents</h2>', 'controller.printed')]
        self.assertEqual(places, sorted(places))
        for _, _, place in answers.ANSWERS:
            self.assertIn(f'id="{place}"', page)
        self.assertNotIn('no longer support', page)

    def test_the_hypothesis_is_within_the_thesis_values_and_on_its_page(self):
        page = (SOURCE / 'doc/concepts/active_inference.md').read_text()
        for rate, theirs, kept, printed in hypothesis.limits(self.results):
            self.assertLess(kept, theirs)
            self.assertGreater(printed, theirs)
            words = '1 kHz' if rate == 1000 else f'{rate} Hz'
            self.assertIn(f'| {words} | {theirs:g} s | {kept:.2g} s | {printed:.2g} s |', page)

    def test_the_notes_say_what_the_runs_say(self):
        checks = {'table_3-1b': self.drive_acceleration, 'figure_3-4': self.drive_acceleration, 'figure_5-24': self.drive_acceleration,
                  'figure_4-4': self.gain_of_4_4, 'figure_5-1': self.noise_of_5_1, 'table_5-10': self.period, 'newton': self.newton,
                  'orders': self.variances, 'predictive_limits': self.limits, 'predictive_perturbations': self.open_loop,
                  'predictive_squares': self.squares, 'slip_turns': self.tracks, 'sliding_speed': self.wheels_that_slide}
        notes = {name: experiment['note'] for name, experiment in self.results.experiments.items() if 'note' in experiment}
        self.assertLessEqual(set(notes), set(checks), 'a note needs a check')
        self.assertGreaterEqual(len(notes), 10)
        for name, note in notes.items():
            checks[name](' '.join(note.split()))

    def drive_acceleration(self, note):
        rise = claims.pick(self.results.comparable('table_3-1b'), step_mps=1.0)['rise_s']
        self.assertIn(f'accelerates by {0.8 / rise:.1f} m/s^2 here', note)
        printed = next(row['rise'] for row in self.results.tables['3-1a']['rows'] if row['step'] == 1.0)
        self.assertIn(f'motors do {0.8 / printed:.1f} m/s^2 in Table 3-1a', note)
        published = float(row('step', '--controller', 'diff_drive', '--plant', 'ground', '--step', '0.5')['settling_s'])
        self.assertIn(f'it settles in {published:.2f} s at 0.5 m/s', note)

    def gain_of_4_4(self, note):
        for run in self.results.runs['figure_4-4']:
            self.assertIn(f'kappa_a = {run["kappa_a"]:g} is ours', note)

    def limits(self, note):
        """No controller beats the limit of the plant, and `predictive` keeps its bar straight on over the ground."""
        self.assertIn('follows the set point after the dead time at the acceleration limit', note)
        runs, bar = self.results.runs['predictive_limits'], self.results.bars['predictive_limits']['settling_over_limit']
        self.assertEqual(self.results.experiments['predictive_limits']['set'], {'plant.noise_scale': 0})
        for run in runs:
            limit = claims.pick(runs, controller='plant_limit', **{key: run[key] for key in ('plant', 'step_mps', 'step_radps')})
            self.assertGreaterEqual(run['settling_s'], limit['settling_s'] - 0.001)
            if run['controller'] == 'predictive' and run['plant'] == 'ground' and run['step_mps']:
                self.assertLessEqual(run['settling_s'], bar * limit['settling_s'])

    def noise_of_5_1(self, note):
        self.assertIn('with sensor noise is compared with the plant without', note)
        self.assertEqual({run.label for run in self.results.runs['figure_5-1']}, {'with noise', 'without noise'})

    def period(self, note):
        self.assertIn(f'The period of {self.results.experiments["table_5-10"]["period"]} s is ours', note)
        self.assertIn('With 4 s our standard controller reaches the set point too', note)
        square = row('square', '--controller', 'standard', '--plant', 'box', '--min', '0.1', '--max', '0.5', '--period', '4',
                     '--set', 'controller.printed=true')
        self.assertLess(abs(float(square['steady_error_pct'])), 1.0)

    def newton(self, note):
        self.assertIn('Euler diverges with it', note)
        for run in self.results.runs['newton']:
            self.assertIn(f'kappa_mu = {run["kappa_mu"]:g}', note)
            self.assertEqual(run.bounded, run['integrator'] == 'exact')

    def variances(self, note):
        self.assertIn('go on doubling (states) or stay at 1e5 (measurements)', note)
        gains = self.results.config('standard')['controller']
        for run in self.results.experiments['orders']['runs']:
            states, sensors = (run['set'][f'controller.{name}_variances'] for name in ('state', 'sensory'))
            self.assertEqual((states[:4], sensors[:4]), (gains['state_variances'], gains['sensory_variances']))
            self.assertEqual((states[3:], sensors[3:]), ([8, 16, 32], [1e5] * 3))

    def open_loop(self, note):
        self.assertIn('The open loop knows the gain of its wheels.', note)
        runs = [run for run in self.results.runs['predictive_perturbations'] if run['controller'] == 'diff_drive' and 'gain' in run.label]
        self.assertEqual(len(runs), 4)
        for run in runs:
            self.assertLess(abs(run['steady_error_pct']), 0.5, run.label)

    def squares(self, note):
        self.assertIn(f'{self.results.experiments["table_5-10"]["period"]} s is that of our Table 5-10', note)
        self.assertIn('with 4 s every controller settles in half a period', note)
        for label in {run.label for run in self.results.runs['predictive_squares']}:
            runs = [run for run in self.results.runs['predictive_squares'] if run.label == label]
            least = claims.pick(runs, controller='plant_limit')['tracking_rms_mps']
            self.assertEqual(least, min(run['tracking_rms_mps'] for run in runs), label)
            for run in runs if label.endswith('4 s') else ():
                self.assertLess(run['settling_s'], 2.0, run['controller'])

    def tracks(self, note):
        turns = [run for run in self.results.runs['slip_turns'] if run['step_mps'] == 0.0 and run['controller'] == 'predictive']
        self.assertEqual(len(turns), 6)
        true = thesis.TRUE_TRACK
        self.assertIn(f'in place, is {true} m', note)
        for factor, configured in ((1.25, 0.4376), (0.75, 0.7293)):
            self.assertIn(f'{configured} m', note)
            self.assertAlmostEqual(true / configured, factor, delta=0.001)
        for run in turns:
            self.assertAlmostEqual(run['effective_track'], true, delta=0.02 * true)
            self.assertAlmostEqual(run.series('velocity_mps')[0][-1], 0.5 + 3.5, delta=0.05)

    def wheels_that_slide(self, note):
        self.assertIn('(friction 0.1 and 0.07, the wall)', note)
        self.assertIn('At friction 0.15, with three times the noise and in the arcs', note)
        for run in self.results.runs['sliding_speed']:
            wheels, belief = (metrics.rms(run.trace[column] - run.trace['velocity_mps']) for column in ('measured_mps', 'belief_mps'))
            slides = run.label in ('friction 0.1', 'friction 0.07', 'against a wall')
            self.assertEqual(wheels > 0.01 and belief < 0.9 * wheels, slides, run.label)
