#!/usr/bin/env python3
"""Runs the tests that catkin registered with CTest and counts their cases, the longest (COST) first. Those that start nodes
(rostests and those with the label nodes), whose robots mostly wait, for their clock and for who is late: half as many more at
a time as there are processors. In the time that these leave, with a low priority, as many of the others as there are
processors; and at last, one after another, those that CTest is to run alone (RUN_SERIAL): they measure on the wall clock.

A gtest writes one JUnit file. A rostest writes one per <test> (its cases) and one of its own, whose failures are what the
cases cannot tell: a test that crashed, hung or never started. A test that ends with an error although no case failed, or
that runs no case at all, counts as one failed case.
"""

import argparse
import concurrent.futures
import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import textwrap
import threading
import time
import xml.etree.ElementTree as xml

GRACE = 20.0  # s from the request to stop until a test is killed
BACKGROUND_PATIENCE = 3.0  # limits of time that a test gets which the others leave little of the processors
WHOLE = '(whole test)'  # stands for the case where none can be named
SANITIZERS = ('ASAN_OPTIONS', 'UBSAN_OPTIONS', 'TSAN_OPTIONS')

stopping = threading.Event()  # set when no test is to go on


class Outcome:
    """Counts of the cases of one test and what went wrong."""

    def __init__(self):
        self.passed = 0
        self.failures = []  # (case, message)
        self.skipped = 0

    def add_cases(self, path):
        """Adds the cases of a JUnit file."""
        for case in xml.parse(path).getroot().iter('testcase'):
            message = failure(case)
            if message is not None:
                self.failures.append((f'{case.get("classname")}.{case.get("name")}', message))
            elif case.find('skipped') is not None or case.get('status') == 'notrun':
                self.skipped += 1
            else:
                self.passed += 1

    def add_wrapper(self, path, explained):
        """Adds the failures of a rostest's own file, except those that its cases have already explained."""
        for case in xml.parse(path).getroot().iter('testcase'):
            message = failure(case)
            name = case.get('name')[len('test'):]
            if message is not None and name not in explained:
                self.failures.append((WHOLE, f'{name}: {message.splitlines()[0]}'))

    def add_findings(self, directory):
        """Adds the sanitizers' reports of this test."""
        for path in sorted(directory.iterdir()):
            text = path.read_text(errors='replace')
            summary = next((line for line in text.splitlines() if line.startswith('SUMMARY')), text[:200])
            self.failures.append((f'sanitizer, {path}', summary))


def failure(case):
    """Message of a JUnit test case that failed, else None."""
    messages = [(item.text or '').strip() or item.get('message', '(no message)')
                for item in case if item.tag in ('failure', 'error')]
    return '\n'.join(messages) if messages else None


def file_name(name):
    """A test's name as that of a file."""
    return re.sub(r'[^\w.]', '_', name)


def registered_tests(build):
    """((name, command, result file, working directory), properties) of each test, the longest first, else in the order of the
    CMake files. Each test leaves its results in a directory of its own."""
    found = []
    results = str(build / 'test_results')
    listing = subprocess.run(['ctest', '--show-only=json-v1'], cwd=build, check=True, stdout=subprocess.PIPE)
    for test in json.loads(listing.stdout)['tests']:
        if 'command' not in test:
            sys.exit(f'run_tests: {test["name"]} has no command; was it built?')
        name = re.sub(r'^_ctest_[a-z0-9_]*?_(gtest|rostest|nosetests|python|roslaunch-check)_', r'\1 ', test['name'])
        command = [word.replace(results, f'{results}/{file_name(name)}') for word in test['command']]
        runner = next(i for i, word in enumerate(command) if word.endswith('run_tests.py'))
        properties = {item['name']: item['value'] for item in test.get('properties', [])}
        where = properties.get('WORKING_DIRECTORY', build)
        found.append(((name, command, pathlib.Path(command[runner + 1]), where), properties))
    return sorted(found, key=lambda test: -test[1].get('COST', 0.0))


def build_targets(tests):
    """What make has to build for tests. A gtest is a target of its name; a rostest names the gtests that it starts, which depend on
    the nodes. Tests with the label nodes and checks of launch files start programs as a user does, and need all of them."""
    targets = set()
    for (name, command, _, _), properties in tests:
        kind, test = name.split(' ', 1)
        if kind == 'gtest':
            targets.add(test)
        elif kind == 'rostest':
            words = ' '.join(command).split()
            launch = next(word for word in words if word.endswith('.xml') and word.startswith('/') and '/test_results/' not in word)
            targets.update(re.findall(r'<test\s[^>]*type="(\w+)"', pathlib.Path(launch).read_text()))
        if kind not in ('gtest', 'rostest') or 'nodes' in properties.get('LABELS', []):
            targets.add('all')
    return sorted(targets)


def starts_nodes(test, properties):
    """Whether a test mostly waits for nodes that it has started."""
    return test[0].startswith('rostest') or 'nodes' in properties.get('LABELS', [])


def descendants(root):
    """Process ids below root: roslaunch gives each node a session of its own, so that a process group is not enough."""
    parents = {}
    for entry in pathlib.Path('/proc').glob('[0-9]*/stat'):
        try:
            pid, rest = entry.read_text().split(' ', 1)
            parents[int(pid)] = int(rest.rsplit(')', 1)[1].split()[1])
        except (OSError, ValueError):
            continue
    found = [root]
    for pid in found:
        found.extend(child for child, parent in parents.items() if parent == pid)
    return found


def stop(process):
    """Ends a test and everything it started."""
    family = descendants(process.pid)
    process.terminate()
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        pass
    for pid in family:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    process.wait()


def run(command, directory, log, timeout, environment):
    """Runs one test with its output in a log; returns its exit status, or None if it hung."""
    with open(log, 'wb') as output:
        process = subprocess.Popen(command, cwd=directory, stdin=subprocess.DEVNULL, stdout=output,
                                   stderr=subprocess.STDOUT, start_new_session=True, env=environment)
        start = time.monotonic()
        try:
            while time.monotonic() - start < timeout and not stopping.is_set():
                try:
                    return process.wait(0.2)
                except subprocess.TimeoutExpired:
                    pass
            return None
        finally:
            if process.poll() is None:
                stop(process)


def judge(status, result, timeout):
    """Collects the outcome of a test that ended; result is the file that CTest expects of it."""
    outcome = Outcome()
    explained = set()
    try:
        if result.name.startswith('rostest-'):
            for path in sorted(result.parent.glob('rosunit-*.xml')):
                failed = len(outcome.failures)
                outcome.add_cases(path)
                if len(outcome.failures) > failed:
                    explained.add(path.stem[len('rosunit-'):])
            outcome.add_wrapper(result, explained)
        else:
            outcome.add_cases(result)
    except (OSError, xml.ParseError):
        reason = f'still running after {timeout:.0f} s' if status is None else 'ended without a result; did it crash?'
        outcome.failures.append((WHOLE, reason))
    if not outcome.failures and status != 0:
        outcome.failures.append((WHOLE, f'ended with status {status} although no case failed'))
    if not outcome.failures and outcome.passed + outcome.skipped == 0:
        outcome.failures.append((WHOLE, 'ran no test case'))
    return outcome


class Runner:
    """Runs tests, as a thread of the pool, and keeps what they left."""

    def __init__(self, logs, findings, timeout):
        self.logs = logs
        self.findings = findings
        self.timeout = timeout
        self.running = {}  # test name: start

    def __call__(self, name, command, result, directory, patience=1.0):
        """Runs one test, for `patience` times the limit at most; returns its outcome, how long it took [s] and its log."""
        timeout = patience * self.timeout
        log = self.logs / f'{file_name(name)}.log'
        shutil.rmtree(result.parent, ignore_errors=True)  # so that what is there afterwards is of this test
        environment = dict(os.environ)
        if self.findings:
            findings = self.findings / log.stem
            findings.mkdir(parents=True, exist_ok=True)
            for variable in SANITIZERS:
                environment[variable] = f'{environment.get(variable, "")}:log_path={findings}/report'
        start = self.running[name] = time.monotonic()
        status = run(command, directory, log, timeout, environment)
        outcome = judge(status, result, timeout)
        if self.findings:
            outcome.add_findings(findings)
        del self.running[name]
        return outcome, time.monotonic() - start, log

    def progress(self):
        """What is running, in one line."""
        now = time.monotonic()
        return ', '.join(f'{name} {int(now - start) // 60}:{int(now - start) % 60:02d}'
                         for name, start in sorted(self.running.items()))


def report(position, name, outcome, seconds, log):
    """Prints the line of one test and what failed in it."""
    failed = len(outcome.failures)
    counts = f'{outcome.passed} passed'
    counts += f', {failed} failed' if failed else ''
    counts += f', {outcome.skipped} skipped' if outcome.skipped else ''
    print(f'{position} {"FAIL" if failed else "ok  "} {name}: {counts} ({seconds:.1f} s)')
    for case, message in outcome.failures:
        print(textwrap.indent('\n'.join([case] + message.splitlines()[:25]), '    '))
        if case == WHOLE:
            print(f'    last output ({log}):')
            print(textwrap.indent('\n'.join(log.read_text(errors='replace').splitlines()[-15:]), '    | '))
    sys.stdout.flush()


def in_the_background(test):
    """A test at a low priority, which is given the time that this takes. Where Linux
    shares the processors out by session (autogroup), a session has a priority of its own, and that of a process counts
    within its session only."""
    name, command, result, directory = test
    low = 'echo 10 2>/dev/null >/proc/self/autogroup; exec nice -n 10 "$@"'
    return name, ['sh', '-c', low, 'sh', *command], result, directory, BACKGROUND_PATIENCE


def completed(runner, groups, show):
    """Runs groups (tests, jobs) together, of each `jobs` tests at a time; yields (name, what the runner returns) as they
    end."""
    with contextlib.ExitStack() as pools:
        pending = {}
        try:
            for tests, jobs in groups:
                pool = pools.enter_context(concurrent.futures.ThreadPoolExecutor(jobs))
                pending.update({pool.submit(runner, *test): test[0] for test in tests})
            while pending:
                done, _ = concurrent.futures.wait(pending, 0.2, concurrent.futures.FIRST_COMPLETED)
                show(runner.progress())
                for future in done:
                    yield pending.pop(future), future.result()
        except BaseException:
            stopping.set()
            for future in pending:
                future.cancel()
            raise


def main():
    parser = argparse.ArgumentParser(description=__doc__, prog='run_tests')
    parser.add_argument('workspace', type=pathlib.Path)
    parser.add_argument('--only', default='', help='regular expression')
    parser.add_argument('--targets', action='store_true', help='print what make has to build for these tests, and end')
    parser.add_argument('--findings', type=pathlib.Path, help='directory for the reports of the sanitizers')
    parser.add_argument('--jobs', default=len(os.sched_getaffinity(0)), type=int,
                        help='tests at a time that compute, and half as many more that wait')
    parser.add_argument('--timeout', default=600.0, type=float,
                        help=f'of one test [s]; {BACKGROUND_PATIENCE:g} times as long of one that only computes')
    arguments = parser.parse_args()

    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        only = re.compile(arguments.only)
    except re.error as error:
        sys.exit(f'test: --only {arguments.only}: no regular expression: {error}')
    tests = [test for test in registered_tests(arguments.workspace / 'build') if only.search(test[0][0])]
    if not tests:
        sys.exit(f'test: --only {arguments.only}: no test has such a name; names are "gtest drive_gate_test", '
                 f'"rostest test_node_gate.xml"')
    if arguments.targets:
        print(*build_targets(tests))
        return 0
    serial = [test for test, properties in tests if properties.get('RUN_SERIAL', False)]
    waiting = [test for test, properties in tests if starts_nodes(test, properties) and test not in serial]
    computing = [in_the_background(test) for test, _ in tests if test not in serial and test not in waiting]
    logs = arguments.workspace / 'log' / 'test'
    logs.mkdir(parents=True, exist_ok=True)

    on_terminal = sys.stdout.isatty() and not os.environ.get('CI')
    ended = passed = failed = 0

    def position():
        return f'[{ended:{len(str(len(tests)))}}/{len(tests)}]'

    def show(what):
        if on_terminal:
            print(f'\r\033[K{position()} ...  {what}'[:120], end='', flush=True)

    runner = Runner(logs, arguments.findings, arguments.timeout)
    waiting_jobs = (3 * arguments.jobs + 1) // 2
    for groups in (((waiting, waiting_jobs), (computing, arguments.jobs)), ((serial, 1),)):
        for name, (outcome, seconds, log) in completed(runner, groups, show):
            ended += 1
            if on_terminal:
                print('\r\033[K', end='')
            report(position(), name, outcome, seconds, log)
            passed += outcome.passed
            failed += len(outcome.failures)

    if failed:
        print(f'Logs: {logs}')
    print(f'{passed} passed, {failed} failed')
    return 1 if failed else 0


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
