"""What tests of the closed loop share: the modules of the lab, which can be imported after this one, and drives."""

import pathlib
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / 'sim/lab'))

import engine  # noqa: E402


def driven(case):
    controller, plant, motion, overrides, options = case
    return engine.drive(plant, controller, motion, overrides, **options)


def drive(controller, plant, motion, overrides=None, **options):
    """A drive; options: of simulate()."""
    return driven((controller, plant, motion, overrides, options))


def drives(cases, **options):
    """Cases (controller, plant, motion, overrides), each with its drive."""
    return zip(cases, engine.parallel(driven, [(*case, options) for case in cases]))
