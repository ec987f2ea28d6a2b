#!/usr/bin/python3
"""The search for gains: what is driven, what gains are worth, and the command."""

import pathlib
import tempfile
import unittest
import unittest.mock

from drives import SOURCE, run
import engine
import jackal_aic
import rosunit
import tuning

BOX = str(SOURCE / 'config/plant_box.yaml')
GROUND = str(SOURCE / 'config/plant.yaml')
# Gains that were once shipped: fast on the linear model, but a precise y'' makes limit cycles of the encoders' steps.
BRITTLE = {'controller.tau': 0.1, 'controller.kappa_mu': 0.4008, 'controller.kappa_a': 11.03, 'controller.orders': 3,
           'controller.state_variances': [0.001027, 8.013, 0.1331, 0.0031], 'controller.sensory_variances': [2.0, 1059.0, 0.001, 1e8]}
KEPT = {'settling_s': 0.5, 'overshoot_pct': 0.0, 'beyond_mps': 0.0, 'beyond_radps': 0.0, 'ripple': 0.0}


def task(plant='box', start='improved', **changes):
    return tuning.Task(start, (plant,), **dict({'draws': 5}, **changes))


class Trials(unittest.TestCase):

    def test_have_bars_and_say_which_is_missed(self):
        bars = {figure: bar or 10.0 for figure, (_, bar, _) in tuning.FIGURES.items()}
        for figure, value, words in (('overshoot_pct', 12.5, 'overshoot % 12.5, at most 10'),
                                     ('beyond_mps', 0.04, 'running back m/s 0.04, at most 0.03'),
                                     ('beyond_radps', 0.06, 'turning back rad/s 0.06, at most 0.05'),
                                     ('ripple', 0.2, 'command ripple rad/s 0.2, at most 0.1'), ('settling_s', None, 'never settles'),
                                     ('settling_s', 0.4, '')):
            figures = dict(KEPT, **{figure: value})
            self.assertEqual(tuning.missed_bar(bars, figures), words)
            self.assertEqual(tuning.penalty(bars, figures) >= 1.0, bool(words))
        self.assertGreater(tuning.penalty(bars, dict(KEPT, ripple=0.095)), 0.0, 'close to a bar')

    def test_find_the_limit_cycle_of_coarse_encoders(self):
        one = task()
        coarse = [trial for trial in tuning.trials(one, one.plant[0]) if 'late samples' in trial.name]
        for found, least, most in (({}, 0, 0), (BRITTLE, 3, 9)):
            missed = sum(bool(tuning.missed_bar(trial.bars, tuning.drive(one, found, trial))) for trial in coarse)
            self.assertTrue(least <= missed <= most, missed)


class Worth(unittest.TestCase):

    def test_of_gains_falls_with_every_bar_that_is_missed(self):
        one = task()
        judged = tuning.first_trials(one)
        self.assertEqual(len(judged), 5)
        cost = tuning.cost(one, {}, judged)
        self.assertTrue(0.55 < cost < 1.0, cost)
        self.assertLess(tuning.cost(one, {}, judged, 0.1), cost, 'gives up')
        self.assertGreater(tuning.cost(one, {}, tuning.first_trials(one._replace(overshoot=3.0))), cost + 1.0)
        self.assertGreater(tuning.cost(one._replace(gain_margin=5.0), {}, judged), tuning.UNSTABLE)
        self.assertTrue(0.5 < tuning.linear_cost(one, {}) < 2.0)
        self.assertGreater(tuning.linear_cost(one._replace(gain_margin=5.0), {}), tuning.UNSTABLE)

    def test_of_gains_is_that_at_the_worst_corner_of_the_confidence_box(self):
        for start in ('improved', 'predictive'):
            violations = [tuning.margin_violation(task('ground', start), task('ground', start).loops('ground', {
                'plant_model.gain_half_width': width})) for width in (0.0, 0.1, 0.8)]
            self.assertLess(violations[0], 0.0, start)
            self.assertGreater(violations[1], violations[0], start)
            self.assertGreaterEqual(violations[2], 0.0, start)

    def test_tuned_preset_passes_what_users_drive_on_ground_and_box(self):
        for plant in ('ground', 'box'):
            found = tuning.assess(task(plant, 'tuned', draws=20), {}, engine.parallel)
            self.assertEqual(found.missed, [], plant)
            self.assertLess(found.settling, 0.7)


class Tune(unittest.TestCase):

    def setUp(self):
        rounds = unittest.mock.patch.object(tuning, 'ROUNDS', 2)  # of four alike
        rounds.start()
        self.addCleanup(rounds.stop)
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.out = directory.name + '/tuned.yaml'

    def test_writes_gains_that_pass_and_says_what_they_gain(self):
        said, status = run('tune', '--plant', BOX, '--orders', '1', '--evaluations', '4', '--draws', '3', '--out', self.out)
        self.assertEqual(status, 0, said)
        for words in ('Searching gains on 1 robot', '\nstart ', '\ntuned ', 'plant_box', 'gain margin', 'ripple',
                      'The tuned gains settle at 0.5 m/s in 0.', 'pass every trial; the gains at the start take 0.60 s.', 'Wrote ' + self.out):
            self.assertIn(words, said)
        text = pathlib.Path(self.out).read_text()
        for words in ('# Gains that `tune` found', 'encoder steps up to 0.1 rad/s', 'orders: 1', 'belief_rate: 1000.0'):
            self.assertIn(words, text)
        self.assertRegex(text, '\n# tuned +plant_box +0')
        self.assertEqual(jackal_aic.Parameters(self.out, 'box')['controller.orders'], 1)
        settling = [engine.drive('box', preset, engine.motions.stop(0.5, 0.0, 4.0, 3.0), {'loop.phase': 0.019}).settling_time() for preset in (
            self.out, 'improved')]
        found = tuning.assess(task('box', self.out, draws=0), {})
        self.assertEqual(found.missed, [])
        self.assertLess(found.settling, 0.55, 'improved takes 0.60 s; {}'.format(settling))

    def test_gains_that_miss_anything_are_no_result(self):
        said, status = run('tune', '--plant', BOX, '--out', self.out, '--orders', '1', '--evaluations', '1', '--draws', '0',
                            '--gain-margin', '90')
        self.assertEqual(status, 1)
        self.assertIn('no gains found that pass every trial', said)
        self.assertIn(' missed: plant_box', said)
        self.assertFalse(pathlib.Path(self.out).exists())

    def test_bad_input_gives_one_clear_line(self):
        negative, directory = self.out.replace('tuned', 'negative'), str(pathlib.Path(self.out).parent)
        pathlib.Path(negative).write_text('plant_model: {dead_time: 0.1, lag: -0.03}')
        good = ['--plant', BOX, '--out', self.out]
        for arguments, words in ((['--out', self.out], 'required: --plant'), (['--plant', BOX], 'one of the arguments --out --judge is required'),
                                 (['--plant', directory + '/no.yaml', '--out', self.out], 'no.yaml: '),
                                 (['--plant', str(SOURCE / 'config/tuned.yaml'), '--out', self.out], 'not a plant file'),
                                 (['--plant', negative, '--out', self.out], 'plant_model.lag = -0.03'), (good + ['--orders', '6'], 'orders = 6'),
                                 (good + ['--overshoot', '-1'], 'overshoot = -1'), (good + ['--evaluations', '0'], 'evaluations = 0'),
                                 (good + ['--start', 'diff_drive'], 'expected gains'), (good + ['--start', 'predictive'], 'expected gains'),
                                 (good + ['--start', 'nonesuch'], "'nonesuch': unknown"), (good + ['--nonsense'], '--nonsense'),
                                 (['--plant', BOX, '--out', directory + '/no/such.yaml'], 'cannot be written')):
            said, status = run('tune', *arguments)
            self.assertEqual((status, said.count('\n')), (1, 1), said)
            self.assertTrue(said.startswith('tune: '), said)
            self.assertIn(words, said)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'tune', '__main__')
