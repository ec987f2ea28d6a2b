#!/usr/bin/python3
"""The documentation against the repository: links lead somewhere, files and equations are where it says, every message that is
logged is explained, requirements are tied to tests, and the commands of its pages run.

Argument: whose commands run, "users" (README, tutorial, guides) or "others"; in two programs, because they take minutes. All other
tests are of "others".
"""

import pathlib
import re
import subprocess
import sys
import unittest

import rosunit
import yaml

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / 'test/node'))

from simulated_robot import bound_to_parent  # noqa: E402

PAGES = [SOURCE / 'README.md', SOURCE / 'CONTRIBUTING.md', *sorted((SOURCE / 'doc').rglob('*.md'))]
OF_USERS = [page for page in PAGES if page.stem in ('README', 'getting_started') or page.parent.name == 'guides']


def matches(pattern):
    """(page, groups) of every match in the pages."""
    return [(page, match) for page in PAGES for match in re.findall(pattern, page.read_text())]


def sources(*directories):
    return [path for directory in directories for path in (SOURCE / directory).rglob('*') if path.is_file() and path.suffix != '.pyc']


class Pages(unittest.TestCase):

    def test_every_link_leads_somewhere(self):
        links = matches(r'\]\(([^)#]*)(?:#([^)]*))?\)')
        self.assertGreater(len(links), 20)
        for page, (path, heading) in links:
            if path.startswith('http'):
                continue
            target = page.parent / path if path else page
            self.assertTrue(target.exists(), (page, path))
            if heading:
                anchors = [re.sub(r'[^a-z0-9_-]', '', name.lower().replace(' ', '-')) for name in re.findall('(?m)^#+ (.+)', target.read_text())]
                self.assertIn(heading, anchors, page)

    def test_every_file_that_they_name_is_there(self):
        files = matches(r'`((?:include|src|sim|config|launch|test|scripts)/[A-Za-z0-9_./]+\.[a-z]+)`')
        files += matches(r'\./(scripts/\w+)') + [(page, 'launch/' + name) for page, name in matches(r'roslaunch jackal_aic ([\w.]+)')]
        self.assertGreater(len(files), 30)
        for page, name in files:
            self.assertTrue((SOURCE / name).exists(), (page, name))

    def test_every_equation_is_where_it_says(self):
        rows = re.findall(r'\| ([a-z_/]+\.(?:hpp|py)) \| (\w+) \|', (SOURCE / 'doc/reference/equations.md').read_text())
        self.assertGreater(len(rows), 20)
        for path, name in rows:
            self.assertRegex((SOURCE / ('' if path.startswith('sim/') else 'include/jackal_aic') / path).read_text(), r'\b' + name + r'\b')

    def test_are_plain_and_wrapped(self):
        self.assertEqual(subprocess.call([sys.executable, str(SOURCE / 'test/doc/readability'), str(SOURCE)]), 0)

    def test_the_readme_says_that_no_robot_has_driven(self):
        self.assertIn('simulation only so far, never on a robot', (SOURCE / 'README.md').read_text()[:500])


def test_names():
    """Suite.Name of every test in C++, Class.test_name of those in Python."""
    names = set()
    for path in sources('test'):
        if path.suffix == '.cpp':
            names |= {'.'.join(name) for name in re.findall(r'TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\)', path.read_text())}
        elif path.suffix == '.py':
            for suite in re.split(r'(?m)^class ', path.read_text())[1:]:
                names |= {'{}.{}'.format(re.match(r'\w+', suite)[0], name) for name in re.findall(r'\n    def (test_\w+)', suite)}
    return names


class Requirements(unittest.TestCase):

    def test_each_has_tests_and_names_only_what_there_is(self):
        requirements = yaml.safe_load((SOURCE / 'doc/reference/requirements.yaml').read_text())
        scenarios = yaml.safe_load((SOURCE / 'sim/faults/scenarios.yaml').read_text())['scenarios']
        names = test_names()
        self.assertGreaterEqual(len(names), 400)
        self.assertGreaterEqual(len(requirements), 40)
        self.assertEqual(len({requirement['id'] for requirement in requirements}), len(requirements), 'an id twice')
        for requirement in requirements:
            self.assertLessEqual(set(requirement), {'id', 'text', 'limit', 'tests', 'scenarios'}, requirement)
            self.assertTrue(requirement['text'] and requirement['limit'] and requirement['tests'], requirement)
            self.assertEqual(set(requirement['tests']) - names, set(), requirement['id'])
            self.assertEqual(set(requirement.get('scenarios', ())) - set(scenarios), set(), requirement['id'])


# Of a language: the call, a literal of its text, a value in that, and the end of the call.
IN_CPP = r'ROS_(?:LOG|INFO|WARN|ERROR|FATAL)\w*\(', r'"((?:[^"\\]|\\.)*)"', r'%[-+ #0]*\d*(?:\.\d+)?(?:ll|l|z)?[a-zA-Z]', ');\n'
IN_PYTHON = r'rospy\.log\w+\(', r"f?'((?:[^'\\]|\\.)*)'", r'%[-+ #0]*\d*[a-zA-Z]|\{[^}]*\}', ')\n'
# Texts that a call logs as a value: what stands in its arguments, and the beginnings of the texts.
COMPOSED = {'describeRobot(': ('Plant model: ', 'Assumed plant model', 'No plant model: no fault detection by prediction'),
            'advice(': ('Stable with room: ', 'Stable, but with a thin margin '), 'what, (reason_': ('Stopping: ', 'Stopped: '),
            'error': ()}  # the one FATAL line of a program that ends


def log_calls():
    """(source, text, arguments) of each logging call of the programs; the text as messages.md has it, with an ellipsis for a value."""
    for path in sources('src', 'sim'):
        if 'sim/ros_control' in str(path):
            continue  # of other packages
        call, literal, value, end = IN_CPP if path.suffix in ('.cpp', '.hpp') else IN_PYTHON
        code = path.read_text(errors='replace')
        for begin in re.finditer(call, code):
            arguments = code[begin.end():begin.end() + 700].split(end)[0]
            literals = re.search(r'{0}(?:\s*{0})*'.format(literal), arguments)
            text = ''.join(re.findall(literal, literals[0])) if literals else ''
            yield path, re.sub(value, '…', text.replace('\\"', '"')).replace('%%', '%'), arguments


class Messages(unittest.TestCase):
    PAGE = (SOURCE / 'doc/reference/messages.md').read_text()

    def test_every_one_that_is_logged_is_explained(self):
        calls = list(log_calls())
        own = [(path, text) for path, text, _ in calls if re.search('[a-z]', text)]
        composed = [(path, arguments) for path, text, arguments in calls if not re.search('[a-z]', text)]
        self.assertGreaterEqual(len(own), 47)
        self.assertGreaterEqual(len(composed), 9)
        self.assertGreaterEqual(len([path for path, *_ in calls if path.suffix not in ('.cpp', '.hpp')]), 6)
        for path, text in own + [(path, text) for path, arguments in composed
                                 for text in next(texts for known, texts in COMPOSED.items() if known in arguments)]:
            self.assertIn('`' + text, self.PAGE, path)

    def test_none_is_explained_that_is_not_logged(self):
        logged = {text for _, text, _ in log_calls()}.union(*COMPOSED.values())
        explained = re.findall(r'\n- `([^`]+)`', self.PAGE)
        self.assertGreater(len(explained), 45)
        for text in explained:
            of_no_call = text.startswith(('record: ', 'robot reaches', 'wheels reach', 'does not move'))  # printed, and remarks
            self.assertTrue(of_no_call or text in logged or text.split('…')[0] in logged, text)


class Commands(unittest.TestCase):
    """Of a page, in their order."""


def add_page(page):
    command = bound_to_parent([sys.executable, str(SOURCE / 'test/doc/run_commands'), str(SOURCE), str(page)], 'INT')
    setattr(Commands, 'test_' + page.stem, lambda self: self.assertEqual(subprocess.call(command), 0))


if __name__ == '__main__':
    USERS = 'users' in sys.argv
    assert len(OF_USERS) >= 12
    for chosen in OF_USERS if USERS else set(PAGES) - set(OF_USERS):
        add_page(chosen)
    rosunit.unitrun('jackal_aic', 'user_pages' if USERS else 'documentation', '__main__.Commands' if USERS else '__main__')
