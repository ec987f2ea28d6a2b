#!/usr/bin/python3
"""Runs the fault campaign: a ROS master and a roslaunch for the scenarios that can share them, another pair for each that
leaves them unfit. Prints a line per scenario as it ends."""

import argparse
import csv
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time

CHECK_PERIOD = 0.2  # s between checks of the results
GRACE = 20.0  # s from the request to stop until a process is killed


def stop(process):
    """Ends a process by SIGINT, after a while by SIGKILL."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def line_of(row):
    """A row of the results as a line for a person."""
    standstill, allowed, distance, use = (f'{float(row[key]):.2f}' if row[key] else '-' for key in (
        'standstill_s', 'allowed_s', 'distance_m', 'acceleration_use'))
    still = f'still {standstill} of {allowed} s' if row['expected'] == 'stops' else ''
    text = (f'{"ok  " if row["result"] == "passed" else "FAIL"} {row["scenario"]:<44} {row["expected"]:<8} {still:23} '
            f'{distance:>5} m  step {use}  {row["told"][:60]}')
    return text + (f'\n     {row["failures"]}\n     {row["history"]}' if row['failures'] else '')


def complete_rows(path):
    """Rows of a CSV file that is still being written."""
    text = path.read_text() if path.exists() else ''
    return list(csv.DictReader(text[:text.rfind('\n') + 1].splitlines()))


def run(log, results, arguments, show):
    """Runs one launch to its end and shows its results as they come; returns them, or None if nothing was selected."""
    results.unlink(missing_ok=True)
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        port = probe.getsockname()[1]
    environment = dict(os.environ, ROS_MASTER_URI=f'http://127.0.0.1:{port}')
    with open(log, 'w') as output:
        def start(*command):
            return subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT)

        master = start('rosmaster', '--core', '-p', str(port))
        # Without a run_id roslaunch would wait for that of a roscore.
        launch = start('roslaunch', '--wait', '--run_id', 'faults', 'jackal_aic', 'faults.launch', *arguments, f'results:={results}')
        shown = 0
        try:
            while launch.poll() is None:
                if master.poll() is not None:  # a scenario kills the master
                    master = start('rosmaster', '--core', '-p', str(port))
                time.sleep(CHECK_PERIOD)
                rows = complete_rows(results)
                for row in rows[shown:]:
                    show(row)
                shown = len(rows)
        finally:
            stop(launch)
            stop(master)
    for row in complete_rows(results)[shown:]:
        show(row)
    return None if 'matches no scenario' in log.read_text(errors='replace') else complete_rows(results)


def campaign(arguments, common):
    """Every scenario; returns the exit status."""
    rows = []
    for own_launch in ('false', 'true'):
        log = arguments.logs / f'faults_{"own" if own_launch == "true" else "shared"}.log'
        results = arguments.results / f'.faults_{own_launch}.csv'
        found = run(log, results, common + [f'own_launch:={own_launch}'], lambda row: print(line_of(row), flush=True))
        if found is not None and not found:
            sys.exit(f'FAIL no scenario was completed (log: {log})')
        rows += found or []
        results.unlink(missing_ok=True)
    if not rows:
        sys.exit('faults: --only matches no scenario')
    with open(arguments.results / 'faults.csv', 'w', newline='') as file:
        writer = csv.DictWriter(file, fieldnames=rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    failed = sum(1 for row in rows if row['result'] != 'passed')
    print(f'Data: {arguments.results / "faults.csv"}   logs: {arguments.logs}/faults_*.log')
    print(f'{len(rows) - failed} passed, {failed} failed')
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, prog='faults')
    parser.add_argument('results', type=pathlib.Path)
    parser.add_argument('logs', type=pathlib.Path)
    parser.add_argument('--only', default='.')
    parser.add_argument('--plant', default='ground', choices=('ground', 'real'))
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    return campaign(arguments, [f'select:={arguments.only}', 'real_time_factor:=2.0', f'plant:={arguments.plant}'])


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
