"""Data of the report: the thesis' tables, the table of experiments and the CSV files of the experiments."""

import csv
import math
import pathlib

import yaml

REST = 0.5  # s before a step, as in the closed loop (kRestTime)

# Columns with the conditions of a run, in the order of the CSV files.
CONDITIONS = ('controller', 'plant', 'step_mps', 'step_radps', 'belief_hz', 'action_hz', 'tau', 'kappa_mu', 'kappa_a', 'orders')


class ResultError(Exception):
    """A missing or unsuitable file; the text is one line for the user."""


def number(text):
    """A cell as a number; None if it is empty."""
    return float(text) if text not in ('', None) else None


def read_yaml(path):
    try:
        return yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError) as error:
        raise ResultError(f'{path}: {error}') from error


def read_bars(package):
    """The bars, by experiment and figure."""
    return read_yaml(pathlib.Path(package) / 'sim/lab/acceptance.yaml')


def read_rows(path):
    try:
        with open(path, newline='') as file:
            return list(csv.DictReader(file))
    except OSError as error:
        raise ResultError(f'{path}: {error.strerror}; run the experiments first') from error


def read_traces(path, runs):
    """Gives each run its lines of a file of traces, by the run in the first column."""
    try:
        with open(path, newline='') as file:
            lines = csv.reader(file)
            columns = next(lines)
            for line in lines:
                runs[int(line[0])].trace.append(line)
    except OSError as error:
        raise ResultError(f'{path}: {error.strerror}; run the experiments first') from error
    for run in runs:
        run.columns = columns


class Run:
    """One row of a result table, with its trace."""

    def __init__(self, row, index):
        self.row = row
        self.index = index
        self.columns = []  # of the trace
        self.trace = []
        self.label = row['label']

    def __getitem__(self, column):
        """A column: a number where it is one, else the text, None where it is empty."""
        if column == 'label':
            return self.label
        text = self.row[column]
        try:
            return number(text)
        except ValueError:
            return text

    @property
    def bounded(self):
        return self.row['bounded'] == '1'

    def conditions(self):
        return tuple(self.row[name] for name in CONDITIONS) + (self.label,)

    def series(self, column, start=0.0):
        """Times since `start` and values of a column of the trace; for the command the mean of both wheels."""
        def cells(name):
            index = self.columns.index(name)
            return [float(line[index] or 'nan') for line in self.trace]

        times = [time - start for time in cells('time_s')]
        if column == 'command':
            left, right = cells('command_left_radps'), cells('command_right_radps')
            return times, [0.5 * (l + r) for l, r in zip(left, right)]
        return times, cells(column)

    def error(self, column, reference):
        """Root mean square of the difference of two columns of the trace."""
        pairs = zip(self.series(column)[1], self.series(reference)[1])
        return math.sqrt(sum((value - true) ** 2 for value, true in pairs) / len(self.trace))

    def errors(self):
        """(name, ln(ours/thesis)) for settling and rise, where the thesis prints a number and we have one."""
        found = []
        for name in ('settling', 'rise'):
            ours, theirs = self[f'{name}_s'], self[f'thesis_{name}_s']
            if ours and theirs:
                found.append((name, math.log(ours / theirs)))
        return found

    def missing(self):
        """Numbers the thesis has and we have not."""
        return sum(1 for name in ('settling', 'rise') if self[f'thesis_{name}_s'] and not self[f'{name}_s'])


def comparable(runs):
    """One run per condition: euler where it is stable, as in the thesis, else exact; runs without an integrator stay."""
    chosen = {}
    for run in runs:
        key = run.conditions()
        if key not in chosen or (run['integrator'] == 'exact' and not chosen[key].bounded):
            chosen[key] = run
    return list(chosen.values())


class Results:
    """Everything the report shows."""

    def __init__(self, package, directory):
        self.package = pathlib.Path(package)
        self.directory = pathlib.Path(directory)
        self.tables = {t['table']: t for t in read_yaml(self.package / 'sim/thesis/tables.yaml')['tables']}
        self.experiments = {e['name']: e for e in read_yaml(self.package / 'sim/lab/scenarios.yaml')['experiments']}
        self.bars = read_bars(self.package)
        self.runs = {name: self._read(name) for name in self.experiments}

    def _read(self, name):
        runs = [Run(row, i) for i, row in enumerate(read_rows(self.directory / f'{name}.csv'))]
        read_traces(self.directory / f'{name}_traces.csv', runs)
        return runs

    def config(self, name):
        """A file of config/."""
        return read_yaml(self.package / 'config' / f'{name}.yaml')

    def comparable(self, name):
        return comparable(self.runs[name])

    def errors(self, tables):
        """ln(ours/thesis) over the comparable rows of some tables."""
        errors, missing = [], 0
        for table in tables:
            for run in self.comparable(f'table_{table}'):
                errors += [error for _, error in run.errors()]
                missing += run.missing()
        # A response that never settles counts as in the fit: 2.
        return errors + [2.0] * missing
