#!/usr/bin/python3
"""The sentences of the report against runs of now: answers, statements, and what the notes say."""

import csv
import io
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import rosunit

SOURCE = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(SOURCE / 'sim/report'))

import answers  # noqa: E402
import claims  # noqa: E402
import hypothesis  # noqa: E402
import thesis_report  # noqa: E402
from results import Results  # noqa: E402


def experiments(*arguments):
    return subprocess.check_output(['rosrun', 'jackal_aic', 'experiments', *arguments], text=True)


def row(*arguments):
    """The row of results of a step or square wave."""
    return next(csv.DictReader(io.StringIO(experiments(*arguments, '--csv', '-'))))


class Report(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        experiments('run', 'all', '--out', cls.directory.name)
        cls.results = Results(SOURCE, cls.directory.name)

    @classmethod
    def tearDownClass(cls):
        cls.directory.cleanup()

    def test_every_answer_holds_and_is_one_sentence(self):
        for question, answer, _ in answers.answered(self.results):
            self.assertTrue(answer.holds, question + ' ' + answer.text)
            self.assertEqual(len(re.findall(r'\.(?: |$)', answer.text)), 1, answer.text)

    def test_an_answer_that_the_runs_do_not_support_is_found(self):
        improved = claims.pick(self.results.comparable('table_5-9'), controller='improved')
        kept = improved.row['settling_s']
        improved.row['settling_s'] = '0.9'
        self.assertFalse(answers.faster_and_accurate(self.results).holds)
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
        notes = {name: ' '.join(experiment.get('note', '').split()) for name, experiment in self.results.experiments.items()}
        published = float(row('step', '--controller', 'diff_drive', '--plant', 'ground', '--step', '0.5')['settling_s'])
        for name in ('table_3-1b', 'figure_3-4', 'figure_5-24'):
            self.assertIn(f'it settles in {published:.2f} s at 0.5 m/s', notes[name])
        self.assertIn('With 4 s our standard controller reaches the set point too', notes['table_5-10'])
        square = row('square', '--controller', 'standard', '--plant', 'box', '--min', '0.1', '--max', '0.5', '--period', '4',
                     '--set', 'controller.printed=true')
        self.assertLess(abs(float(square['steady_error_pct'])), 1.0)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'report', '__main__')
