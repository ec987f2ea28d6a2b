#!/usr/bin/env python3
"""Runs the fault campaign: a ROS master and a roslaunch for the scenarios that can share them, another pair for each that
leaves them unfit. Prints a line per scenario as it ends.

The master is this script's own child, and is started again when it dies: one of the scenarios kills it.
"""

import argparse
import csv
import fcntl
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time

import yaml

LOOK = 0.2  # s between looks at the results
GRACE = 20.0  # s from the request to stop until a process is killed
PLANTS = ('ground', 'real')
NOTHING_SELECTED = 'matches no scenario'  # what the campaign says


def presets():
    """Names of the files of config/ that hold the gains of a controller."""
    files = (pathlib.Path(__file__).resolve().parents[2] / 'config').glob('*.yaml')
    structures = ('controller', 'predictive', 'diff_drive')
    return sorted(file.stem for file in files if any(key in yaml.safe_load(file.read_text()) for key in structures))


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def stop(process):
    """Ends a process politely, after a while for good."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class Graph:
    """A ROS master and a launch file, for the time of a with statement."""

    def __init__(self, log, arguments):
        self.log = log
        self.arguments = arguments

    def __enter__(self):
        self.port = free_port()
        self.environment = dict(os.environ, ROS_MASTER_URI=f'http://127.0.0.1:{self.port}')
        self.output = open(self.log, 'w')
        self.master = self.start(['rosmaster', '--core', '-p', str(self.port)])
        self.wait_for_master()
        self.launch = self.start(['roslaunch', 'jackal_aic', 'faults.launch'] + self.arguments)
        return self

    def __exit__(self, *_):
        stop(self.launch)
        stop(self.master)
        self.output.close()

    def start(self, command):
        return subprocess.Popen(command, env=self.environment, stdin=subprocess.DEVNULL, stdout=self.output,
                                stderr=subprocess.STDOUT)

    def wait_for_master(self):
        for _ in range(100):
            with socket.socket() as probe:
                if probe.connect_ex(('127.0.0.1', self.port)) == 0:
                    return
            time.sleep(LOOK)
        sys.exit(f'run_faults: the ROS master does not start (log: {self.log})')

    def running(self):
        """Whether the launch goes on; a master that died is replaced."""
        if self.master.poll() is not None:
            self.master = self.start(['rosmaster', '--core', '-p', str(self.port)])
        return self.launch.poll() is None


def cell(text, unit=''):
    return f'{float(text):.2f}{unit}' if text else '-'


def line_of(row):
    """A row of the results as a line for a person."""
    result = 'ok  ' if row['result'] == 'passed' else 'FAIL'
    text = f'{result} {row["scenario"]:<44} {row["expected"]:<8}'
    if row['expected'] == 'stops':
        text += f' still {cell(row["standstill_s"])} of {cell(row["allowed_s"], " s"):<7}'
    else:
        text += ' ' * 24
    text += f' {cell(row["distance_m"], " m"):>7}  step {cell(row["acceleration_use"])}  {row["told"][:60]}'
    return text + (f'\n     {row["failures"]}\n     {row["history"]}' if row['failures'] else '')


def complete_rows(path):
    """Rows of a CSV file that is still being written."""
    if not path.exists():
        return []
    text = path.read_text()
    return list(csv.DictReader(text[:text.rfind('\n') + 1].splitlines()))


def run(log, results, arguments, show):
    """Runs one launch to its end; returns what its results file holds, or None if nothing was selected."""
    results.unlink(missing_ok=True)
    shown = 0
    with Graph(log, arguments + [f'results:={results}']) as graph:
        running = True
        while running:
            running = graph.running()
            rows = complete_rows(results)
            for row in rows[shown:]:
                show(row)
            shown = len(rows)
            time.sleep(LOOK)
    if NOTHING_SELECTED in log.read_text(errors='replace'):
        return None
    return complete_rows(results)


def campaign(arguments, common):
    """Every scenario; returns the exit status."""
    rows = []
    for own_launch in ('false', 'true'):
        log = arguments.logs / f'faults_{"own" if own_launch == "true" else "shared"}.log'
        results = arguments.results / f'.faults_{own_launch}.csv'
        found = run(log, results, common + [f'own_launch:={own_launch}'], lambda row: print(line_of(row), flush=True))
        if found is None:
            continue
        if not found:
            print(f'FAIL no scenario was completed (log: {log})')
            return 1
        rows += found
        results.unlink()
    if not rows:
        sys.exit('run_faults: --only matches no scenario')
    if arguments.only != '.':
        print(f'A part of the campaign: only the scenarios that match {arguments.only!r}')
    with open(arguments.results / 'faults.csv', 'w', newline='') as file:
        writer = csv.DictWriter(file, fieldnames=rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    failed = sum(1 for row in rows if row['result'] != 'passed')
    print(f'Data: {arguments.results / "faults.csv"}   logs: {arguments.logs}/faults_*.log')
    print(f'{len(rows) - failed} passed, {failed} failed')
    return 1 if failed else 0


def soak(arguments, common):
    """Endurance; returns the exit status."""
    log, results = arguments.logs / 'soak.log', arguments.results / 'soak.csv'
    run(log, results, common + [f'soak:={arguments.soak}'],
        lambda row: print(', '.join(filter(None, row.values())), flush=True))
    verdict = results.read_text().splitlines()[-1] if results.exists() else ''
    passed = verdict.startswith('# passed')
    print(verdict.lstrip('# ') or f'the soak was not completed (log: {log})')
    print(f'{1 if passed else 0} passed, {0 if passed else 1} failed')
    return 0 if passed else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, prog='run_faults')
    parser.add_argument('results', type=pathlib.Path)
    parser.add_argument('logs', type=pathlib.Path)
    parser.add_argument('--only', default='.')
    parser.add_argument('--preset')
    parser.add_argument('--plant', default='ground', choices=PLANTS)
    parser.add_argument('--speed', type=float, default=2.0)
    parser.add_argument('--soak', type=float)
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    lock = open(arguments.results / '.faults.lock', 'w')
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        sys.exit(f'run_faults: another campaign is writing to {arguments.results}')
    common = [f'select:={arguments.only}', f'real_time_factor:={arguments.speed}',
              f'plant:={arguments.plant}']
    if arguments.preset:
        if arguments.preset not in presets():
            parser.error(f'--preset {arguments.preset!r}: unknown; known: {", ".join(presets())}')
        common.append(f'preset:={arguments.preset}')
    return soak(arguments, common) if arguments.soak else campaign(arguments, common)


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
