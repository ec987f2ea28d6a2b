#!/usr/bin/python3
"""The programs of src/examples, as users run them."""

import os
import re
import subprocess
import unittest

import rosunit


def output(program):
    return subprocess.check_output([os.environ['JACKAL_AIC_DEVEL'] + '/share/jackal_aic/internal/' + program], universal_newlines=True)


class Examples(unittest.TestCase):

    def test_the_controller_reaches_its_set_point(self):
        self.assertRegex(output('controller_loop'), r'(?s)0\.0 s: 0\.000 m/s.*3\.0 s: 0\.50')

    def test_a_failing_encoder_is_named_and_the_robot_drives_on(self):
        self.assertRegex(output('failing_sensor'), '(?s)driving\n.*driving: left encoder')

    def test_the_tuned_gain_keeps_the_margins_that_were_wanted(self):
        found = re.search('\n.*kappa_a = .* keeps a gain margin of ([0-9.]+) and a delay margin of ([0-9.]+)', output('certify_and_tune'))
        self.assertGreaterEqual(float(found[1]), 2.0)
        self.assertGreaterEqual(float(found[2]), 0.05)

    def test_the_mecanum_robot_reaches_its_set_point(self):
        said = output('mecanum')
        self.assertIn('0.0 s: 0.000 m/s, 0.000 m/s, 0.000 rad/s', said)
        for speed, wanted in zip(re.search('3.0 s: (.*) m/s, (.*) m/s, (.*) rad/s', said).groups(), (0.3, 0.2, 0.4)):
            self.assertAlmostEqual(float(speed), wanted, delta=0.01)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'examples', '__main__')
