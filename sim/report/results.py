"""Data of the report: the thesis' tables, the table of experiments and the CSV files of the experiments."""

import csv
import math
import pathlib
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / 'lab'))
import engine  # noqa: E402
import thesis  # noqa: E402, F401
from motions import REST  # noqa: E402, F401

# Columns with the conditions of a run, in the order of the CSV files.
CONDITIONS = ('controller', 'plant', 'step_mps', 'step_radps', 'belief_hz', 'action_hz', 'tau', 'kappa_mu', 'kappa_a', 'orders')


def lines_of(path):
    """Lines of a CSV file. Raises ValueError if it is missing."""
    try:
        with open(path, newline='') as file:
            return list(csv.reader(file))
    except OSError as error:
        raise ValueError(f'{path}: {error.strerror}; run the experiments first') from error


def read_rows(path):
    columns, *lines = lines_of(path)
    return [dict(zip(columns, line)) for line in lines]


class Run:
    """One row of a result table, with the columns of its trace."""

    def __init__(self, row):
        self.row, self.label, self.trace = row, row['label'], {}

    def __getitem__(self, column):
        """A column: a number where it is one, else the text, None where it is empty."""
        text = self.row[column]
        if column == 'label':
            return text
        try:
            return float(text)
        except ValueError:
            return text or None

    @property
    def bounded(self):
        return self.row['bounded'] == '1'

    def conditions(self):
        return tuple(self.row[name] for name in CONDITIONS) + (self.label,)

    def series(self, column, start=0.0):
        """Times since `start` and values of a column of the trace; for the command the mean of both wheels."""
        if column == 'command':
            return self.trace['time_s'] - start, 0.5 * (self.trace['command_left_radps'] + self.trace['command_right_radps'])
        return self.trace['time_s'] - start, self.trace[column]

    def errors(self):
        """(name, ln(ours/thesis)) for settling and rise, where the thesis prints a number; 2 if we have none, as in the fit."""
        pairs = [(name, self[f'{name}_s'], self[f'thesis_{name}_s']) for name in ('settling', 'rise')]
        return [(name, math.log(ours / theirs) if ours else 2.0) for name, ours, theirs in pairs if theirs]


def comparable(runs):
    """One run per condition: euler where it is stable, as in the thesis, else exact; runs without an integrator stay."""
    chosen = {}
    for run in runs:
        key = run.conditions()
        if key not in chosen or (run['integrator'] == 'exact' and not chosen[key].bounded):
            chosen[key] = run
    return list(chosen.values())


class Results:
    """Everything the report shows, from a directory with the files of `experiments run all`."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        self.tables = {t['table']: t for t in engine.read_yaml('sim/thesis/tables.yaml')['tables']}
        self.experiments = {e['name']: e for e in engine.read_yaml('sim/lab/scenarios.yaml')['experiments']}
        self.bars = engine.bars()
        self.runs = {name: self._read(name) for name in self.experiments}

    def _read(self, name):
        runs = [Run(row) for row in read_rows(self.directory / f'{name}.csv')]
        columns, *lines = lines_of(self.directory / f'{name}_traces.csv')
        parts = [[] for _ in runs]
        for number, _, *cells in lines:  # the second column is the label
            parts[int(number)].append([float(cell or 'nan') for cell in cells])
        for run, part in zip(runs, parts):
            run.trace = dict(zip(columns[2:], numpy.array(part).reshape(-1, len(columns) - 2).T))
        return runs

    def config(self, name):
        """A file of config/."""
        return engine.read_yaml(f'config/{name}.yaml')

    def comparable(self, name):
        return comparable(self.runs[name])

    def errors(self, tables, figure=None):
        """ln(ours/thesis) over the comparable rows of some tables, of settling, rise or both. One that we have not counts as in the fit: 2."""
        runs = [run for table in tables for run in self.comparable(f'table_{table}')]
        return [error for run in runs for name, error in run.errors() if figure in (None, name)]
