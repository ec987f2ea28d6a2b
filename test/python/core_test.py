#!/usr/bin/python3
"""The core for Python: parameters, controllers, drive loop, certificate, identification, odometry, fault monitor."""

import ast
import inspect
import pathlib
import subprocess
import sys
import unittest

import jackal_aic
import jackal_aic._core
import numpy
import rosunit

SOURCE = pathlib.Path(__file__).resolve().parents[2]
STEP = 0.001  # s


class Module(unittest.TestCase):

    def test_imports_with_numpy_alone(self):
        script = ('import sys, jackal_aic; jackal_aic.simulate\n'
                  'print([name for name in ("pandas", "matplotlib", "scipy", "yaml", "rospy") if name in sys.modules])')
        self.assertEqual(subprocess.check_output([sys.executable, '-c', script]).strip(), b'[]')

    def test_every_public_name_has_a_docstring(self):
        for name in jackal_aic.__all__:
            value = getattr(jackal_aic, name)
            if isinstance(value, tuple):
                continue
            self.assertTrue(inspect.getdoc(value), name)
            for member, item in vars(value).items() if inspect.isclass(value) else ():
                if not member.startswith('_') and (callable(item) or isinstance(item, property)):
                    self.assertTrue(inspect.getdoc(item), name + '.' + member)

    def test_the_stub_for_editors_has_every_name_with_its_members(self):
        tree = ast.parse(pathlib.Path(jackal_aic._core.__file__).with_name('__init__.pyi').read_text())
        nodes = {getattr(node, 'name', None) or node.target.id: node for node in tree.body if not isinstance(node, (ast.Expr, ast.Import, ast.ImportFrom))}
        self.assertEqual(set(nodes), set(jackal_aic.__all__))
        for name, node in nodes.items():
            if isinstance(node, ast.ClassDef):
                there = {item.name if isinstance(item, ast.FunctionDef) else item.target.id for item in node.body if not isinstance(item, ast.Expr)}
                cls = getattr(jackal_aic, name)
                own = cls._fields if issubclass(cls, tuple) else [member for member in vars(cls) if not member.startswith('_')]
                self.assertLessEqual(set(own), there, name)


class Parameters(unittest.TestCase):

    def test_are_those_of_the_files(self):
        for preset, structure in (('predictive', 'predictive'), ('standard', 'thesis'), ('improved', 'thesis'),
                                  ('tuned', 'thesis'), ('diff_drive', 'diff_drive')):
            for model in ('assumed', 'box', 'ground', 'real', 'gazebo'):
                self.assertEqual(jackal_aic.Parameters(preset, model).structure, structure)
        standard = jackal_aic.Parameters('standard', 'ground')
        self.assertEqual(standard['controller.tau'], 0.03)  # Table C-1
        self.assertEqual(standard['controller.sensory_variances'], [2.0, 2.0, 1e5, 1e5])
        self.assertEqual(standard['plant_model.dead_time'], 0.08)
        self.assertIs(jackal_aic.Parameters('predictive', 'assumed')['plant_model.identified'], False)

    def test_errors_name_value_and_bound(self):
        def refused(words, *arguments, **overrides):
            with self.assertRaisesRegex(ValueError, words):
                jackal_aic.Parameters(*arguments, overrides=overrides)
        refused(r"preset = 'predictiv': unknown; known: predictive, improved", 'predictiv')
        refused(r"plant_model = 'moon': unknown; known: assumed, ground", 'standard', 'moon')
        refused(r'controller.tau = 20: must be in \[1e-05, 10\] s', 'standard', **{'controller.tau': 20})
        refused(r'controller.tua = 1: unknown key; nearest known keys: controller.tau', 'standard', **{'controller.tua': 1})
        refused(r'spectral radius .* kappa_a = 80 is too large: stable below', 'standard', 'ground', **{'controller.kappa_a': 80})
        refused(r"/no/such.yaml", '/no/such.yaml')
        with self.assertRaises(KeyError):
            jackal_aic.Parameters()['controller.nothing']


class Controllers(unittest.TestCase):

    def test_of_the_core_drive_by_hand(self):
        """Wheels that follow after a lag of 0.1 s."""
        for preset, cls in (('improved', jackal_aic.ActiveInferenceController), ('predictive', jackal_aic.PredictiveController),
                            ('diff_drive', jackal_aic.DifferentialDrive)):
            controller, wheels, command = cls(jackal_aic.Parameters(preset, 'ground')), numpy.zeros(2), numpy.zeros(2)
            controller.set_set_point(0.5, 0.0)
            for ms in range(4000):
                wheels = wheels + (command - wheels) * STEP / 0.1
                if ms % 20 == 0:
                    controller.observe(jackal_aic.Observation(ms * STEP, wheels[0], wheels[1], 0.0))
                if ms % round(1e3 * controller.belief_step) == 0:
                    controller.update_belief()
                if ms % 20 == 0:
                    command = numpy.array(controller.update_action())
                    controller.hold(*command)
            self.assertAlmostEqual(0.098 * wheels.mean(), 0.5, delta=0.01, msg=preset)


class Mathematics(unittest.TestCase):

    def test_kinematics_are_those_of_the_thesis(self):
        kinematics = jackal_aic.Kinematics(wheel_radius=0.1, effective_track=0.5)
        numpy.testing.assert_allclose(kinematics.body_velocity(4.0, 6.0), [0.5, 0.0, 0.4])
        numpy.testing.assert_allclose(kinematics.wheel_speeds(0.5, 0.4), [4.0, 6.0])
        numpy.testing.assert_allclose(kinematics.forward_matrix @ [4.0, 6.0], [0.5, 0.0, 0.4])
        numpy.testing.assert_allclose(kinematics.sensory_map @ [0.5, 0.0, 0.4], [0.4, 4.0, 6.0, 0.0, 0.0])
        self.assertEqual(kinematics.forward_model.shape, (2, 5))
        with self.assertRaisesRegex(ValueError, r'robot.wheel_radius = 0: must be in \[0.01, 1\] m'):
            jackal_aic.Kinematics(wheel_radius=0)

    def test_inference_over_seven_joints_is_what_pezzato_published(self):
        joints, h, kappa_mu, kappa_a = 7, 0.001, 11.67, 700.0
        identity = numpy.eye(joints)
        state = numpy.tile([1.0 / 5.0, 1.0 / 10.0, 0.0], (joints, 1))
        sensory = numpy.tile([1.0, 1.0, 0.0], (joints, 1))
        inference = jackal_aic.ActiveInference(identity, identity, state, sensory, 1.0, kappa_mu, kappa_a, h, h, euler=True,
                                               action_orders=1)
        goal = numpy.linspace(-1.0, 1.0, joints)
        inference.set_set_point(goal)
        q, dq, u = numpy.zeros((3, joints))
        mu, mu1, mu2 = numpy.zeros((3, joints))
        for step in range(3000):
            inference.observe(numpy.column_stack([q, dq, numpy.zeros(joints)]))
            # Prediction errors of position and velocity, and of two orders of the state with tau = 1.
            error, error1, state_error, state_error1 = q - mu, dq - mu1, (mu1 + mu - goal) / 5.0, (mu2 + mu1) / 10.0
            u = u - h * kappa_a * (error + error1)
            rates = (mu1 + kappa_mu * (error - state_error), mu2 + kappa_mu * (error1 - state_error - state_error1),
                     -kappa_mu * state_error1)
            mu, mu1, mu2 = mu + h * rates[0], mu1 + h * rates[1], mu2 + h * rates[2]
            action = inference.update_action()
            inference.update_belief()
            if step % 50 == 0:  # an error lasts
                numpy.testing.assert_allclose(action, u, atol=1e-9)
                numpy.testing.assert_allclose(inference.belief, numpy.column_stack([mu, mu1, mu2]), atol=1e-10)
            dq = dq + h * (u - 5.0 * dq) / 0.5
            q = q + h * dq
        numpy.testing.assert_allclose(q, goal, atol=0.1)
        with self.assertRaisesRegex(ValueError, 'forward_model: must have a column for each row of sensory_map'):
            jackal_aic.ActiveInference(identity, numpy.eye(3), state, sensory, 1.0, kappa_mu, kappa_a)

    def test_certificate_says_how_far_a_loop_is_from_its_limit(self):
        parameters = jackal_aic.Parameters('predictive', 'ground')
        certificate = jackal_aic.certify(parameters)
        self.assertTrue(certificate.stable)
        self.assertLess(certificate.loop_spectral_radius, 1.0)
        self.assertIn('Stable with room', certificate.advice)
        for beyond in (0.005, -0.005):
            robot = {'dead_time': 0.08 + certificate.delay_margin + beyond}
            self.assertEqual(jackal_aic.certify(parameters, robot).stable, beyond < 0.0)
        with self.assertRaisesRegex(ValueError, 'plant_model.dead_tim = 0.1: unknown key'):
            jackal_aic.certify(parameters, {'dead_tim': 0.1})
        with self.assertRaisesRegex(ValueError, 'diff_drive: not a closed loop'):
            jackal_aic.certify(jackal_aic.Parameters('diff_drive', 'ground'))


class Robot(unittest.TestCase):
    """Identification, odometry and fault monitor on a simulated drive."""

    @classmethod
    def setUpClass(cls):
        motion = [(0.5, 0.0), (0.0, 0.0), (0.3, 0.5), (-0.5, 0.0), (0.0, -0.8), (0.8, 0.0), (0.2, 0.5), (0.0, 0.0), (0.6, 0.0)]
        points = [(0.5 + i, speed, yaw_rate) for i, (speed, yaw_rate) in enumerate(motion)]
        cls.drive = jackal_aic.simulate('ground', 'diff_drive', points, duration=11.0)

    def steps(self):
        """Commands and observations."""
        drive = self.drive
        for values in zip(*(getattr(drive, name)[::20] for name in ('command_left', 'command_right', 'time', 'measured_left', 'measured_right',
                                                                    'measured_yaw_rate'))):
            yield values[:2], jackal_aic.Observation(*values[2:], acceleration_z=9.81, valid=['left', 'right', 'gyro'])

    def test_odometry_follows_the_robot(self):
        odometry = jackal_aic.Odometry(jackal_aic.Parameters('predictive', 'ground'))
        for command, observation in self.steps():
            odometry.observe(observation)
            odometry.advance(command[0], command[1], 0.02)
        x, y, heading = odometry.pose
        self.assertLess(numpy.hypot(x - self.drive.x[-1], y - self.drive.y[-1]), 0.1)
        self.assertAlmostEqual(heading, self.drive.heading[-1], delta=0.1)
        self.assertAlmostEqual(odometry.motion[0], self.drive.speed[-1], delta=0.05)
        self.assertEqual(odometry.pose_covariance.shape, (3, 3))
        self.assertTrue((numpy.linalg.eigvalsh(odometry.motion_covariance) > 0).all())

    def test_fault_monitor_names_a_dead_encoder(self):
        monitor = jackal_aic.FaultMonitor(jackal_aic.Parameters('predictive', 'ground'))
        for command, observation in self.steps():
            if observation.stamp > 6.0:
                observation.wheel_left = 0.0
            report = monitor.check(observation)
            self.assertFalse(report.faulty and observation.stamp <= 6.0)
            monitor.advance(tuple(command), 0.02)
        self.assertTrue(report.faulty)
        self.assertEqual(report.fault, 'left encoder wrong')
        self.assertNotIn('left', report.valid)
        self.assertGreater(report.distances['left'], 1.0)


class Loop(unittest.TestCase):
    """The drive loop fed by hand."""

    def setUp(self):
        self.loop = jackal_aic.DriveLoop(jackal_aic.Parameters('predictive', 'ground'))
        self.wheels = self.command = numpy.zeros(2)
        self.ms = 0

    def run_for(self, seconds, speed, sensors=True):
        for _ in range(round(seconds / STEP)):
            now = self.ms * STEP
            self.wheels = self.wheels + (self.command - self.wheels) * STEP / 0.1
            if speed is not None and self.ms % 100 == 0:
                self.loop.set_set_point(speed, 0.0, now)
            if sensors and self.ms % 20 == 0:
                self.assertTrue(self.loop.observe(jackal_aic.Observation(now, *(self.wheels + 1e-6 * self.ms), yaw_rate=1e-6 * self.ms), now))
            command = self.loop.advance(now)
            if command is not None:
                self.command = numpy.array(command)
            self.ms += 1

    def test_drives_after_a_zero_and_names_every_stop(self):
        self.run_for(1.0, 0.5)
        self.assertEqual(self.loop.command, (0.0, 0.0))
        self.assertIn('set points not zero since the start', self.loop.reason)
        self.run_for(0.5, 0.0)
        self.run_for(3.0, 0.5)
        self.assertEqual((self.loop.status, self.loop.cause), ('driving', ''))
        self.assertAlmostEqual(0.098 * self.wheels.mean(), 0.5, delta=0.02)
        self.assertAlmostEqual(self.loop.believed_velocity[0], 0.5, delta=0.05)
        self.run_for(2.0, None)
        self.assertEqual((self.loop.status, self.loop.command), ('stopped', (0.0, 0.0)))
        self.assertRegex(self.loop.cause, 'set point')
        self.run_for(1.0, 0.5, sensors=False)
        self.assertRegex(self.loop.cause, 'wheel speeds')
        self.loop.report(self.ms * STEP, emergency_stop=True)
        self.run_for(0.1, 0.5)
        self.assertRegex(self.loop.cause, 'emergency stop')

    def test_takes_a_controller_of_python(self):
        class Feedforward(jackal_aic.VelocityController):
            def act(self, set_point, observation):
                return jackal_aic.Kinematics().wheel_speeds(set_point.forward, set_point.yaw_rate)
        self.loop = jackal_aic.DriveLoop(jackal_aic.Parameters('standard', 'ground'), Feedforward())
        self.run_for(0.5, 0.0)
        self.run_for(2.0, 0.5)
        self.assertAlmostEqual(0.098 * self.wheels.mean(), 0.5, delta=0.01)


if __name__ == '__main__':
    rosunit.unitrun('jackal_aic', 'core', '__main__')
