#!/usr/bin/python3
"""The lab: the thesis' experiments, their figures against the thesis and against the golden tables, and the command."""

import functools
import math
import pathlib
import sys
import tempfile
import unittest

from drives import SOURCE, run
import calibrate
import draws
import engine
import metrics
import motions
import numpy
import robots
import rosunit
import state_space
import thesis

sys.path.insert(0, str(SOURCE / 'test/sim/report'))
from report_test import Report, results  # noqa: E402, F401: the sentences of the report are tests of the same runs
from results import read, rows_of  # noqa: E402


@functools.lru_cache(maxsize=None)
def rows(name):
    """Rows of an experiment."""
    return [run.row for run in results().runs[name]]


def only(found, **wanted):
    return [row for row in found if all(row.get(key) == value for key, value in wanted.items())]


def same(found, row, controller):
    """The row of another controller in the same case."""
    return only(found, controller=controller, **{key: row.get(key) for key in ('plant', 'label', 'step_mps', 'step_radps')})[0]


class Draws(unittest.TestCase):

    def test_are_those_of_the_standard_generator(self):
        draw = draws.Draws(5489)
        for _ in range(9999):
            draw.word()
        self.assertEqual(draw.word(), 9981545732273789042)  # as the C++ standard asks of std::mt19937_64

    def test_robots_differ_within_their_bounds_and_repeat(self):
        self.assertEqual(robots.reality(3), robots.reality(3))
        drawn = [robots.reality(seed) for seed in range(20)]
        self.assertGreaterEqual(len({robot['plant.wheel_offset'] for robot in drawn}), 19)
        for robot in drawn:
            for key, low, high in robots.REALITY:
                self.assertTrue(low <= robot['plant.' + key] <= high)
        self.assertEqual(engine.settings('real', 'predictive', drawn[0])['plant']['imu_rate'], 80.0)


class Motions(unittest.TestCase):

    def test_a_square_alternates_and_its_second_rise_is_assessed(self):
        square = motions.square(0.1, 0.5, 2.0, 3)
        for time, speed in ((0.5, 0.1), (1.49, 0.1), (1.5, 0.5), (2.5, 0.1), (3.5, 0.5), (6.0, 0.5)):
            self.assertEqual(square.at(time), (speed, 0.0))
        self.assertEqual((square.start, square.end), (3.5, 4.5))

    def test_what_cannot_be_driven_is_refused(self):
        for wrong, text in ((lambda: motions.step(0.0), 'step = 0: must be'), (lambda: motions.step(math.nan), 'step = nan: must be'),
                            (lambda: motions.step(1.0, 51.0), 'turn = 51'), (lambda: motions.square(1.0, 1.0), 'max = 1: must be'),
                            (lambda: motions.read({'forward': 0.5, 'speeed': 1.0}), 'speeed')):
            with self.assertRaisesRegex(ValueError, text):
                wrong()


class Figures(unittest.TestCase):

    def test_swings_count_what_goes_on(self):
        self.assertEqual(metrics.swings([1.0 - math.exp(-0.04 * i) for i in range(500)], 0.05), 0)
        self.assertEqual(metrics.swings([0.02 * math.cos(0.1 * i) for i in range(500)], 0.05), 0)
        self.assertGreater(metrics.swings([0.1 * math.cos(0.2 * i) for i in range(500)], 0.05), 10)
        up_and_back = [0.01 * i for i in range(100)] + [1.0 - 0.01 * i for i in range(50)]
        self.assertEqual(metrics.swings(up_and_back, 0.05), 1)


class PointMass(unittest.TestCase):

    GAINS = {'tau': 0.5, 'kappa_mu': 0.1, 'kappa_a': 3.0, 'orders': 1, 'belief_rate': 100.0,  # each term of 4-4 is another round number
             'state_variances': [0.5, 0.25, 0.2], 'sensory_variances': [0.125, 0.1, 0.0625]}

    def test_matches_equations_44_and_46_for_one_order(self):
        a, b = state_space.state_space_model(self.GAINS)
        numpy.testing.assert_allclose(a, [[-1.6, 0.6, 0.8, 0.0], [-0.4, -2.8, 0.0, 1.0], [24.0, 0.0, -24.0, 0.0], [0.0, 30.0, 0.0, -30.0]])
        numpy.testing.assert_allclose(b, [0.8, 0.4, 0.0, 0.0])

    def test_rests_at_the_set_point(self):
        for orders in range(6):
            a, b = state_space.state_space_model({
                'tau': 0.03, 'kappa_mu': 0.01, 'kappa_a': 8.0, 'orders': orders, 'state_variances': [1.5, 2.0, 4.0, 8.0, 16.0, 32.0],
                'sensory_variances': [2.0, 2.0] + 4 * [1e5]})
            rest = numpy.zeros(len(b))
            rest[[0, orders + 1]] = 1.0
            numpy.testing.assert_allclose(-numpy.linalg.solve(a, b), rest, atol=1e-6)

    def test_the_action_moves_one_step_after_the_belief(self):
        time, output, belief = state_space.step_response(self.GAINS, 2.0, 0.03)
        numpy.testing.assert_allclose(time, [0.0, 0.01, 0.02])
        numpy.testing.assert_allclose(belief, [0.0, 0.016, 0.016 + 0.01 * (-0.0256 + 0.0048 + 1.6)])
        numpy.testing.assert_allclose(output, [0.0, 0.0, 0.01 * 24.0 * 0.016])


class Scenarios(unittest.TestCase):

    def test_jobs_do_not_change_the_files(self):
        with tempfile.TemporaryDirectory() as directory:
            for jobs in (1, 3):
                thesis.run(['table_5-9', 'figure_4-5'], '{}/{}'.format(directory, jobs), jobs)
            for name in ('table_5-9', 'table_5-9_traces', 'figure_4-5', 'figure_4-5_traces'):
                one, many = (pathlib.Path(directory, jobs, name + '.csv').read_bytes() for jobs in '13')
                self.assertEqual(one, many, name)


class Golden(unittest.TestCase):
    """Numbers within 1 % or 0.005 of the golden tables: another compiler or processor rounds differently, a changed model does not."""

    def alike(self, ours, golden):
        if not isinstance(ours, float) or not isinstance(golden, float):
            return ours == golden
        return abs(ours - golden) <= max(0.005, 0.01 * abs(golden))

    def test_tables_are_unchanged(self):
        tables = sorted((SOURCE / 'test/closed_loop/golden').glob('*.csv'))
        self.assertEqual(len(tables), 10)
        for table in tables:
            golden, found = rows_of(read(table)), rows(table.stem)
            self.assertEqual(len(found), len(golden), table.stem)
            for index, (ours, kept) in enumerate(zip(found, golden)):
                for column in engine.COLUMNS:
                    self.assertTrue(self.alike(ours[column], kept[column]),
                                    '{} row {} {}: {}, golden {}'.format(table.stem, index, column, ours[column], kept[column]))


@functools.lru_cache(maxsize=None)
def compared(name):
    """Rows of a table of the thesis with ours, by (row, column): settling, rise, integrator."""
    found = iter(rows('table_' + name))
    chosen = {}
    for row in thesis.steps(name):
        for integrator in thesis.INTEGRATORS if row['controller'] != 'diff_drive' else ('exact',):
            ours = next(found)
            if integrator == thesis.comparable_integrator(row):
                chosen[row['row'], row.get('column', '')] = dict(ours, thesis=row, integrator=integrator)
    return chosen


class Trends(unittest.TestCase):
    """The tables of the thesis on the calibrated plants with their noise; its statements are in Report."""

    def error(self, *names):
        single = [error for name in names for row in compared(name).values()
                  for error in calibrate.errors(row['thesis'], row['settling_s'], row['rise_s'])]
        return sum(single) / len(single)

    def test_the_tables_fit(self):
        box, ground, bars = ('5-1', '5-2', '5-4', '5-5', '5-6', '5-9'), ('3-1a', '3-1b'), engine.bars()['thesis_fit']
        self.assertLessEqual(self.error(*box), bars['box'])
        self.assertLessEqual(self.error(*ground), bars['ground'])
        self.assertLessEqual(self.error(*box, *ground), bars['all'])

    def test_kappa_mu_and_the_improved_controller_keep_their_bars(self):
        table, bars = compared('5-5'), engine.bars()['thesis_trends']
        self.assertLessEqual(table['1', 'f = 1kHz']['settling_s'],
                             bars['kappa_mu_1_over_0_01'] * table['0.01', 'f = 1kHz']['settling_s'])
        improved, standard = (compared('5-9')['0.5', column] for column in ('Improved', 'Standard'))
        ratio = improved['settling_s'] / standard['settling_s']
        self.assertTrue(bars['least_improved_over_standard'] <= ratio <= bars['most_improved_over_standard'], ratio)
        self.assertLess(improved['rise_s'], 0.7 * standard['rise_s'])

    def test_unstable_cases_diverge_by_euler_and_settle_exactly(self):
        for name in ('5-4', '5-5'):
            unstable = [row for row in thesis.steps(name) if row.get('unstable')]
            self.assertEqual(len(unstable), 1)
            euler, exact = (thesis.thesis_step(unstable[0], integrator)[0] for integrator in thesis.INTEGRATORS)
            self.assertFalse(euler['bounded'])
            self.assertEqual([euler[figure] for figure in ('settling_s', 'rise_s', 'overshoot_pct')], [None] * 3)
            self.assertIsNotNone(exact['settling_s'])


class Predictive(unittest.TestCase):

    def test_is_as_fast_as_open_loop_and_exact(self):
        found, bars = rows('predictive_steps'), engine.bars()['predictive_steps']
        chosen = only(found, controller='predictive')
        self.assertEqual(len(chosen), 8)
        for row in chosen:
            self.assertLessEqual(row['settling_s'], bars['settling_over_open_loop'] * same(found, row, 'diff_drive')['settling_s'])
            self.assertLessEqual(row['overshoot_pct'], bars['overshoot'])
            self.assertLessEqual(abs(row['steady_error_pct']), bars['steady_error'])
            self.assertLessEqual(row['tracking_rms_radps'], 0.01)
        half, = only(chosen, plant='box', step_mps=0.5)
        self.assertLessEqual(half['settling_s'], bars['settling_over_improved'] * same(found, half, 'improved')['settling_s'])

    def test_stays_exact_and_quick_on_a_robot_that_is_not_its_model(self):
        found, bars = only(rows('predictive_perturbations'), controller='predictive'), engine.bars()['predictive_perturbations']
        self.assertEqual(len(found), 26)
        for row in found:
            self.assertLessEqual(row['settling_s'], bars['settling'], row['label'])
            self.assertLessEqual(abs(row['steady_error_pct']), bars['steady_error'], row['label'])

    def test_learns_the_slip_within_three_seconds(self):
        bars = engine.bars()['slip_turns']
        found = [row for row in rows('slip_turns') if row['controller'] in ('predictive', 'standard', 'improved')]
        self.assertEqual(len(found), 30)
        for row in found:
            if row['controller'] == 'predictive':
                self.assertLessEqual(abs(row['steady_error_pct']), bars['steady_error'], row['label'])
                self.assertLessEqual(abs(row['belief_bias_pct']), 2.0, row['label'])
            else:
                self.assertGreater(abs(row['steady_error_pct']), 4.0, row['label'])
                self.assertGreater(abs(row['belief_bias_pct']), 4.0, row['label'])

    def test_believes_as_well_as_a_kalman_filter(self):
        found, most = rows('belief_accuracy'), engine.bars()['belief_accuracy']['error_over_kalman_filter']
        chosen = only(found, controller='predictive')
        self.assertEqual(len(chosen), 2)
        for row in chosen:
            for figure in ('belief_rms_mps', 'belief_rms_radps'):
                self.assertLessEqual(row[figure], most * only(found, controller='kalman_filter', plant=row['plant'])[0][figure])
                self.assertLessEqual(row[figure], 0.1 * only(found, controller='improved', plant=row['plant'])[0][figure])


class Calibration(unittest.TestCase):

    def test_a_search_fits_better_than_its_start(self):
        task = calibrate.TASKS[0]._replace(tables=('5-9',), trends=())
        fit = calibrate.Fit(task, 0)
        start = [math.log(0.15), math.log(0.05), math.log(3.0)]
        self.assertLess(fit.cost(fit.descend(start, 12)), fit.cost(start))


class Command(unittest.TestCase):

    def test_a_step_is_printed_as_a_short_table_unless_a_row_is_asked_for(self):
        text, status = run('experiments', 'step', '--controller', 'predictive', '--plant', 'box', '--step', '0.5')
        self.assertEqual(status, 0)
        self.assertRegex(text, r'^experiment +step\ncontroller +predictive\n')
        with tempfile.TemporaryDirectory() as directory:
            text, status = run('experiments', 'step', '--controller', 'improved', '--plant', 'box', '--step', '0.5', '--set',
                                       'controller.tau=0.01', '--set', 'plant.dead_time=0.05', '--csv', directory + '/row.csv',
                                       '--trace', directory + '/trace.csv')
            self.assertEqual((text, status), ('Wrote {0}/row.csv\nWrote {0}/trace.csv\n'.format(directory), 0))
            lines = pathlib.Path(directory, 'row.csv').read_text().splitlines()
            self.assertEqual(lines[0], ','.join(engine.COLUMNS))
            self.assertTrue(lines[1].startswith('step,improved,box,0.5,0,1000,50,exact,0.01,0.1,8,3,'), lines[1])
            self.assertEqual(len(pathlib.Path(directory, 'trace.csv').read_text().splitlines()), 1 + 450)

    def test_errors_are_one_line_that_says_what_is_wrong(self):
        step = ('step', '--controller', 'improved', '--plant', 'box')
        for arguments, complaint in (
            (('fl\033y',), "argument COMMAND: invalid choice: 'fl\\x1by' (choose from 'list', 'run', 'step'"),
            (('run', 'table_9-9', '--out', '/nonexistent/x'), "experiment = 'table_9-9': unknown; known: all, table_3-1a"),
            (('run', 'table_5-9', '--out', '/proc/x'), "out = '/proc/x': cannot be created"),
            (step + ('--step', 'fast'), "step: argument --step: invalid float value: 'fast'; see experiments step --help"),
            (step + ('--step', '1', '--set', 'plant.dead_time'), "set = 'plant.dead_time': expected key=value"),
            (step + ('--step', '1', '--set', 'plant.deadtime=1'), 'plant.deadtime = 1: unknown key'),
            (step + ('--step', '1', '--csv', '/nonexistent/x'), "'/nonexistent/x': cannot be written"),
            (('step', '--controller', 'improvd', '--plant', 'box', '--step', '1'), "controller = 'improvd': unknown; known:"),
            (('robustness', '--out', '/tmp', '--draws', '0'), 'draws = 0: must be in [1, 1e+06]'),
            (('detection',), 'detection: needs either --out or --quiet-hours'),
            (('detection', '--quiet-hours', '0.3'), 'quiet-hours = 0.3: must be a multiple of 0.5'),
            (('calibrate', '--out', '/tmp', '--plant', 'moon'), "calibrate: argument --plant: invalid choice: 'moon'")):
            text, status = run('experiments', *arguments)
            self.assertEqual((text.count('\n'), status), (1, 1), text)
            self.assertTrue(text.startswith('experiments: ' + complaint), text)

    def test_absent_recordings_are_skipped(self):
        text, status = run('experiments', 'real', '--data', '/nonexistent/recordings')
        self.assertEqual((text.split(':')[0], status), ('skipped', 0))


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'lab', '__main__')
