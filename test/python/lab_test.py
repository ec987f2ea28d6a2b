#!/usr/bin/python3
"""The lab: the thesis' experiments, their figures against the thesis and against the golden tables, and the command."""

import csv
import functools
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

import rosunit

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / 'sim/lab'))

import calibrate  # noqa: E402
import draws  # noqa: E402
import engine  # noqa: E402
import metrics  # noqa: E402
import motions  # noqa: E402
import robots  # noqa: E402
import thesis  # noqa: E402

PROGRAM = str(SOURCE / 'sim/lab/experiments')


def experiments(*arguments):
    """What the command prints, and its exit status."""
    done = subprocess.run(('/usr/bin/python3', PROGRAM) + arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True)
    return done.stdout, done.returncode


@functools.lru_cache(maxsize=None)
def rows(name, *controllers):
    """Rows of an experiment, by fewer controllers."""
    node = thesis.experiment(name)
    return thesis.rows(dict(node, controllers=list(controllers)) if controllers else node)


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

    def test_everything_is_drawn_for_quiet_hours(self):
        drawn = [robots.quiet_drive(1, number, 600.0) for number in range(300)]
        self.assertEqual({drive.controller for drive in drawn}, set(engine.CONTROLLERS))
        self.assertEqual({drive.plant for drive in drawn}, set(engine.PLANTS))
        self.assertEqual({drive.words.split()[0] for drive in drawn}, {'turn', 'circle', 'straight', 'arcs', 'joystick', 'stand'})
        self.assertEqual({drive.ratios[:3] for drive in drawn}, {(1.0, 1.0, 1.0)})
        self.assertEqual(str(robots.quiet_drive(1, 3, 600.0)), str(drawn[3]))


class Motions(unittest.TestCase):

    def test_a_square_alternates_and_its_second_rise_is_assessed(self):
        square = motions.square(0.1, 0.5, 2.0, 3)
        for time, speed in ((0.5, 0.1), (1.49, 0.1), (1.5, 0.5), (2.5, 0.1), (3.5, 0.5), (6.0, 0.5)):
            self.assertEqual(square.at(time), (speed, 0.0))
        self.assertEqual((square.start, square.end), (3.5, 4.5))

    def test_a_cycle_repeats_its_seed_within_its_bounds(self):
        cycle = motions.cycle(3, 30, 0.8, 0.6)
        self.assertEqual(cycle, motions.cycle(3, 30, 0.8, 0.6))
        self.assertEqual(len(cycle.set_points), 30)
        for _, speed, yaw_rate in cycle.set_points:
            self.assertTrue(abs(speed) <= 0.8 and abs(yaw_rate) <= 0.6)

    def test_what_cannot_be_driven_is_refused(self):
        for wrong, text in ((lambda: motions.step(0.0), 'step = 0: must be'), (lambda: motions.step(math.nan), 'step = nan: must be'),
                            (lambda: motions.step(1.0, 51.0), 'turn = 51'), (lambda: motions.square(1.0, 1.0), 'max = 1: must be'),
                            (lambda: motions.read({'forward': 0.5, 'speeed': 1.0}), 'speeed')):
            with self.assertRaisesRegex(ValueError, text):
                wrong()

    def test_friction_changes_the_arc_in_mid_run(self):
        profile = {'forward': 0.5, 'yaw_rate': 0.5, 'duration': 3.0}
        change = dict(profile, friction_changes=[{'time': 2.0, 'friction': 0.25}])
        as_before, changed = (engine.drive('ground', 'diff_drive', motions.read(node), {'plant.noise_scale': 0.0})
                              for node in (profile, change))
        self.assertEqual(as_before.yaw_rate[1990], changed.yaw_rate[1990])
        self.assertGreater(abs(changed.yaw_rate[-1] - as_before.yaw_rate[-1]), 0.02)

    def test_a_perturbation_changes_the_plant_and_not_the_model(self):
        before = engine.settings('box', 'predictive')
        for case in thesis.experiment('predictive_perturbations')['cases'][1:]:
            after = engine.settings('box', 'predictive', case['set'])
            self.assertNotEqual(after['plant'], before['plant'], case['label'])
            self.assertEqual(after['plant_model'], before['plant_model'], case['label'])


class Figures(unittest.TestCase):

    def test_the_plant_limit_follows_after_the_dead_time(self):
        row, drive = thesis.plant_limit('ground', motions.step(0.4), '')
        self.assertEqual(drive.speed[500 + 79], 0.0)
        self.assertAlmostEqual(drive.speed[500 + 180], 0.1 * 1.65, delta=0.003)
        self.assertAlmostEqual(drive.speed[-1], 0.4)
        self.assertLess(row['settling_s'], 0.4)

    def test_swings_count_what_goes_on(self):
        self.assertEqual(metrics.swings([1.0 - math.exp(-0.04 * i) for i in range(500)], 0.05), 0)
        self.assertEqual(metrics.swings([0.02 * math.cos(0.1 * i) for i in range(500)], 0.05), 0)
        self.assertGreater(metrics.swings([0.1 * math.cos(0.2 * i) for i in range(500)], 0.05), 10)
        up_and_back = [0.01 * i for i in range(100)] + [1.0 - 0.01 * i for i in range(50)]
        self.assertEqual(metrics.swings(up_and_back, 0.05), 1)

    def test_the_search_finds_the_first_limit_on_the_way(self):
        self.assertAlmostEqual(thesis.search_limit(1.0, 1000.0, lambda v: v < 37.0 or v > 100.0), 37.0, delta=0.4)
        self.assertAlmostEqual(thesis.search_limit(1.0, 1e-4, lambda v: v > 0.02), 0.02, delta=2e-4)
        self.assertEqual(thesis.search_limit(1.0, 50.0, lambda v: True), 50.0)


class Scenarios(unittest.TestCase):

    def test_every_experiment_has_its_drives(self):
        for node in thesis.experiments():
            self.assertGreater(len(thesis.runs(node)), 0, node['name'])
        for name in ('3-1a', '5-1', '5-2', '5-4', '5-5', '5-6', '5-9'):
            self.assertEqual(len(thesis.runs(thesis.experiment('table_' + name))), 2 * len(list(thesis.steps(name))))
        self.assertEqual(len(thesis.runs(thesis.experiment('table_5-10'))), 12)
        self.assertEqual(len(thesis.runs(thesis.experiment('table_5-7'))), 20)

    def test_every_override_is_read(self):
        sets = []

        def look(node):
            if isinstance(node, dict) and 'set' in node:
                sets.append(node['set'])
            for child in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
                look(child)

        look(thesis.experiments())
        self.assertGreater(len(sets), 40)
        for overrides in sets:
            thesis_gains = any(key.startswith('controller.') for key in overrides)
            engine.settings('ground', 'standard' if thesis_gains else 'predictive', overrides)

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
        if ours == golden:
            return True
        try:
            return abs(float(ours) - float(golden)) <= max(0.005, 0.01 * abs(float(golden)))
        except ValueError:
            return False

    def test_tables_are_unchanged(self):
        tables = sorted((SOURCE / 'test/closed_loop/golden').glob('*.csv'))
        self.assertEqual(len(tables), 10)
        for table in tables:
            with open(table, newline='') as file:
                golden = list(csv.DictReader(file))
            found = rows(table.stem)
            self.assertEqual(len(found), len(golden), table.stem)
            for index, (ours, kept) in enumerate(zip(found, golden)):
                for column in engine.COLUMNS:
                    cell = engine.number(ours.get(column))
                    self.assertTrue(self.alike(cell, kept[column]),
                                    '{} row {} {}: {}, golden {}'.format(table.stem, index, column, cell, kept[column]))


@functools.lru_cache(maxsize=None)
def compared(name):
    """Rows of a table of the thesis with ours, by (row, column): settling, rise, integrator."""
    items = calibrate.compared([name])
    found = engine.parallel(single_step, items)
    return {(row['row'], row.get('column', '')): dict(ours, thesis=row, integrator=integrator)
            for (row, integrator), ours in zip(items, found)}


def single_step(item):
    return thesis.thesis_step(*item)[0]


class Trends(unittest.TestCase):
    """The tables of the thesis on the calibrated plants with their noise; its statements are in the report's test."""

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

    def test_euler_is_compared_only_where_it_converges(self):
        # tau = 0.001 at both rates, kappa_mu = 0.5 and 1 at 50 Hz, and the improved controller
        found = [row for name in ('5-1', '5-2', '5-4', '5-5', '5-6', '5-9') for row in compared(name).values()]
        self.assertEqual(sum(row['integrator'] == 'exact' for row in found), 5)
        self.assertTrue(all(row['settling_s'] is not None for row in found))

    def test_eulers_limits_agree_with_the_spectral_radius(self):
        limit = list(thesis.steps('5-7'))[2]  # 50 Hz: the thesis says 0.1, h kappa_mu Pi_mu / tau^2 = 2 at 0.135
        on_plant, belief = (search(limit, 'euler', 'controller.kappa_mu', thesis.MOST)[0]['kappa_mu']
                            for search in (thesis.usable_on_plant, thesis.usable_belief))
        self.assertAlmostEqual(belief, 0.12, delta=0.02)
        self.assertAlmostEqual(on_plant / belief, 1.0, delta=0.05)
        self.assertEqual(thesis.usable_belief(limit, 'exact', 'controller.kappa_mu', thesis.MOST)[0]['kappa_mu'], 1000.0)


class Predictive(unittest.TestCase):

    def test_is_as_fast_as_open_loop_and_exact(self):
        found, bars = rows('predictive_steps', 'predictive', 'diff_drive', 'improved'), engine.bars()['predictive_steps']
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
        found, bars = rows('predictive_perturbations', 'predictive'), engine.bars()['predictive_perturbations']
        self.assertEqual(len(found), 26)
        for row in found:
            self.assertLessEqual(row['settling_s'], bars['settling'], row['label'])
            self.assertLessEqual(abs(row['steady_error_pct']), bars['steady_error'], row['label'])

    def test_tracks_square_waves_as_well_as_the_plant_lets(self):
        found = rows('predictive_squares', 'predictive', 'improved', 'plant_limit')
        chosen = only(found, controller='predictive')
        self.assertEqual(len(chosen), 6)
        for row in chosen:
            limit, improved = (same(found, row, other)['tracking_rms_mps'] for other in ('plant_limit', 'improved'))
            self.assertTrue(limit <= row['tracking_rms_mps'] <= 1.03 * limit, row['label'])
            self.assertLessEqual(row['tracking_rms_mps'], 0.80 * improved, row['label'])

    def test_learns_the_slip_within_three_seconds(self):
        found, bars = rows('slip_turns', 'predictive', 'standard', 'improved'), engine.bars()['slip_turns']
        self.assertEqual(len(found), 30)
        for row in found:
            if row['controller'] == 'predictive':
                self.assertLessEqual(abs(row['steady_error_pct']), bars['steady_error'], row['label'])
                self.assertLessEqual(abs(row['belief_bias_pct']), 2.0, row['label'])
            else:
                self.assertGreater(abs(row['steady_error_pct']), 4.0, row['label'])
                self.assertGreater(abs(row['belief_bias_pct']), 4.0, row['label'])

    def test_drives_straight_with_any_track(self):
        first, *others = rows('slip_straight', 'predictive')
        bars = engine.bars()['slip_straight']
        self.assertEqual(len(others), 2)
        for row in others:
            self.assertAlmostEqual(row['settling_s'], first['settling_s'], delta=0.01 * bars['settling_spread'] * first['settling_s'])
            self.assertAlmostEqual(row['steady_error_pct'], first['steady_error_pct'], delta=bars['steady_error_spread'])

    def test_settles_the_same_at_every_rate(self):
        for plant in engine.PLANTS:
            settling = [row['settling_s'] for row in only(rows('predictive_rates', 'predictive'), plant=plant)]
            self.assertEqual(len(settling), 5)
            self.assertLessEqual(max(settling), (1.0 + 0.01 * engine.bars()['predictive_rates']['settling_spread']) * min(settling))

    def test_believes_as_well_as_a_kalman_filter(self):
        found, most = rows('belief_accuracy', 'predictive', 'improved'), engine.bars()['belief_accuracy']['error_over_kalman_filter']
        chosen = only(found, controller='predictive')
        self.assertEqual(len(chosen), 2)
        for row in chosen:
            for figure in ('belief_rms_mps', 'belief_rms_radps'):
                self.assertLessEqual(row[figure], most * only(found, controller='kalman_filter', plant=row['plant'])[0][figure])
                self.assertLessEqual(row[figure], 0.1 * only(found, controller='improved', plant=row['plant'])[0][figure])


class Calibration(unittest.TestCase):

    def test_a_file_keeps_everything_but_the_fitted_values(self):
        before = (SOURCE / 'config/plant_box.yaml').read_text()
        after = calibrate.with_fitted_values(before, {'plant.dead_time': 0.123, 'plant.motor_lag': 1e-5,
                                                      'plant.velocity_loop_integral': 7.0})
        for line in ('  dead_time: 0.123 ', '  motor_lag: 1.0e-05 ', '  velocity_loop_integral: 7.0 '):
            self.assertIn(line, after)
        self.assertEqual(after.count('\n'), before.count('\n'))
        with self.assertRaisesRegex(ValueError, 'dead_time: not a key of the file'):
            calibrate.with_fitted_values('plant:\n', {'plant.dead_time': 0.1})

    def test_the_error_is_the_logarithm_of_the_ratio(self):
        self.assertEqual(calibrate.errors({'settling': 0.8, 'rise': 0.4}, 0.4, None), [math.log(2.0), calibrate.MISSING])

    def test_a_search_fits_better_than_its_start(self):
        task = calibrate.TASKS[0]._replace(tables=('5-9',), trends=())
        fit = calibrate.Fit(task, task.tables, 0)
        start = [math.log(0.15), math.log(0.05), math.log(3.0)]
        self.assertLess(fit.cost(fit.descend(start, 12)), fit.cost(start))


class Command(unittest.TestCase):

    def test_a_step_is_printed_as_a_short_table_unless_a_row_is_asked_for(self):
        text, status = experiments('step', '--controller', 'predictive', '--plant', 'box', '--step', '0.5')
        self.assertEqual(status, 0)
        self.assertTrue(text.startswith('experiment          step\ncontroller          predictive\n'), text)
        with tempfile.TemporaryDirectory() as directory:
            text, status = experiments('step', '--controller', 'improved', '--plant', 'box', '--step', '0.5', '--set',
                                       'controller.tau=0.01', '--set', 'plant.dead_time=0.05', '--csv', directory + '/row.csv',
                                       '--trace', directory + '/trace.csv')
            self.assertEqual((text, status), ('Wrote {0}/row.csv\nWrote {0}/trace.csv\n'.format(directory), 0))
            lines = pathlib.Path(directory, 'row.csv').read_text().splitlines()
            self.assertEqual(lines[0], ','.join(engine.COLUMNS))
            self.assertTrue(lines[1].startswith('step,improved,box,0.5,0,1000,50,exact,0.01,0.1,8,3,'), lines[1])
            self.assertEqual(len(pathlib.Path(directory, 'trace.csv').read_text().splitlines()), 1 + 450)

    def test_a_step_as_printed_is_the_row_of_the_report(self):
        for name in ('3-1a', '5-9'):
            found = rows('table_' + name)
            for index, step in list(enumerate(thesis.steps(name)))[:2]:
                for row in found[2 * index:2 * index + 2]:  # one of each integrator
                    sets = dict(step['overrides'], **{'controller.printed': 'true', 'controller.integrator': row['integrator']})
                    flags = [part for key, value in sets.items() for part in ('--set', '{}={}'.format(key, value))]
                    text, status = experiments('step', '--controller', step['controller'], '--plant', step['plant'], '--step',
                                               str(step['step']), '--csv', '-', *flags)
                    self.assertEqual(status, 0, text)
                    seen = text.splitlines()[1].split(',')
                    wanted = engine.table_text([row]).splitlines()[1].split(',')
                    figures = engine.COLUMNS.index('thesis_settling_s')
                    self.assertEqual(seen[1:figures], wanted[1:figures])

    def test_an_experiment_prints_its_table(self):
        with tempfile.TemporaryDirectory() as directory:
            text, status = experiments('run', 'figure_4-5', '--out', directory, '--jobs', '1')
            self.assertEqual(status, 0)
            self.assertIn('Wrote {}/figure_4-5.csv\n'.format(directory), text)
            self.assertIn('state_space', text)

    def test_the_list_names_every_experiment(self):
        text, status = experiments('list')
        self.assertEqual(([line.split()[0] for line in text.splitlines()], status), ([n['name'] for n in thesis.experiments()], 0))

    def test_every_command_answers_help(self):
        for command in experiments('--help')[0].split('\n  experiments ')[1:]:
            text, status = experiments(command.split()[0], '--help')
            self.assertEqual(status, 0)
            self.assertTrue(text.startswith('usage: experiments ' + command.split()[0]), text)

    def test_errors_are_one_line_that_says_what_is_wrong(self):
        step = ('step', '--controller', 'improved', '--plant', 'box')
        for arguments, complaint in (
            (('fly',), "command = 'fly': unknown; known: list, run, step"), (('fl\033y',), "command = 'fl\\x1by': unknown"),
            (('run', 'table_9-9', '--out', '/nonexistent/x'), "experiment = 'table_9-9': unknown; known: all, table_3-1a"),
            (('run', 'table_5-9', '--out', '/proc/x'), "out = '/proc/x': cannot be created"),
            (step + ('--step', 'fast'), "step: argument --step: invalid float value: 'fast'; options: --controller"),
            (step + ('--step', '1', '--set', 'plant.dead_time'), "set = 'plant.dead_time': expected key=value"),
            (step + ('--step', '1', '--set', 'plant.deadtime=1'), 'plant.deadtime = 1: unknown key'),
            (step + ('--step', '1', '--csv', '/nonexistent/x'), "'/nonexistent/x': cannot be written"),
            (('step', '--controller', 'improvd', '--plant', 'box', '--step', '1'), "controller = 'improvd': unknown; known:"),
            (('robustness', '--out', '/tmp', '--draws', '0'), 'draws = 0: must be in [1, 1e+06]'),
            (('detection',), 'detection: needs either --out or --quiet-hours'),
            (('detection', '--quiet-hours', '0.3'), 'quiet-hours = 0.3: must be a multiple of 0.5'),
            (('calibrate', '--out', '/tmp', '--plant', 'moon'), "calibrate: argument --plant: invalid choice: 'moon'")):
            text, status = experiments(*arguments)
            self.assertEqual((text.count('\n'), status), (1, 1), text)
            self.assertTrue(text.startswith('experiments: ' + complaint), text)

    def test_absent_recordings_are_skipped(self):
        text, status = experiments('real', '--data', '/nonexistent/recordings')
        self.assertEqual((text.split(':')[0], status), ('skipped', 0))


class Report(unittest.TestCase):

    def test_it_can_be_drawn(self):
        program = str(SOURCE / 'sim/report/thesis_report.py')
        self.assertIn('usage:', subprocess.check_output(['/usr/bin/python3', program, '--help'], universal_newlines=True))


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'lab', '__main__')
