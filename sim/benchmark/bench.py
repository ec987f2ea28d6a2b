#!/usr/bin/env python3
"""Measures the ticks, the node and the replay in one run, compares them, and writes the figures to a JSON file.

Usage: bench.py DEVEL OUT.json      DEVEL is the devel space; needs a sourced workspace.
"""

import json
import os
import pathlib
import platform
import subprocess
import sys

import instructions
import node
import replay

REPETITIONS = 7  # of which the median counts
LEAST_TIME = '0.1'  # s, of a repetition

# tick, what it is, what it is compared with
TICKS = (
    ('belief_p3', 'belief tick, improved, exact, p = 3', None),
    ('belief_p3_bound', '  by hand, two 4 x 4 blocks', 'belief_p3'),
    ('belief_p3_transcription', '  transcribed from the thesis', 'belief_p3'),
    ('belief_p5', 'belief tick, improved, exact, p = 5', None),
    ('belief_p5_bound', '  by hand, two 6 x 6 blocks', 'belief_p5'),
    ('belief_p5_transcription', '  transcribed from the thesis', 'belief_p5'),
    ('predictive', 'predictive tick without a sample', None),
    ('predictive_sample', 'predictive tick with a sample', None),
    ('monitor_advance', 'fault monitor, 1 ms', None),
    ('monitor_check', 'fault monitor, sample', None),
    ('monitor_period', 'fault monitor, 20 ms and their sample', None))


class BenchError(Exception):
    """Nothing can be measured; the text is one line for the person."""


def nanoseconds(program):
    """Median CPU time by tick [ns]."""
    command = [program, '--benchmark_format=json', f'--benchmark_repetitions={REPETITIONS}',
               f'--benchmark_min_time={LEAST_TIME}', '--benchmark_report_aggregates_only=true']
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
    except OSError as error:
        raise BenchError(f'{program}: {error.strerror}; it is built where libbenchmark-dev is installed') from error
    if done.returncode != 0:
        raise BenchError((done.stderr.strip().splitlines() or [f'{program} ended with {done.returncode}'])[-1])
    return {run['run_name']: run['cpu_time'] for run in json.loads(done.stdout)['benchmarks']
            if run['aggregate_name'] == 'median'}


def counted(program):
    """Compiler, and instructions by tick; none without valgrind."""
    try:
        return instructions.counts(program)
    except instructions.CountError as error:
        print(f'bench: {error}', file=sys.stderr)
        return instructions.ticks(program)[0], {}


def processor():
    try:
        for line in pathlib.Path('/proc/cpuinfo').read_text().splitlines():
            if line.startswith('model name'):
                return line.split(':', 1)[1].strip()
    except OSError:
        pass
    return platform.machine()


def figures(times, counts):
    """The figures that others quote, by name."""
    found = {
        'belief_tick_ns': times['belief_p3'],
        'belief_tick_over_bound': times['belief_p3'] / times['belief_p3_bound'],
        'transcription_over_belief_tick': times['belief_p3_transcription'] / times['belief_p3'],
        'belief_tick_p5_over_bound': times['belief_p5'] / times['belief_p5_bound'],
        'transcription_over_belief_tick_p5': times['belief_p5_transcription'] / times['belief_p5'],
        'predictive_tick_ns': times['predictive'],
        'predictive_tick_with_sample_ns': times['predictive_sample'],
    }
    for name, number in counts.items():
        found[f'{name}_instructions'] = number
    return found


def table(times, counts):
    """Lines of the table."""
    yield f"{'':38}{'ns':>9}{'instructions':>14}  ratio"
    for name, what, compared in TICKS:
        ratio = ''
        if compared is not None:
            slower = times[name] / times[compared]
            ratio = f'ours takes {1 / slower:.1f} times as long' if slower < 1 else f'takes {slower:.1f} times as long as ours'
        yield f"{what:38}{times[name]:9.1f}{counts.get(name, ''):>14}  {ratio}".rstrip()


def node_table(found):
    """Lines of the table of the node."""
    yield f"{'':38}{'CPU, %':>9}{'/ empty node':>14}  age of the newest sample in a command"
    yield f"{'empty node, same timers and topics':38}{found['empty_node_cpu_percent']:9.2f}"
    for suffix, (preset, extra) in node.NODES.items():
        yield (f"{'controller_node, ' + preset + (', on demand' if extra else ''):38}{found['node_cpu_percent' + suffix]:9.2f}"
               f"{found['node_cpu_over_empty' + suffix]:14.2f}  p50 {found['command_age_p50_ms' + suffix]:.1f} ms, "
               f"p99 {found['command_age_p99_ms' + suffix]:.1f} ms; period off by "
               f"{found['action_period_off_p99_ms' + suffix]:.1f} ms (p99), "
               f"{found['action_period_off_at_start_ms' + suffix]:.1f} ms once at the start")


def main(arguments):
    if arguments in (['--help'], ['-h']):
        print(__doc__.strip())
        return 0
    if len(arguments) != 2:
        print('bench.py: needs the devel space and a file (see --help)', file=sys.stderr)
        return 2
    devel, out = map(pathlib.Path, arguments)
    internal = devel / 'share' / 'jackal_aic' / 'internal'
    try:
        times = nanoseconds(str(internal / 'tick_benchmark'))
        compiler, counts = counted(str(internal / 'tick_instructions'))
        of_node = node.figures(internal, pathlib.Path(__file__).parents[1] / 'urdf' / 'jackal.urdf')
        of_replay = replay.figures(devel / 'lib' / 'jackal_aic')
    except (BenchError, instructions.CountError, node.NodeError) as error:
        print(f'bench: {error}', file=sys.stderr)
        return 1
    machine = f'{processor()}, {os.cpu_count()} processors, {compiler}'
    print(f'On {machine}:')
    for line in table(times, counts):
        print(line)
    for line in node_table(of_node):
        print(line)
    print(f"{'replay of a drive, predictive':38}{of_replay['replay_over_real_time']:9.0f} times as fast as it was driven")
    found = dict(machine=machine, **figures(times, counts), **of_node, **of_replay)
    out.write_text(json.dumps(found, indent=2) + '\n')
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
