"""Data of the report: the thesis' tables, the table of experiments and the CSV files of the experiments."""

import math
import pathlib
import sys

import pandas

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / 'lab'))
import engine  # noqa: E402
import thesis  # noqa: E402, F401
from motions import REST  # noqa: E402, F401

# Columns with the conditions of a run, in the order of the CSV files.
CONDITIONS = ('controller', 'plant', 'step_mps', 'step_radps', 'belief_hz', 'action_hz', 'tau', 'kappa_mu', 'kappa_a', 'orders')


def read(path):
    """The table of a CSV file, with numbers as float. Raises ValueError if the file is missing."""
    try:
        table = pandas.read_csv(path)
    except OSError as error:
        raise ValueError(f'{path}: {error.strerror}; run the experiments first') from error
    return table.astype({name: float for name in table.select_dtypes('number')})


def rows_of(table):
    """Rows of a table as dicts; None where a cell is empty."""
    return table.astype(object).where(table.notna(), None).to_dict('records')


class Run:
    """One row of a result table, with the columns of its trace."""

    def __init__(self, row, trace):
        self.row, self.label, self.trace = row, row['label'] or '', trace

    def __getitem__(self, column):
        """A number or a text; None where the cell is empty."""
        return self.row[column]

    @property
    def bounded(self):
        return bool(self.row['bounded'])

    def conditions(self):
        return tuple(self.row[name] for name in CONDITIONS) + (self.label,)

    def series(self, column, start=0.0):
        """Times since `start` and values of a column of the trace; for the command the mean of both wheels."""
        if column == 'command':
            return (self.trace['time_s'] - start).values, self.trace[['command_left_radps', 'command_right_radps']].mean(axis=1).values
        return (self.trace['time_s'] - start).values, self.trace[column].values

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
        rows, traces = (read(self.directory / f'{name}{suffix}.csv') for suffix in ('', '_traces'))
        parts = dict(list(traces.groupby('run')))
        return [Run(row, parts.get(number)) for number, row in enumerate(rows_of(rows))]

    def config(self, name):
        """A file of config/."""
        return engine.read_yaml(f'config/{name}.yaml')

    def comparable(self, name):
        return comparable(self.runs[name])

    def errors(self, tables, figure=None):
        """ln(ours/thesis) over the comparable rows of some tables, of settling, rise or both. One that we have not counts as in the fit: 2."""
        runs = [run for table in tables for run in self.comparable(f'table_{table}')]
        return [error for run in runs for name, error in run.errors() if figure in (None, name)]
