#!/usr/bin/env python3
"""Counts the instructions of each tick with callgrind and compares them with the record, instructions.yaml beside this file.

A count does not depend on the machine's load, but on compiler, its options, processor and Eigen: with another one than the
record's, and without valgrind, there is nothing to compare. A tick that has grown by more than 10 % is either made fast again or,
if what it does now is worth it, recorded anew (--record) in the commit that explains why.

Usage: instructions.py [--record] PROGRAM      PROGRAM is tick_instructions. Prints a line for each tick. The exit status is 1 if
one grew by more than 10 % or is not in the record, 77 if there is nothing to compare.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import yaml

RECORD = pathlib.Path(__file__).with_name('instructions.yaml')
LARGEST_GROWTH = 1.10
REPETITIONS = 1000
SKIPPED = 77  # exit status


class CountError(Exception):
    """Nothing can be counted; the text is one line for the person."""


def run(command):
    """What a command prints, both streams."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
    if done.returncode != 0:
        last = (done.stdout.strip().splitlines() or ['it says nothing'])[-1]
        raise CountError(f'{command[0]} ended with {done.returncode}: {last}')
    return done.stdout


def ticks(program):
    """The compiler of a program and the names of its ticks."""
    first, *names = run([program, '--list']).split('\n')
    return first.split(' ', 1)[1], [name for name in names if name]


def count(program, tick):
    """Instructions of one tick."""
    if shutil.which('valgrind') is None:
        raise CountError('valgrind is not installed: no instructions counted')
    said = run(['valgrind', '--tool=callgrind', f'--callgrind-out-file={os.devnull}', '--toggle-collect=*repeated*',
                program, tick, str(REPETITIONS)])
    collected = re.search(r'Collected : (\d+)', said)
    if collected is None or int(collected.group(1)) == 0:
        raise CountError(f'callgrind counts nothing of {tick}')
    return round(int(collected.group(1)) / REPETITIONS)


def counts(program):
    """The compiler of a program, and instructions by tick."""
    compiler, names = ticks(program)
    return compiler, {name: count(program, name) for name in names}


def write_record(compiler, counted):
    lines = [f'  {name}: {number}' for name, number in counted.items()]
    RECORD.write_text('# Instructions of one call of each tick (instructions.py --record); a test fails when one grows by more than\n'
                      '# 10 %, with the same compiler.\n'
                      f'compiler: {compiler}\ninstructions:\n' + '\n'.join(lines) + '\n')


def compare(program):
    """Compares with the record; returns the exit status."""
    record = yaml.safe_load(RECORD.read_text())
    compiler, names = ticks(program)
    if compiler != record['compiler']:
        print(f"not counted: built by {compiler}, the record is of {record['compiler']}")
        return SKIPPED
    grown = 0
    for name in names:
        now, before = count(program, name), record['instructions'].get(name)
        good = before is not None and now <= LARGEST_GROWTH * before
        grown += not good
        print(f"{'ok  ' if good else 'FAIL'} {name}: {now} instructions, {before} in the record")
    return 1 if grown else 0


def main(arguments):
    if arguments in (['--help'], ['-h']):
        print(__doc__.strip())
        return 0
    record = arguments[:1] == ['--record']
    if len(arguments) != 1 + record:
        print('instructions.py: needs the path of tick_instructions (see --help)', file=sys.stderr)
        return 2
    try:
        if not record:
            return compare(arguments[0])
        write_record(*counts(arguments[1]))
    except CountError as error:
        print(error)
        return 1 if record or shutil.which('valgrind') else SKIPPED
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
