#!/usr/bin/python3
"""The steps of the controllers and of the fault monitor do not grow: callgrind counts their instructions.

A count depends on the compiler, its options, the processor and Eigen; with others than those of the record there is nothing to
compare. For a step that is longer on purpose, write the new count into instructions.yaml and the reason into the commit.
"""

import os
import pathlib
import re
import shutil
import subprocess
import unittest

import rosunit
import yaml

RECORD = pathlib.Path(__file__).with_name('instructions.yaml')
LARGEST_GROWTH = 1.10
REPETITIONS = 1000
PROGRAM = os.environ['JACKAL_AIC_DEVEL'] + '/share/jackal_aic/internal/tick_benchmark'


def output(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=True).stdout


def count(tick):
    """Instructions of one step."""
    said = output('valgrind', '--tool=callgrind', f'--callgrind-out-file={os.devnull}', '--toggle-collect=*repeated*',
                  PROGRAM, '--repeat', tick, str(REPETITIONS))
    return round(int(re.search(r'Collected : (\d+)', said).group(1)) / REPETITIONS)


class Instructions(unittest.TestCase):

    def test_no_step_grows_by_more_than_a_tenth(self):
        if shutil.which('valgrind') is None:
            self.skipTest('valgrind is not installed')
        record = yaml.safe_load(RECORD.read_text())
        compiler = output(PROGRAM, '--compiler').strip()
        if compiler != record['compiler']:
            self.skipTest(f"built by {compiler}, the record is of {record['compiler']}")
        ticks = output(PROGRAM, '--list').split()
        self.assertEqual(sorted(ticks), sorted(record['instructions']))
        grown = []
        for tick in ticks:
            now, then = count(tick), record['instructions'][tick]
            print(f'{tick}: {now} instructions, {then} in the record')
            self.assertGreater(now, 0, tick)
            if now > LARGEST_GROWTH * then:
                grown.append(f'{tick}: {now} instead of {then}')
        self.assertEqual(grown, [])


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'instructions', '__main__')
