#!/usr/bin/python3
"""The package as others meet it: its manifest, its programs, scripts and launch files, what a package downstream is built against,
and (argument "robot": alone) the build of a robot's computer."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import roslaunch.config
import roslaunch.xmlloader
import rosunit

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BUILD, DEVEL, INSTALL = (pathlib.Path(os.environ['JACKAL_AIC_' + space]) for space in ('BUILD', 'DEVEL', 'INSTALL'))
IS_SANITIZED = bool(os.environ.get('JACKAL_AIC_SANITIZER'))  # what is not instrumented itself cannot be linked with libraries that are


def text(path):
    return (SOURCE / path).read_text()


def sources(*directories):
    return [path for directory in directories for path in (SOURCE / directory).rglob('*') if path.is_file() and path.suffix != '.pyc']


def run(command, status=0, **environment):
    """What a command of the shell prints, errors too; AssertionError if it ends otherwise."""
    done = subprocess.run(['bash', '-c', command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True, env=dict(os.environ, **environment))
    assert done.returncode == status or status is None, command + '\n' + done.stdout
    return done.stdout


def listed(heading):
    """Names of the first column of the tables under a heading of programs.md."""
    return set(re.findall(r'\n\| `([\w/]+)` \|', re.split(r'\n## ' + heading, text('doc/reference/programs.md'))[1].split('\n## ')[0]))


def names_in(directory):
    return {path.name for path in directory.iterdir() if path.is_file()}


def completed(space):
    """What `rosrun jackal_aic <TAB>` shows in a space; nothing without rosbash, which leaves out paths with a dot."""
    rosbash = [path for path in ('/usr/share/bash-completion/completions/rosbash', '/opt/ros/noetic/share/rosbash/rosbash')
               if os.path.exists(path)]
    if not rosbash or '/.' in str(space):
        raise unittest.SkipTest('no completion by rosbash')
    return set(run('. {}/setup.bash; . {}; COMP_WORDS=(rosrun jackal_aic ""); COMP_CWORD=2; _roscomplete_exe; echo "${{COMPREPLY[@]}}"'.format(
        space, rosbash[-1])).split())


class Manifest(unittest.TestCase):

    def test_has_the_version_of_the_changelog_and_the_citation(self):
        version = re.search('<version>(.+)</version>', text('package.xml'))[1]
        newest = re.search(r'(\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)\n-{18}\n', text('CHANGELOG.rst')).groups()
        self.assertEqual(newest[0], version)
        self.assertEqual(re.search(r'\nversion: (\S+)\ndate-released: (\S+)\n', text('CITATION.cff')).groups(), newest)


class Programs(unittest.TestCase):

    def test_answer_help_without_a_master(self):
        built = {name for path in sources('src', 'sim') if path.name == 'CMakeLists.txt'
                 for name in re.findall(r'add_executable\((\w+)', path.read_text())}
        # Nodes are started by launch files, which know their arguments.
        self.assertEqual(built, {'analyze', 'replay', 'controller_node', 'plant_node'})
        views = re.findall(r'(view/\w+)\s', text('src/tools/CMakeLists.txt'))
        self.assertGreater(len(views), 2)
        paths = [DEVEL / 'lib/jackal_aic' / name for name in ('analyze', 'identify', 'replay', 'experiments', 'tune')]
        paths += [DEVEL / 'share/jackal_aic/internal/tick_benchmark', SOURCE / 'launch/show_rviz', *(SOURCE / 'src/tools' / view for view in views)]
        for path in paths:
            said = run('timeout 20 {} --help'.format(path), ROS_MASTER_URI='http://127.0.0.1:1')
            self.assertIn(path.name, said)
            self.assertNotRegex(said, r'=\d\.\d*0000\d', 'a number as no person writes it')

    def test_are_run_by_the_python_of_the_distribution(self):
        """rospy and numpy are of it: another one (pyenv, conda) may stand first on the PATH."""
        heads = [path.open(errors='replace').readline().strip() for path in sources('cfg', 'launch', 'scripts', 'sim', 'src', 'test')]
        heads = [head for head in heads if head.startswith('#!') and 'python' in head]
        self.assertEqual(set(heads), {'#!/usr/bin/python3'})
        self.assertGreater(len(heads), 20)

    def test_have_each_a_line_in_the_reference(self):
        internal = listed('Started by launch files') | listed('Examples and measurements')
        self.assertEqual(names_in(DEVEL / 'share/jackal_aic/internal'), internal)
        self.assertEqual({'scripts/' + name for name in names_in(SOURCE / 'scripts')}, listed('Scripts of the checkout'))
        self.assertLessEqual(len(listed('For users')), 15)
        self.assertEqual(completed(DEVEL), listed('For users'))

    def test_tell_what_is_wrong_in_one_line(self):
        """What a user typed or a file is called is text of anybody: it ends up in the one line of an error, and not on another."""
        for program in ('analyze', 'identify', 'replay', 'experiments step --plant ground --step 1 --controller', 'tune --out nowhere/gains.yaml --plant'):
            said = run(r'! timeout 20 {}/lib/jackal_aic/{} "$(printf "no\n\033[31msuch")"'.format(DEVEL, program))
            self.assertEqual((said.count('\n'), said.count('\033'), 'such' in said), (1, 0, True), said)


def launched(arguments):
    """Parameters that a launch file sets; what roslaunch says if it refuses the arguments."""
    name, *arguments = arguments.split()
    config = roslaunch.config.ROSLaunchConfig()
    try:
        roslaunch.xmlloader.XmlLoader(resolve_anon=False).load(str(SOURCE / 'launch' / name), config, argv=arguments, verbose=False)
    except roslaunch.xmlloader.XmlParseException as refusal:
        return str(refusal)
    return {key: str(parameter.value) for key, parameter in config.params.items()}


class Launch(unittest.TestCase):

    def test_arguments_set_the_parameters(self):
        """Where the robot stands is one setting for the plant and its controller; Gazebo has a model of its own robot; only the thesis'
        presets have a printed mode; a controller that does not keep up with a simulation as fast as it can would tell of dropped periods."""
        box, printed, model = 'plant_model/on_box', 'controller/printed', ' plant_model:={}/config/plant_model'.format(SOURCE)
        for arguments, parameter, value in (
                ('simulation.launch plant:=box', box, 'True'), ('simulation.launch plant:=box support:=ground', box, 'False'),
                ('simulation.launch support:=box', box, 'True'), ('simulation.launch support:=ground', box, 'False'),
                ('simulation.launch plant:=box' + model + '.yaml', box, 'True'),
                ('simulation.launch plant:=real' + model + '_box.yaml', box, 'False'),
                ('simulation.launch preset:=standard printed:=true', printed, 'True'), ('simulation.launch preset:=standard', printed, 'False'),
                ('jackal.launch preset:=tuned printed:=true', printed, 'True'), ('simulation.launch', printed, None),
                ('gazebo.launch', 'plant_model/dead_time', '0.006'), ('gazebo.launch', 'plant_model/acceleration_limit', '16.0'),
                ('gazebo.launch', 'plant_model/effective_track', '0.42'), ('gazebo.launch', 'plant_model/identified', None),
                ('simulation.launch preset:=improved', 'preset', 'improved'),
                ('simulation.launch real_time_factor:=0', '../plant/lockstep', '0.022'),
                ('simulation.launch real_time_factor:=2', '../plant/lockstep', '0.0')):
            self.assertEqual(launched(arguments).get(os.path.normpath('/jackal_aic/' + parameter)), value, (arguments, parameter))
        files = launched('simulation.launch preset:=improved')['/jackal_aic/parameter_files']
        for name in ('improved.yaml', 'jackal.yaml', 'plant_model.yaml'):
            self.assertIn(name, files)

    def test_wrong_arguments_are_refused_with_the_reason(self):
        plants = 'unknown plant: grond; choose ground, box, real or a file NAME.yaml'
        for arguments, reason in (('jackal.launch record_to:=drive', 'record_to:=drive: needs record:=true'),
                                  ('jackal.launch preset:=improved slip_file:=/tmp/slip.yaml', 'slip_file: needs preset:=predictive'),
                                  ('simulation.launch printed:=true', 'printed:=true: needs preset:=standard, improved or tuned'),
                                  ('simulation.launch record_to:=drive', 'record_to:=drive: needs record:=true'),
                                  ('simulation.launch plant:=grond', plants), ('identify.launch simulated:=true plant:=grond', plants),
                                  ('identify.launch plant:=box', 'plant:=box: needs simulated:=true'),
                                  ('faults.launch plant:=box', 'unknown plant: box; choose ground, real or a file NAME.yaml')):
            self.assertIn(reason, launched(arguments), arguments)

    def test_a_robot_file_may_say_more_than_the_shipped_one(self):
        with tempfile.TemporaryDirectory() as directory:
            robot = pathlib.Path(directory, 'robot.yaml')
            robot.write_text('robot: {effective_track: 0.6}\ndeadlines: {imu: 0.1}\noutput: twist\n')
            for name in ('controller', 'jackal', 'gazebo', 'simulation'):
                found = launched('{}.launch robot:={}'.format(name, robot))
                wanted = {'robot/effective_track': '0.6', 'deadlines/imu': '0.1', 'deadlines/wheels': '0.2',
                          'output': 'cmd_drive' if name == 'simulation' else 'twist'}  # the simulated robot has no other topic
                self.assertEqual({key: found['/jackal_aic/' + key] for key in wanted}, wanted, name)
            robot.write_text('deadlines: {set_point: 0.4}\n')
            found = launched('controller.launch preset:=diff_drive robot:={}'.format(robot))
            self.assertEqual(found['/jackal_aic/deadlines/set_point'], '0.4', 'it comes after the preset')

    def test_no_configuration_asks_for_a_substitution(self):
        """The stock control.launch loads the file of JACKAL_CONTROL_EXTRAS_PATH with subst_value, which substitutes in comments too and
        refuses what it does not know."""
        files = sources('config')
        self.assertGreater(len(files), 10)
        self.assertEqual([path for path in files if '$(' in path.read_text()], [])

    def test_files_around_the_controllers_take_its_arguments(self):
        """roslaunch says nothing of an argument that the file does not know."""
        arguments = set(re.findall(r'<arg name="(\w+)" default', text('launch/controller.launch')))
        self.assertGreater(len(arguments), 10)
        for name, missing in (('jackal', set()), ('gazebo', {'cmd_drive'}), ('simulation', {'cmd_drive', 'output', 'on_box', 'respawn'})):
            launch = text('launch/{}.launch'.format(name))
            for of_file in (r'<arg name="(\w+)" default', r'    <arg name="(\w+)" value'):
                self.assertLessEqual(arguments - missing, set(re.findall(of_file, launch)), name)
            self.assertEqual(launched(name + '.launch slip_file:=/tmp/my_slip.yaml')['/jackal_aic/slip/file'], '/tmp/my_slip.yaml')

    def test_the_log_of_a_drive_tells_what_happens_and_no_more(self):
        """From the start of the launch file to Ctrl-C: every line of the log is one that its user would miss."""
        said = run('bash {}/test/package/drive_once'.format(SOURCE))
        lines = [' '.join(line) for line in re.findall(r'\[ *(INFO|WARN|ERROR|FATAL)\] \[[\d., ]+\]: ([^\n\x1b]*)', said)]
        expected = ('INFO Preset predictive, parameters from ', 'INFO Plant model: ', 'INFO Stable with room: ',
                    'INFO Ready (predictive). Waiting for set points on /jackal_AIC/set_point', 'INFO Driving',
                    'INFO Stopped: no set point for 0.5 s', 'INFO Stopping; wheels at zero')
        self.assertEqual([line[:len(beginning)] for line, beginning in zip(lines, expected)], list(expected), said)
        self.assertEqual(len(lines), len(expected), said)


class Scripts(unittest.TestCase):

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = pathlib.Path(directory.name)

    def refused(self, script, workspace):
        said = run('! timeout 60 {}/scripts/{}'.format(SOURCE, script), JACKAL_AIC_WS=str(workspace))
        self.assertIn('set JACKAL_AIC_WS to an empty directory', said)

    def test_a_directory_that_is_not_ours_is_left_alone(self):
        for theirs in ('build/work', 'devel/work', 'src/their_package/work', 'log/sanitizer/work', 'notes/work'):
            workspace = self.directory / theirs.replace('/', '_')
            (workspace / theirs).mkdir(parents=True)
            before = set(workspace.rglob('*'))
            for script in ('build', 'lint --quick', 'test --only drive_gate'):
                self.refused(script, workspace)
                self.assertEqual(set(workspace.rglob('*')), before, theirs)
        theirs = self.directory / 'ws-address/log/sanitizer/work'
        theirs.mkdir(parents=True)
        self.refused('test --sanitize address', self.directory / 'ws')
        self.assertTrue(theirs.exists())

    def test_the_workspace_of_another_checkout_is_left_alone(self):
        """The file that marks a workspace of the scripts may be a user's, or name another checkout."""
        workspace = self.directory.resolve() / 'ws'
        (workspace / 'build/work').mkdir(parents=True)
        (self.directory / 'package.xml').write_text('<package/>')
        for location in ('{} {}'.format(self.directory, workspace), 'Delft'):
            (workspace / 'location').write_text(location + '\n')
            self.refused('build', workspace)
            self.assertTrue((workspace / 'build/work').exists())

    def test_apt_asks_on_a_terminal_and_removes_nothing(self):
        script = self.directory / 'script'
        for command, yes, asks in (('script -qec "bash {}" /dev/null', 'false', True), ('script -qec "bash {}" /dev/null', 'true', False),
                                   ('bash {}', 'false', False)):  # on a terminal or not
            script.write_text('set -eu\n. {0}/progress.sh\n. {0}/packages.sh\nsudo() {{ "$@"; }}\nassume_yes={1} missing=()\n'
                              'apt-get() {{ echo apt "$@"; }}\ninstall_packages no-such-package 2>&1\n'.format(SOURCE / 'scripts/lib', yes))
            said = run(command.format(script), None)
            self.assertIn('nothing is removed): no-such-package', said)
            self.assertIn('install --no-install-recommends --no-remove no-such-package', said)
            self.assertEqual(' -y' not in said, asks, said)

    def test_a_pattern_builds_what_its_tests_need_or_is_refused(self):
        for pattern, said in (('drive_gate', 'drive_gate_test\n'), ('test_node_lockstep', 'all\n'), ('python_package', 'all\n'),
                              ('nosuch', '--only nosuch: no test has such a name'), ('(', '--only (: no regular expression')):
            command = 'set -eu; . {0}/progress.sh; . {0}/tests.sh; test_targets {1} "{2}" 2>&1'.format(SOURCE / 'scripts/lib', BUILD, pattern)
            self.assertIn(said, run(command, None))


@unittest.skipIf(IS_SANITIZED, 'the libraries are instrumented')
class Downstream(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        for directory in ('lib', 'include', 'share'):  # an earlier version installed other files there
            shutil.rmtree(str(INSTALL / directory / 'jackal_aic'), ignore_errors=True)
        run('cmake -P {}/cmake_install.cmake'.format(BUILD))

    def test_a_package_builds_against_the_install_space(self):
        run('sh {0}/test/downstream/check {1} {2}/downstream_install'.format(SOURCE, INSTALL, BUILD))
        self.assertEqual(names_in(INSTALL / 'share/jackal_aic/build'), listed('Started by launch files') | listed('Examples and measurements'))
        run('. {}/setup.bash; roslaunch --args /jackal_aic jackal_aic jackal.launch'.format(INSTALL))
        self.assertEqual(completed(INSTALL), listed('For users'))

    def test_python_takes_module_and_files_of_the_install_space(self):
        # A robot that no other space has: it rests 0.4 s after the set point.
        plant = INSTALL / 'share/jackal_aic/config/plant.yaml'
        self.addCleanup(shutil.copy, str(SOURCE / 'config/plant.yaml'), str(plant))
        plant.write_text('plant: {dead_time: 0.5}\n')
        (BUILD / 'drive_installed.py').write_text(
            'import jackal_aic, jackal_aic.msg, os\n'
            'assert os.path.exists(os.path.join(os.path.dirname(jackal_aic.__file__), "__init__.pyi"))\n'
            'drive = jackal_aic.simulate("ground", "diff_drive", (0.5, 0.0))\n'
            'print(jackal_aic.__file__, abs(drive.speed[900]) < 0.01, drive.speed[-1] > 0.4)\n')
        said = run('unset PYTHONPATH CMAKE_PREFIX_PATH ROS_PACKAGE_PATH LD_LIBRARY_PATH; . {}/setup.bash; cd /; /usr/bin/python3 {}'.format(
            INSTALL, BUILD / 'drive_installed.py'))
        self.assertRegex(said, '^{}/.* True True\n'.format(INSTALL))


class RobotBuild(unittest.TestCase):
    """As a robot's computer builds it: -DJACKAL_AIC_SIMULATION=OFF, without what only the simulation needs."""

    @unittest.skipIf(IS_SANITIZED, 'the messages are those of an instrumented build')
    def test_has_the_node_the_plugin_and_the_tools_of_a_robot(self):
        said = run('sh {}/test/robot/check {} {}/robot'.format(SOURCE, DEVEL, BUILD))
        programs, libraries = (set(re.findall(kind + r': (\S+)\n', said)) for kind in ('program', 'library'))
        self.assertLessEqual(len(programs), 8)
        page = re.search(r'programs: (.*?)\. The', text('doc/reference/programs.md'), re.S)[1]
        self.assertEqual(programs, set(re.findall(r'`(\w+)`', page)))
        self.assertLessEqual(len(libraries), 4)
        self.assertIn('libjackal_aic_ros_control.so', libraries)

    def test_no_source_includes_a_header_of_the_simulation(self):
        """As the rooms lie above each other: the simulation knows the core, the node and the tools, and none of them knows it."""
        headers = [path for path in sources('sim') if path.suffix == '.hpp']
        endings = {'/'.join(path.relative_to(SOURCE).parts[first:]) for path in headers for first in range(len(path.parts))} - {''}
        code = [path for path in sources('include', 'src') if path.suffix in ('.cpp', '.hpp')]
        self.assertGreater(len(headers), 10)
        self.assertGreater(len(code), 100)
        for path in code:
            self.assertEqual(endings.intersection(re.findall(r'#include "(?:\.\./)*([^"]+)"', path.read_text())), set(), path)

    def test_the_guide_skips_the_packages_of_the_simulation(self):
        """package.xml lists for rosdep what a robot may leave uninstalled."""
        of_simulation = text('package.xml').split('-DJACKAL_AIC_SIMULATION=OFF')[1].split('<export>')[0]
        named = set(re.findall('depend>([^<]+)</', of_simulation))
        self.assertGreater(len(named), 5)
        skipped = re.search('--skip-keys="([^"]*)"', text('doc/guides/on_your_jackal.md'))[1]
        self.assertEqual(set(re.findall(r'[\w-]{2,}', skipped)), named - {'roslaunch'})  # which the node is started with


if __name__ == '__main__':
    ROBOT = 'robot' in sys.argv  # a program of its own, because it takes minutes
    if not ROBOT:
        del RobotBuild
    rosunit.unitrun('jackal_aic', 'robot_build' if ROBOT else 'package', '__main__.RobotBuild' if ROBOT else '__main__')
