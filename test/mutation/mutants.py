#!/usr/bin/env python3
"""Breaks the code that keeps the robot safe, one small change at a time, and sees whether a test notices.

A mutant is one source file with one change: a comparison turned round, a condition negated, an operator or a constant
changed, a statement dropped. It is compiled into a library of its own, which stands before the real one in the search
path of the tests, so that the working tree and its build stay as they are. The tests run from the quick to the slow
until one fails (the mutant is killed) or all have passed (it survives). Mutants that do not compile, or to the same
machine code, are no mutants. Survivors that nobody can tell from the original are listed in survivors.yaml, each with
the reason; they count as survivors all the same.
"""

import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import random
import re
import shlex
import subprocess
import sys
import tempfile
import time

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
SURVIVORS = pathlib.Path(__file__).with_name("survivors.yaml")

LIBRARY = "jackal_aic_core"

# The sources by room; the files that only hold texts are left out.
SOURCES = {
    "safety": ["command_limiter", "drive_gate", "drive_loop", "frozen_source", "loss_policy",
               "measurement_watch", "motor_share", "phase_lock", "step_schedule"],
    "faults": ["acceleration_monitor", "channel_monitor", "fault_monitor", "prediction_envelope",
               "reachable_speeds", "recent_range", "sliding_range", "wheel_monitor", "yaw_belief", "yaw_monitor"],
    "predictive": ["drive_train_fit", "drive_train_learning"],
}

# Unit tests of each room first, then those that close the loop; each list from the quick to the slow. A test may be
# followed by its arguments.
UNIT_TESTS = {
    "safety": ["drive_gate_test", "command_limiter_test", "frozen_source_test", "step_schedule_test",
               "loss_policy_test", "phase_lock_test", "measurement_watch_test", "motor_share_test", "drive_loop_test",
               "drive_loop_duties_test"],
    "faults": ["yaw_belief_test", "yaw_monitor_test", "recent_range_test", "sliding_range_test",
               "acceleration_monitor_test", "reachable_speeds_test", "channel_monitor_test", "wheel_monitor_test",
               "fault_isolation_test", "fault_monitor_test", "drive_loop_test"],
    "predictive": ["drive_train_learning_test"],
}
# Of the fault detection those cases that take a tenth of its time: every fault, and the alarms of some conditions.
FAULT_CASES = ("fault_detection_test --gtest_filter=-FrozenEncoder.Is*:HealthyRobot.*:*as_calibrated:*deg_*:*box_10*:*box_no*:"
               "*ground_noise_x_5:*ground_10*:*friction_1:*ground_no_noise")
DEAD_TIME_CASES = "unknown_dead_time_test --gtest_filter=*TenSeconds:*Coarse*:*Ramps*:*FarOff:*Real*"
LOOP_TESTS = {
    "safety": ["stall_test", "sensor_loss_test", "standstill_test"],
    "faults": ["stall_test", FAULT_CASES, "sensor_loss_test"],
    "predictive": [DEAD_TIME_CASES],
}

# What is changed into what: (name, pattern, replacement).
CHANGES = [
    ("comparison", r" < ", " >= "), ("comparison", r" > ", " <= "),
    ("comparison", r" <= ", " > "), ("comparison", r" >= ", " < "),
    ("comparison", r" == ", " != "), ("comparison", r" != ", " == "),
    ("condition", r" && ", " || "), ("condition", r" \|\| ", " && "),
    ("condition", r"(?<=[(\s])!(?=[a-z_(])", ""),
    ("condition", r"\bif (\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\))", r"if (!\1)"),
    ("truth", r"\btrue\b", "false"), ("truth", r"\bfalse\b", "true"),
    ("extreme", r"\bstd::min\b", "std::max"), ("extreme", r"\bstd::max\b", "std::min"),
    ("arithmetic", r"(?<=[\w)]) \+ ", " - "), ("arithmetic", r"(?<=[\w)]) - ", " + "),
    ("arithmetic", r" \* (?=[\w(])", " / "), ("arithmetic", r" / ", " * "),
    ("arithmetic", r" \+= ", " -= "), ("arithmetic", r" -= ", " += "),
    ("constant", r"(?<=constexpr double )(k\w+) = ", r"\1 = 2.0 * "),
    ("constant", r"(?<=constexpr double )(k\w+) = ", r"\1 = 0.5 * "),
]
# A statement of one line that is no declaration and leaves no function.
STATEMENT = re.compile(r"^\s+(?!return\b|using\b|break\b|case\b|default\b|const\b|static\b|constexpr\b|auto\b|double\b"
                       r"|bool\b|int\b|[A-Z][\w:<>, ]* [a-z_])[\w.\->:()\[\]]+.*;\s*$")


@dataclasses.dataclass(frozen=True)
class Mutant:
    """One change of one line."""
    room: str
    source: str  # of the repository
    line: int  # from 1
    kind: str
    before: str
    after: str

    def where(self):
        return f"{self.source}:{self.line}"


def masked(text):
    """The text with comments and literals blanked: of the same length, so that positions hold."""
    literal = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.DOTALL)
    return literal.sub(lambda found: re.sub(r"[^\n]", "\0", found.group()), text)


def mutants_of(room, name):
    """All mutants of a source file."""
    source = f"src/{room}/{name}.cpp"
    text = (ROOT / source).read_text()
    for number, (line, code) in enumerate(zip(text.split("\n"), masked(text).split("\n")), start=1):
        if code.lstrip().startswith("#"):
            continue
        for kind, pattern, replacement in CHANGES:
            for found in re.finditer(pattern, code):
                changed = line[:found.start()] + found.expand(replacement) + line[found.end():]
                yield Mutant(room, source, number, kind, line, changed)
        # A line that is a whole statement: balanced, and not the rest of one.
        if STATEMENT.match(code) and code.count("(") == code.count(")"):
            yield Mutant(room, source, number, "dropped", line, "")


def survivors_of(report, candidates):
    """Those of the candidates that survived by the report of an earlier run, wherever their lines are now."""
    found = re.findall(r"^survived  (\S+):\d+  \w+\n  - (.*)\n  \+ (.*)$", report, re.MULTILINE)
    names = {(source, before.strip(), after.strip()) for source, before, after in found}
    return [m for m in candidates if (m.source, m.before.strip(), m.after.strip()) in names]


def drawn(candidates, count, seed):
    """`count` of the candidates, at random, as many of each kind in each room as they can give."""
    shuffled = list(candidates)
    random.Random(seed).shuffle(shuffled)
    queues = {}
    for mutant in shuffled:
        queues.setdefault((mutant.room, mutant.kind), []).append(mutant)
    chosen = []
    while len(chosen) < count and any(queues.values()):
        for key in sorted(queues):
            if queues[key] and len(chosen) < count:
                chosen.append(queues[key].pop())
    return sorted(chosen, key=lambda mutant: (mutant.source, mutant.line, mutant.after))


class Workshop:
    """Compiles mutants and runs tests against them."""

    def __init__(self, workspace, headers):
        self.headers = headers
        self.build = workspace / "build" / "jackal_aic"
        self.tests = workspace / "devel" / "share" / "jackal_aic" / "test"
        self.durations = {}
        self.target = pathlib.Path("CMakeFiles") / f"{LIBRARY}.dir"
        self.link = shlex.split((self.build / self.target / "link.txt").read_text())
        lines = (self.build / self.target / "flags.make").read_text().split("\n")
        flags = [word for line in lines if line.startswith("CXX_") for word in shlex.split(line.split("=", 1)[1])]
        # With machine code, to be compared.
        self.compiler = [self.link[0], f"-I{headers}", *flags, "-ffat-lto-objects", "-w"]

    def original(self, source):
        return self.headers / (pathlib.Path(source).stem + ".o")

    def rest(self, source):
        return self.headers / (pathlib.Path(source).stem + "_rest.o")

    def objects(self):
        return [part for part in self.link if part.endswith(".o")]

    def prepare(self, room, source):
        """What the mutants of a source share: the header that it includes first, precompiled, the source as it is, and the rest of the
        library, linked."""
        name = pathlib.Path("jackal_aic") / room / (pathlib.Path(source).stem + ".hpp")
        out = self.headers / name.with_suffix(".hpp.gch")
        out.parent.mkdir(parents=True, exist_ok=True)
        own = str(self.target / (source + ".o"))
        for command in ([*self.compiler, "-x", "c++-header", str(ROOT / "include" / name), "-o", str(out)],
                        [*self.compiler, "-c", str(ROOT / source), "-o", str(self.original(source))],
                        [self.link[0], "-fPIC", "-O3", "-w", "-nostdlib", "-r", "-flinker-output=nolto-rel", "-flto-partition=none",
                         "-o", str(self.rest(source)),
                         *[part for part in self.objects() if part != own]]):
            subprocess.run(command, cwd=self.build, capture_output=True, check=True)

    def compiled(self, mutant, directory):
        """Whether the mutant compiles, to other machine code than the original; its library is in `directory` then."""
        text = (ROOT / mutant.source).read_text().split("\n")
        text[mutant.line - 1] = mutant.after
        source = directory / "mutant.cpp"
        source.write_text("\n".join(text))
        code = directory / "mutant.o"
        if subprocess.run([*self.compiler, "-c", str(source), "-o", str(code)], capture_output=True, check=False).returncode != 0:
            return False
        sections = [["objcopy", "-O", "binary", "-j", ".text*", "-j", ".rodata*", str(obj), str(directory / out)]
                    for obj, out in ((code, "a"), (self.original(mutant.source), "b"))]
        for command in sections:
            subprocess.run(command, capture_output=True, check=True)
        if (directory / "a").read_bytes() == (directory / "b").read_bytes():
            return False
        objects = set(self.objects())
        link = [part for part in self.link if part not in objects]
        link[link.index("-o") + 1] = str(directory / f"lib{LIBRARY}.so")
        subprocess.run([*link[:1], str(code), str(self.rest(mutant.source)), *link[1:]], cwd=self.build, capture_output=True, check=True)
        return True

    def passes(self, test, libraries=None):
        """Whether a test passes with the libraries of a directory before the others."""
        environment = dict(os.environ)
        if libraries:
            environment["LD_LIBRARY_PATH"] = f"{libraries}:{environment.get('LD_LIBRARY_PATH', '')}"
        limit = None if libraries is None else 10.0 + 8.0 * self.durations[test]
        begin = time.monotonic()
        try:
            name, *cases = test.split()
            status = subprocess.run([str(self.tests / name), *cases, "--gtest_fail_fast"], env=environment, timeout=limit,
                                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode
        except subprocess.TimeoutExpired:
            status = -1  # hangs
        if libraries is None:
            self.durations[test] = time.monotonic() - begin
        return status == 0

    def killer(self, mutant, tests):
        """The test that fails of a mutant, "" if none does, None if it is no mutant."""
        with tempfile.TemporaryDirectory(prefix="mutant_") as name:
            directory = pathlib.Path(name)
            if not self.compiled(mutant, directory):
                return None
            return next((test for test in tests if not self.passes(test, directory)), "")


def reason(mutant, reasons):
    """Why nobody can tell a survivor from the original, or ""."""
    for entry in reasons:
        if (entry["source"], entry["before"], entry["after"]) == (mutant.source, mutant.before.strip(), mutant.after.strip()):
            return entry["reason"]
    return ""


def arguments():
    parser = argparse.ArgumentParser(prog="scripts/mutants", description=__doc__.split("\n\n")[0],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=150, help="mutants to draw (150)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (1)")
    parser.add_argument("--only", default="", help="sources whose name, or name:line, contains this")
    parser.add_argument("--all", action="store_true", help="every mutant of them instead of a draw")
    parser.add_argument("--again", type=pathlib.Path, help="file with the output of an earlier run: its survivors")
    parser.add_argument("--unit", action="store_true", help="unit tests only, without the closed loop")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="mutants at a time (scripts/mutants: as the builds)")
    parser.add_argument("--list", action="store_true", help="print the mutants and end")
    parser.add_argument("--tests", action="store_true", help="print the names of the tests that it takes and end")
    parser.add_argument("--workspace", type=pathlib.Path, default=ROOT / "ws", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.count < 1 or chosen.jobs < 1:
        parser.error("--count and --jobs: must be at least 1")
    return chosen


def main():
    chosen = arguments()
    if chosen.tests:
        print(*sorted({test.split()[0] for room in SOURCES for test in UNIT_TESTS[room] + LOOP_TESTS[room]}), sep="\n")
        return 0
    candidates = [mutant for room, names in SOURCES.items() for name in names for mutant in mutants_of(room, name)
                  if chosen.only in mutant.where()]
    if not candidates:
        sys.exit(f"mutants: --only: no source has {chosen.only!r} in its name")
    if chosen.again:
        candidates = survivors_of(chosen.again.read_text(), candidates)
    mutants = candidates if chosen.all or chosen.again else drawn(candidates, chosen.count, chosen.seed)
    if chosen.list:
        for mutant in mutants:
            print(f"{mutant.where()}  {mutant.kind}\n  - {mutant.before.strip()}\n  + {mutant.after.strip()}")
        return 0
    with tempfile.TemporaryDirectory(prefix="mutants_") as headers:
        return count_killed(chosen, mutants, Workshop(chosen.workspace, pathlib.Path(headers)))


def count_killed(chosen, mutants, workshop):
    """Tries the mutants, prints what became of each, and how many were killed."""
    for room, source in sorted({(m.room, m.source) for m in mutants}):
        workshop.prepare(room, source)
    tests = {room: UNIT_TESTS[room] + ([] if chosen.unit else LOOP_TESTS[room]) for room in sorted({m.room for m in mutants})}
    for test in dict.fromkeys(test for of_room in tests.values() for test in of_room):
        if not (workshop.tests / test.split()[0]).exists():
            sys.exit(f"mutants: {test} is not built")
        if not workshop.passes(test):
            sys.exit(f"mutants: {test} fails without any change")
    reasons = (yaml.safe_load(SURVIVORS.read_text()) or []) if SURVIVORS.exists() else []
    killed = survived = explained = 0
    with concurrent.futures.ThreadPoolExecutor(chosen.jobs) as pool:
        outcomes = pool.map(lambda m: workshop.killer(m, tests[m.room]), mutants)
        for number, (mutant, killer) in enumerate(zip(mutants, outcomes), start=1):
            if sys.stderr.isatty():
                print(f"[{100 * number // len(mutants):3d}%]", end="\r", file=sys.stderr, flush=True)
            if killer is None:
                continue
            if killer:
                killed += 1
                print(f"killed    {mutant.where()}  {mutant.kind}  by {killer.split()[0]}", flush=True)
                continue
            survived += 1
            why = reason(mutant, reasons)
            explained += bool(why)
            print(f"survived  {mutant.where()}  {mutant.kind}\n  - {mutant.before.strip()}\n  + {mutant.after.strip()}"
                  + (f"\n  {why}" if why else ""), flush=True)
    total = killed + survived
    if total == 0:
        sys.exit(f"mutants: none of {len(mutants)} changes compiles to other machine code")
    print(f"killed: {killed} of {total} ({100.0 * killed / total:.1f} %); survivors with a reason: {explained} of {survived}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
