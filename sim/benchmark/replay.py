"""How much faster than it was driven a recorded drive is replayed: a bag of the simulated robot and the predictive controller, as
simulation.launch with record:=true writes it, through the replay tool."""

import os
import pathlib
import re
import statistics
import subprocess
import tempfile
import time

import node

DRIVEN = 40.0  # s, of the drive
REPETITIONS = 7  # of which the median counts
ARC = '{linear: {x: 0.5}, angular: {z: 0.4}}'


def figures(programs):
    """The replay's figures by name. @programs directory of the programs."""
    with tempfile.TemporaryDirectory() as directory:
        bag = recorded(pathlib.Path(directory))
        return {'replay_over_real_time': statistics.median(times_real(programs / 'replay', bag) for _ in range(REPETITIONS))}


def recorded(directory):
    """The bag of a drive, in a directory."""
    port = node.free_port()
    environment = dict(os.environ, ROS_MASTER_URI=f'http://127.0.0.1:{port}', ROS_IP='127.0.0.1')
    launched = node.start(['roslaunch', '-p', str(port), 'jackal_aic', 'simulation.launch', 'preset:=predictive',
                           'record:=true', f'record_to:={directory}/drive'], environment)
    try:
        driver = node.start(['rostopic', 'pub', '-r', '20', '/jackal_AIC/set_point', 'geometry_msgs/Twist', ARC], environment)
        try:
            time.sleep(DRIVEN)
        finally:
            node.stop(driver)
    finally:
        node.stop(launched)
    bags = list(directory.glob('drive*.bag'))
    if len(bags) != 1:
        raise node.NodeError(f'{len(bags)} bags of one drive were recorded')
    return bags[0]


def times_real(program, bag):
    """Seconds of the drive replayed in a second; the replay has to come out to the bit."""
    done = subprocess.run([str(program), str(bag), '--check'], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True)
    said = re.search(r'Replayed (\S+) s in \S+ s: (\d+) x real time', done.stdout)
    if done.returncode != 0 or said is None:
        raise node.NodeError((done.stdout.strip().splitlines() or ['replay says nothing'])[-1])
    if float(said.group(1)) < 0.5 * DRIVEN:
        raise node.NodeError(f'{said.group(1)} s of {DRIVEN:.0f} s were recorded')
    return float(said.group(2))
