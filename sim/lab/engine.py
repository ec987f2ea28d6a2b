"""Drives of a study: one simulated drive is one row of its table. Rows are computed by all cores and written as CSV."""

import functools
import multiprocessing
import os
import pathlib
import signal
import sys

import jackal_aic
import numpy
import pandas
import tqdm
import yaml

import metrics
import motions

PACKAGE = pathlib.Path(__file__).resolve().parents[2]
CONTROLLERS = ('diff_drive', 'standard', 'improved', 'tuned', 'predictive')
PLANTS = ('box', 'ground')  # whose drive train was fitted to the thesis' tables

COLUMNS = ('experiment', 'controller', 'plant', 'step_mps', 'step_radps', 'belief_hz', 'action_hz', 'integrator', 'tau', 'kappa_mu',
           'kappa_a', 'orders', 'settling_s', 'rise_s', 'overshoot_pct', 'steady_error_pct', 'bounded', 'thesis_settling_s',
           'thesis_rise_s', 'label', 'tracking_rms_mps', 'tracking_rms_radps', 'belief_rms_mps', 'belief_rms_radps',
           'belief_bias_pct', 'effective_track')
TRACE_COLUMNS = ('run', 'label', 'time_s', 'set_point_mps', 'velocity_mps', 'measured_mps', 'belief_mps', 'set_point_radps',
                 'yaw_rate_radps', 'measured_radps', 'belief_radps', 'command_left_radps', 'command_right_radps')
TRACE_STEP = 0.01  # s
SIX_DIGITS = '{:.6g}'


@functools.lru_cache(maxsize=None)
def read_yaml(path):
    """A YAML file of the package, read once."""
    try:
        return yaml.safe_load((PACKAGE / path).read_text())
    except (OSError, yaml.YAMLError) as error:
        raise ValueError('{}: {}'.format(path, error)) from error


def bars():
    """The bars, by study and figure."""
    return read_yaml('sim/lab/acceptance.yaml')


def settings(robot, controller, overrides=None):
    return jackal_aic.settings(robot, controller, overrides or {})


def require_range(name, value, low, high):
    if not low <= value <= high:
        raise ValueError('{} = {:g}: must be in [{:g}, {:g}]'.format(name, value, low, high))


# ---- many drives

def _ignore_interrupts():
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def parallel(task, items, jobs=0, title=''):
    """[task(item) for item in items] by `jobs` processes (0: one per core), with a progress bar on a terminal."""
    items = list(items)
    bar = functools.partial(tqdm.tqdm, total=len(items), desc=title, disable=None, leave=False, file=sys.stderr)
    jobs = min(jobs or os.cpu_count(), len(items))
    if jobs <= 1:
        return [task(item) for item in bar(items)]
    with multiprocessing.get_context('fork').Pool(jobs, _ignore_interrupts) as pool:
        return list(bar(pool.imap(task, items)))


def drive(robot, controller, motion, overrides=None, **options):
    """simulate() along a motion."""
    drive = jackal_aic.simulate(robot, controller, motion.set_points, duration=motion.duration, faults=motion.faults,
                                overrides=overrides, **dict({'monitor': False}, **options))
    drive.controller_name = controller if isinstance(controller, str) else 'diff_drive'
    return drive


# ---- rows

def described(values):
    """Columns that describe a controller."""
    gains, structure = values['controller'], values['structure']
    if structure == 'diff_drive':
        return {'action_hz': gains['rate']}
    row = {'belief_hz': gains['belief_rate'], 'action_hz': gains['action_rate']}
    if structure == 'predictive':
        return dict(row, integrator='exact', kappa_mu=gains['belief_learning_rate'], kappa_a=gains['action_learning_rate'])
    return dict(row, **{name: gains[name] for name in ('integrator', 'tau', 'kappa_mu', 'kappa_a', 'orders')})


def step_columns(motion):
    if motion.channel is None:
        return {}
    (speed, speed_after), (turn, turn_after) = motion.step()
    return {'step_mps': speed_after - speed, 'step_radps': turn_after - turn}


def result(robot, controller, motion, overrides=None, as_printed=False, label='', with_errors=False, columns=None):
    """A drive as a row of the results, and the drive."""
    found = drive(robot, controller, motion, overrides, as_printed=as_printed)
    values = settings(robot, controller, overrides)
    found.controller_name = values['structure']
    row = {'controller': controller, 'plant': robot, 'label': label, **described(values), **step_columns(motion),
           **metrics.response(found, motion), 'effective_track': found.effective_track, **(columns or {})}
    if with_errors and row['bounded']:
        row.update(metrics.errors(found, motion))
    return row, found


# ---- files

def frame(rows, columns=COLUMNS):
    """Rows, which are dicts, as a table of some columns; truth values are 0 and 1."""
    table = pandas.DataFrame(rows, columns=list(columns))
    return table.astype({name: int for name in table.select_dtypes(bool)})


def csv_text(table):
    """A table as CSV, numbers with six digits."""
    return table.to_csv(index=False, float_format='%.6g')


def filled(table):
    """A table without the columns that are empty."""
    return table.replace('', numpy.nan).dropna(axis='columns', how='all')


def shown(table):
    """The filled columns of a table as text for a terminal."""
    return filled(table).fillna('').to_string(index=False, float_format=SIX_DIGITS.format)


def trace(run, label, drive):
    """A table with a row each 10 ms."""
    due = numpy.flatnonzero(numpy.diff(numpy.floor((drive.time + 0.5 * motions.TICK) / TRACE_STEP), prepend=-1.0))
    values = (drive.time, drive.set_speed, drive.speed, drive.measured_speed, drive.believed_speed, drive.set_yaw_rate, drive.yaw_rate,
              drive.measured_yaw_rate, drive.believed_yaw_rate, drive.command_left, drive.command_right)
    return pandas.DataFrame(dict(zip(TRACE_COLUMNS, (run, label, *(one[due] for one in values)))))


def directory(path):
    """Creates a directory if it does not exist."""
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as error:
        raise ValueError("out = '{}': cannot be created: {}".format(path, error.strerror)) from error
    return pathlib.Path(path)


def save(out, name, rows, columns):
    """Writes rows, which are dicts, as a CSV file into a directory."""
    write(directory(out) / name, csv_text(frame(rows, columns)))


def write(path, text):
    """Writes a file and prints its name; '-' is the standard output."""
    if str(path) == '-':
        sys.stdout.write(text)
        return
    try:
        pathlib.Path(path).write_text(text)
    except OSError as error:
        raise ValueError("'{}': cannot be written: {}".format(path, error.strerror)) from error
    print('Wrote', path)
