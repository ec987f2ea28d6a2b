"""What tests of the lab share: its modules, which can be imported after this one, its programs, and drives."""

import contextlib
import io
import pathlib
import runpy
import sys
import unittest.mock

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / 'sim/lab'))

import engine  # noqa: E402


def run(program, *arguments):
    """What a program of the lab prints, errors too, and its exit status; in this process, which has its modules already."""
    said, path = io.StringIO(), str(SOURCE / 'sim/lab' / program)
    with unittest.mock.patch.object(sys, 'argv', [path, *arguments]), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            runpy.run_path(path, run_name='__main__')
        except SystemExit as end:
            return said.getvalue(), end.code or 0


def driven(case):
    controller, plant, motion, overrides, options = case
    return engine.drive(plant, controller, motion, overrides, **options)


def drive(controller, plant, motion, overrides=None, **options):
    """A drive; options: of simulate()."""
    return driven((controller, plant, motion, overrides, options))


def drives(cases, **options):
    """Cases (controller, plant, motion, overrides), each with its drive."""
    return zip(cases, engine.parallel(driven, [(*case, options) for case in cases]))
