"""CPU time of controller_node beside an empty node of the same timers and topics, and how old its commands are: both run one after
the other, on wall time, around the same stand-in for a robot (node_probe)."""

import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import time

# by the suffix of their figures: preset, and what the robot's file says beside config/jackal.yaml
NODES = {'': ('improved', ''), '_predictive': ('predictive', ''), '_without_belief_timer': ('improved', 'belief_timer: false\n')}
SETTLED = 3.0  # s, from the probe's start until the CPU time counts
MEASURED = 10.0  # s
STARTED = 20.0  # s, for a node to start


class NodeError(Exception):
    """A node cannot be measured; the text is one line for the person."""


def free_port():
    with socket.socket() as s:
        s.bind(('127.0.0.1', 0))
        return s.getsockname()[1]


def stop(process):
    """Ends a process that was started here."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(timeout=15.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def cpu_time(pid):
    """CPU time of all threads of a process until now [s]."""
    threads = pathlib.Path(f'/proc/{pid}/task').glob('*/schedstat')
    return 1e-9 * sum(int(thread.read_text().split()[0]) for thread in threads)


def child_of(parent, name):
    """Process of a name that a parent started; waits for it."""
    deadline = time.monotonic() + STARTED
    while time.monotonic() < deadline:
        for status in pathlib.Path('/proc').glob('[0-9]*/stat'):
            try:
                pid, rest = status.read_text().split(' (', 1)
            except OSError:
                continue  # it has ended meanwhile
            comm, fields = rest.rsplit(') ', 1)
            if comm == name and int(fields.split()[1]) == parent:
                return int(pid)
        time.sleep(0.1)
    raise NodeError(f'{name} has not started within {STARTED:.0f} s')


def start(command, environment):
    return subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)


def measure(programs, pid, environment):
    """CPU use of a process (seconds per second) while the probe runs, and what the probe prints: age p50, p99 and period p99 after
    the start [ms], speed, and by how much a period was off at the start, in which the action timer finds its phase [ms]."""
    probe = subprocess.Popen([str(programs / 'node_probe'), str(SETTLED + MEASURED + 1.0)], env=environment,
                             stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             universal_newlines=True)
    try:
        time.sleep(SETTLED)
        before, begin = cpu_time(pid), time.monotonic()
        time.sleep(MEASURED)
        used = (cpu_time(pid) - before) / (time.monotonic() - begin)
        said, _ = probe.communicate(timeout=STARTED)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NodeError(f'the measured node or its probe has ended early: {error}') from error
    finally:
        if probe.poll() is None:
            stop(probe)
    ages = re.search(r'age_p50_ms (\S+) age_p99_ms (\S+) commands (\d+) period_off_p99_ms (\S+)\nspeed (\S+)', said)
    start = re.search(r'start_period_off_max_ms (\S+)', said)
    if probe.returncode != 0 or ages is None or start is None:
        raise NodeError((said.strip().splitlines() or ['node_probe says nothing'])[-1])
    return used, float(ages.group(1)), float(ages.group(2)), float(ages.group(4)), float(ages.group(5)), float(start.group(1))


def figures(programs, urdf):
    """The node's figures by name. @programs directory of the programs, @urdf file of robot_description."""
    with tempfile.TemporaryDirectory() as directory:
        return figures_of_nodes(programs, urdf, directory)


def figures_of_nodes(programs, urdf, directory):
    """As figures(), with a directory for files that pass away."""
    port = free_port()
    environment = dict(os.environ, ROS_MASTER_URI=f'http://127.0.0.1:{port}', ROS_IP='127.0.0.1')
    core = start(['roscore', '-p', str(port)], environment)
    try:
        set_parameter = ['rosparam', 'set', 'robot_description', '-t', str(urdf)]
        deadline = time.monotonic() + STARTED
        while subprocess.run(set_parameter, env=environment, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL).returncode != 0:
            if time.monotonic() > deadline:
                raise NodeError('no ROS master has started')
            time.sleep(0.2)
        empty = start([str(programs / 'empty_node')], environment)
        try:
            empty_use, *_ = measure(programs, empty.pid, environment)
        finally:
            stop(empty)
        found = {'empty_node_cpu_percent': 100.0 * empty_use}
        robot = (pathlib.Path(__file__).parents[2] / 'config' / 'jackal.yaml').read_text()
        for suffix, (preset, extra) in NODES.items():
            robot_file = pathlib.Path(directory) / 'robot.yaml'
            robot_file.write_text(robot + extra)
            launched = start(['roslaunch', 'jackal_aic', 'controller.launch', f'preset:={preset}', f'robot:={robot_file}'],
                             environment)
            try:
                node = child_of(launched.pid, 'controller_node')
                use, p50, p99, period_off, speed, start_off = measure(programs, node, environment)
            finally:
                stop(launched)
            if abs(speed - 0.5) > 0.05:
                raise NodeError(f'{preset} does not drive: {speed} m/s after {SETTLED + MEASURED} s, told 0.5')
            found['node_cpu_percent' + suffix] = 100.0 * use
            found['node_cpu_over_empty' + suffix] = use / empty_use
            found['command_age_p50_ms' + suffix] = p50
            found['command_age_p99_ms' + suffix] = p99
            found['action_period_off_p99_ms' + suffix] = period_off
            found['action_period_off_at_start_ms' + suffix] = start_off
        return found
    finally:
        stop(core)
