#!/usr/bin/python3
"""`analyze`: prints the certificate of a configuration as YAML; the exit status is 1 if the loop is unstable."""

import os
import pathlib
import subprocess
import tempfile
import unittest

import rosunit
import yaml

CONFIG = pathlib.Path(__file__).resolve().parents[2] / 'config'
PROGRAM = os.environ['JACKAL_AIC_DEVEL'] + '/lib/jackal_aic/analyze'
IMPROVED, PREDICTIVE, GROUND = (str(CONFIG / name) for name in ('improved.yaml', 'predictive.yaml', 'plant_model.yaml'))


class Analyze(unittest.TestCase):

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = directory.name

    def file(self, text, *before):
        """Path of a new file: files of config/, and text after them."""
        with tempfile.NamedTemporaryFile('w', suffix='.yaml', dir=self.directory, delete=False) as file:
            file.write(''.join((CONFIG / name).read_text() for name in before) + text)
        return file.name

    def output(self, *arguments, status=0):
        done = subprocess.run([PROGRAM, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
        self.assertEqual(done.returncode, status, done.stdout)
        return done.stdout

    def figures(self, *arguments, status=0):
        return yaml.safe_load(self.output(*arguments, status=status))

    def refusal(self, *arguments):
        said = self.output(*arguments, status=2)
        self.assertEqual(said.count('\n'), 1, said)
        return said

    def test_says_what_the_figures_mean(self):
        said = self.output(str(CONFIG / 'standard.yaml'))
        for part in ('\nstable: true', '# s more dead time\n', '# x the action gain\n', '# driving straight\n', 'dead_time: 0.096',
                     'Stable with room', '# delay margin '):
            self.assertIn(part, said)

    @unittest.skipIf(os.environ['JACKAL_AIC_SANITIZER'], 'the module of Python needs the sanitizer in the interpreter')
    def test_prints_the_certificate(self):
        import jackal_aic
        printed, expected = self.figures(IMPROVED, '--plant', GROUND), jackal_aic.certify(jackal_aic.Parameters('improved', 'ground'))
        for key, figure, delta in (('belief_spectral_radius', expected.belief_spectral_radius, 1e-10), ('gain_margin', expected.gain_margin, 1e-4),
                                   ('loop_spectral_radius', expected.loop_spectral_radius, 1e-5), ('delay_margin_s', expected.delay_margin, 1e-5)):
            self.assertAlmostEqual(printed[key], figure, delta=delta, msg=key)
        self.assertLess(printed['turn']['spectral_radius'], 1.0)
        self.assertTrue(printed['stable'])
        self.assertIn('Stable with room', printed['advice'])

    def test_unstable_gains_are_a_result_and_an_exit_status(self):
        gains = (CONFIG / 'improved.yaml').read_text().replace('kappa_a: 8', 'kappa_a: 60')
        printed = self.figures(self.file(gains), status=1)
        self.assertFalse(printed['stable'])
        self.assertIn('kappa_a = 60 is too large: stable below', printed['advice'])

    def test_reads_the_configuration_of_a_predictive_node_that_keeps_its_slip(self):
        node = ('predictive.yaml', 'jackal.yaml', 'plant_model.yaml')
        self.assertTrue(self.figures(self.file('slip: {file: /var/lib/jackal/slip.yaml}\n', *node))['stable'])
        self.assertIn('slip.fil', self.refusal(self.file('slip: {fil: /var/lib/jackal/slip.yaml}\n', *node)))

    def test_certifies_the_confidence_box_of_an_identified_plant(self):
        known, narrow, wide = (self.file('plant_model: {dead_time: 0.08, lag: 0.00636, velocity_loop_integral: 0.678' + widths + '}') for widths in (
            '', ', dead_time_half_width: 0.01, gain_half_width: 0.05', ', dead_time_half_width: 0.01, gain_half_width: 2.0'))
        for preset in (IMPROVED, PREDICTIVE):
            self.assertNotIn('confidence_box', self.figures(preset, '--plant', known))
            printed = self.figures(preset, '--plant', narrow)
            box = printed['confidence_box']
            self.assertGreaterEqual(box['loop_spectral_radius'], printed['loop_spectral_radius'], preset)
            for margin in ('gain_margin', 'delay_margin_s'):
                self.assertLess(box[margin], printed[margin], preset)
            self.assertTrue(box['stable'], preset)
        printed = self.figures(PREDICTIVE, '--plant', wide, status=1)
        self.assertTrue(printed['stable'], 'as the model says')
        self.assertFalse(printed['confidence_box']['stable'])

    def test_searches_an_irregular_clock_where_asked(self):
        # A robot with which the loop is unstable on a regular one, so that nothing has to be searched.
        slow = self.file('plant_model: {dead_time: 0.4, lag: 0.006, velocity_loop_integral: 0.7}\n')
        model = self.file('predictive: {belief_rate: 1000, action_rate: 50, speed_process_noise: 0.01, disturbance_process_noise: 0.01,\n'
                          '  dead_time_deviation: 0.03}\n'
                          'plant_model: {dead_time: 0.08, lag: 0.006, velocity_loop_integral: 0.7}\n')
        jitter = self.figures(model, '--plant', slow, '--jitter', status=1)['jitter']
        self.assertEqual([jitter[key] for key in ('sequences', 'any_phase', 'jitter_margin_s', 'lost_samples')], [10000, False, 0.0, 0])
        printed = self.figures(model, '--plant', slow, status=1)
        self.assertNotIn('jitter', printed)
        self.assertEqual((printed['stable'], printed['robot']['dead_time']), (False, 0.4), 'not as believed')
        self.assertIn('jitter', self.refusal(IMPROVED, '--jitter'))

    def test_bad_input_gives_one_clear_line(self):
        for arguments, words in (((), 'CONFIG.yaml'), (('/nowhere.yaml',), '/nowhere.yaml: cannot be read'), ((str(CONFIG / 'plant.yaml'),), 'controller.'),
                                 ((IMPROVED, '--plant', str(CONFIG / 'plant.yaml')), 'plant.yaml: has no plant_model.*'),
                                 ((IMPROVED, '--plant', self.file('')), 'no keys'),
                                 ((IMPROVED, '--plant', self.file('plant_model: {dead_time: 0.1, lag: -0.03}')), 'plant_model.lag = -0.03'),
                                 ((IMPROVED, '--plant', self.file('plant_model: {lag: 0.03}')), 'plant_model.dead_time: missing')):
            self.assertIn(words, self.refusal(*arguments))


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'analyze', '__main__')
