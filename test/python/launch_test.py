#!/usr/bin/python3
"""Files through roslaunch and rosparam into the real nodes: every preset that ships and every file that the tools write has to
start a controller that drives."""

import csv
import itertools
import os
import pathlib
import re
import socket
import subprocess
import tempfile
import unittest

import rosunit
import yaml

CONFIG = pathlib.Path(__file__).resolve().parents[2] / 'config'
RADIUS, TRACK = 0.098, 0.5621  # m
FINAL = 0.5  # s at the end of a leg
STEP = ((1.0, 0.0, 0.0), (2.5, 0.5, 0.0))  # durations [s], set points [m/s, rad/s]
# Slow, fast, an arc, a turn, each with a stop.
TOUR = ((1.0, 0.0, 0.0), (2.0, 0.1, 0.0), (1.0, 0.0, 0.0), (2.5, 1.5, 0.0), (1.5, 0.0, 0.0), (2.0, 0.5, 0.5), (1.0, 0.0, 0.0),
        (2.0, 0.0, 0.5), (2.5, 0.0, 0.0))
# On tyres of other radii and patches of friction, with a load off centre.
REAL = ((2.0, 0.0, 0.0), (3.0, 1.0, 0.0), (2.5, 0.0, 0.0), (3.0, 0.5, 0.5), (2.5, 0.0, 0.0), (3.0, 0.0, 1.0), (2.5, 0.0, 0.0))
STANDS = {'ground': (0.01, 0.02), 'box': (0.017, 0.05), 'real': (0.02, 0.04)}  # m/s, rad/s, with the noise of what tells the motion
# Close to the simulated robot.
MODEL = {'dead_time': 0.08, 'lag': 0.00636, 'gain': 1.0, 'acceleration_limit': 1.65, 'effective_track': 0.547}


def free_port():
    with socket.socket() as listener:
        listener.bind(('127.0.0.1', 0))
        return str(listener.getsockname()[1])


class Launch(unittest.TestCase):

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory, self.log = pathlib.Path(directory.name), ''

    def write(self, name, content):
        (self.directory / name).write_text(content if isinstance(content, str) else yaml.safe_dump(content))
        return str(self.directory / name)

    def bash(self, command, name_space='/'):
        """Runs a command in the directory of the test; what it says is in self.log."""
        done = subprocess.run(['bash', '-c', command], cwd=str(self.directory), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              universal_newlines=True, env=dict(os.environ, ROS_NAMESPACE=name_space))
        self.log = command + '\n' + done.stdout
        self.assertEqual(done.returncode, 0, self.log)

    def roslaunch(self, arguments, name_space='/'):
        """Runs a launch file to its end, on a master of its own."""
        port = free_port()
        self.bash('ROS_MASTER_URI=http://127.0.0.1:{0} timeout -s INT 300 roslaunch -p {0} jackal_aic {1}'.format(port, arguments), name_space)

    def manoeuvre(self, parts):
        durations, forward, yaw_rate = (list(values) for values in zip(*parts))
        return self.write('manoeuvre.yaml', {'manoeuvre': {'durations': durations, 'forward': forward, 'yaw_rate': yaw_rate}})

    def launch(self, parts, arguments):
        """Runs launch/step_response.launch to its end, four times as fast as real time."""
        self.roslaunch('step_response.launch real_time_factor:=4 manoeuvre:={} output_directory:={} {}'.format(
            self.manoeuvre(parts), self.directory, arguments))

    def drive(self, parts, arguments, plant='ground'):
        """Expects the robot to follow its set point in every leg, and to stand in the end; returns the rows of each leg.

        On the box the encoders tell the forward speed, and the commands the yaw rate, where a turn can only be told so.
        """
        self.launch(parts, arguments)
        with open(str(self.directory / 'response.csv'), newline='') as file:
            rows = [{name: float(value or 'nan') for name, value in row.items()} for row in csv.DictReader(file)]
        for row in rows if plant == 'box' else ():
            row['true_forward'] = row['measured_forward']
            row['true_yaw_rate'] = RADIUS * (row['command_right'] - row['command_left']) / TRACK
        legs = [list(leg) for _, leg in itertools.groupby(rows, lambda row: (row['set_forward'], row['set_yaw_rate']))]
        self.assertEqual(len(legs), len(parts), self.log)
        for leg, (_, wanted, turn) in zip(legs, parts):
            end = [row for row in leg if row['time'] >= leg[-1]['time'] - FINAL]
            speed, rate = (sum(row[name] for row in end) / len(end) for name in ('true_forward', 'true_yaw_rate'))
            slack = (0.05 if wanted else 0.15, 0.25) if plant == 'real' else (0.05 * max(0.1, abs(wanted)), max(0.03, 0.1 * abs(turn)))
            if not wanted and not turn:
                if leg is not legs[-1]:
                    continue  # it may still be on the way
                speed, rate, slack = end[-1]['true_forward'], end[-1]['true_yaw_rate'], STANDS[plant]
            self.assertAlmostEqual(speed, wanted, delta=slack[0], msg=self.log)
            self.assertAlmostEqual(rate, turn, delta=slack[1], msg=self.log)
        return legs

    def calibrated_plant(self):
        """The plant with numbers that are short only with an exponent or without a point, as `experiments calibrate` writes."""
        text = (CONFIG / 'plant.yaml').read_text()
        for key, value in (('motor_lag', '1.0e-05'), ('velocity_loop_integral', '1.0')):
            text = re.sub(r'(\n +' + key + r': )[^ \n]+', r'\g<1>' + value, text)
        return self.write('plant.yaml', text)

    def test_every_preset_drives_slowly_fast_on_an_arc_and_in_place_and_stops(self):
        for preset, plant in (('standard', 'ground'), ('improved', 'ground'), ('tuned', 'ground'), ('predictive', 'ground'), ('diff_drive', 'ground'),
                              ('improved', 'box'), ('predictive', 'box'), ('predictive', 'real')):
            self.drive(REAL if plant == 'real' else TOUR, 'preset:={} plant:={}'.format(preset, plant), plant)

    def test_takes_gains_a_model_and_a_plant_of_files(self):
        gains = yaml.safe_load((CONFIG / 'improved.yaml').read_text())
        gains['controller']['sensory_variances'] = [2.0, 2.0, 1e8, 1e12]
        self.drive(STEP, 'preset:={} plant_model:={} plant:={}'.format(
            self.write('tuned.yaml', gains), self.write('model.yaml', {'plant_model': MODEL}), self.calibrated_plant()))

    def test_drives_as_the_thesis_prints(self):
        """Without the action bound the action winds up while the motors are at their limit."""
        for printed in ('false', 'true'):
            _, leg = self.drive(((1.0, 0.0, 0.0), (3.0, 1.0, 0.0)), 'preset:=standard printed:=' + printed)
            fastest = max(row['true_forward'] for row in leg)
            self.assertEqual(fastest > 1.05, printed == 'true', fastest)

    def test_gives_the_controller_the_model_of_a_plant_that_identify_wrote(self):
        """Its dead time is half the shipped model's, which tells whose model the controller took."""
        self.drive(STEP, 'plant:=' + self.write('robot.yaml', {'plant_model': dict(MODEL, dead_time=0.04)}))
        self.assertIn('/plant_model/dead_time: 0.04', self.log)

    def test_says_that_a_plant_without_a_model_of_it_needs_one(self):
        self.launch(STEP, 'plant:=' + self.calibrated_plant())
        self.assertIn('plant_model:=FILE', self.log)
        response = self.directory / 'response.csv'
        self.assertFalse(response.exists() and response.read_text().splitlines()[1:], 'it did not drive')

    def test_records_the_excitation_in_a_namespace_into_any_path(self):
        """The command that it shows in the end is the one that works, and its result one that drives."""
        self.write("my father's drive.bag", 'an earlier drive')
        plant = self.write('plant.yaml', (CONFIG / 'plant.yaml').read_text() + 'real_time_factor: 1.0\n')
        self.roslaunch('identify.launch simulated:=true countdown:=0 plant:={} bag:="my father\'s drive.bag"'.format(plant), '/robot1')
        self.assertRegex(self.log, 'Next:\n +rosrun jackal_aic identify ')
        self.bash(re.search('Next:\n +(rosrun jackal_aic identify .*)\n', self.log).group(1))
        self.assertEqual((self.directory / "my father's drive.bag.1").read_text(), 'an earlier drive')
        self.drive(STEP, 'plant_model:={}/my_jackal.yaml'.format(self.directory))

    def test_a_simulation_that_is_ended_while_it_drives_comes_to_rest(self):
        """Ctrl-C reaches the robot and its controller at once, and the controller brakes on simulated time."""
        port, manoeuvre = free_port(), self.manoeuvre(((1.0, 0.0, 0.0), (600.0, 0.5, 0.0)))
        self.bash('touch log; (for i in $(seq 300); do grep -qs Driving log && break; sleep 0.2; done; sleep 1; kill -INT $$) & '
                  'ROS_MASTER_URI=http://127.0.0.1:{0} exec stdbuf -oL roslaunch -p {0} jackal_aic step_response.launch '
                  'preset:=predictive manoeuvre:={1} output_directory:=$PWD > log 2>&1'.format(port, manoeuvre))
        log = (self.directory / 'log').read_text()
        self.assertIn('Driving', log)
        self.assertIn('Stopping; wheels at zero', log)
        self.assertNotIn('before the wheels are at rest', log)

    def test_ends_the_excitation_whose_argument_is_refused(self):
        self.roslaunch('identify.launch simulated:=true bag:=drive.bag linear_speed:=50')
        self.assertIn('--linear-speed: 50: must be in [0.1, 2.0]', self.log)
        self.assertNotIn('The excitation is complete', self.log)
        for refused, said in (('confirm yes', "--confirm: invalid choice: 'yes'"), ('countdown abc', "--countdown: invalid number value: 'abc'"),
                              ('repetitions 0', '--repetitions: 0: must be in [1, 100]')):
            self.bash('! rosrun jackal_aic excitation --' + refused)
            self.assertIn(said, self.log)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'launch', '__main__')
