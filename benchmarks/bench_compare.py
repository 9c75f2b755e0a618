"""Whether `kbot compare` finds the line behind a change of behaviour, and reports none where there is none.

    python benchmarks/bench_compare.py [FAULTS] [HARMLESS]

Five robots are edited by a seeded generator. FAULTS copies (40 by default) have one fault hidden among three
to five harmless edits: a size, mass, position, friction, limit or parameter of a plugin that is a tenth
larger. `kbot compare BEFORE AFTER --json` must report the faulty line first. HARMLESS copies (100 by
default) have only harmless edits: comments, order, colours, renamed properties, visuals, equal values
written otherwise. There, nothing may be reported as changed. The time is wall-clock time of the whole
command.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests" / "trials" / "compare"))
from generated_edits import (  # noqa: E402
    ARGUMENTS,
    CORPUS,
    KBOT,
    Robot,
    Texts,
    edit_harmlessly,
    faulty,
    texts_of,
    write,
)

from kbot.trials.compare.model_equality import same_behaviour  # noqa: E402
from kbot.trials.compare.revisions import Description  # noqa: E402

KINDS = (
    "argument",
    "size",
    "collision radius",
    "joint x",
    "joint y",
    "caster x",
    "mount",
    "mass",
    "base mass",
    "inertia",
    "moment",
    "inertial origin",
    "friction",
    "speed limit",
    "effort limit",
    "acceleration",
    "separation",
    "diameter",
    "torque",
    "damping",
)
"""The kinds of faults that change how a robot drives."""
LIMIT = 60.0
"""Seconds that a comparison may take."""
FOUND, FALSE = 38 / 40, 0
"""The share of faults whose line must come first, and the number of false alarms."""


class Bench:
    """Robots before and after edits, in a temporary folder."""

    def __init__(self, folder: Path, shared: Path) -> None:
        self.robots: list[tuple[Robot, Description, Description, Texts]] = []
        for robot in (KBOT, *CORPUS):
            home = folder / robot.name
            (home / "a").mkdir(parents=True)
            (home / "b").mkdir()
            before = robot.copy(shared if robot is not KBOT else None, home / "a" / "robot")
            after = robot.copy(shared if robot is not KBOT else None, home / "b" / "robot")
            ARGUMENTS[after.file] = robot.arguments
            self.robots.append((robot, before, after, texts_of(after)))
        self.slowest = 0.0

    def compare(self, robot: Robot, before: Description, after: Description) -> dict[str, Any]:
        words = [f"{name}:={value}" for name, value in robot.arguments]
        begun = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "kbot", "compare", before.file, after.file, *words, "--json"],
            capture_output=True,
            text=True,
            check=False,
        )
        self.slowest = max(self.slowest, time.perf_counter() - begun)
        if done.returncode not in (0, 1):
            raise RuntimeError(f"{robot.name}: {done.stderr}")
        result: dict[str, Any] = json.loads(done.stdout)
        return result

    def fault(self, number: int) -> tuple[str, str]:
        """Hide a fault. Returns its description, and why it was not found: empty if it was."""
        robot, before, after, original = self.robots[number % len(self.robots)]
        rng = random.Random(number)
        model = before.load().require()
        for kind in rng.sample(KINDS, len(KINDS)):
            texts = dict(original)
            for _ in range(rng.randint(3, 5)):
                edit_harmlessly(rng, texts)
            for path, line, changed in faulty(rng, texts, kind):
                write(changed)
                loaded = after.load()
                if loaded.has_errors or same_behaviour(model, loaded.require()):
                    continue
                result = self.compare(robot, before, after)
                write(original)
                what = f"{robot.name}: {kind}, {path.name}:{line}"
                causes = [(Path(cause["file"]).name, cause["line"]) for cause in result["causes"]]
                if not result["changed"]:
                    return what, "no change is reported"
                if not causes or causes[0] != (path.name, line):
                    return what, f"causes: {causes}"
                return what, ""
        raise RuntimeError(f"{robot.name} has no place for a fault")

    def harmless(self, number: int) -> tuple[str, str]:
        """Make only harmless edits. Returns them, and the false alarm: empty if there is none."""
        robot, before, after, original = self.robots[number % len(self.robots)]
        rng = random.Random(f"harmless {number}")
        texts = dict(original)
        kinds = [edit_harmlessly(rng, texts) for _ in range(rng.randint(3, 5))]
        write(texts)
        result = self.compare(robot, before, after)
        write(original)
        return f"{robot.name}: {', '.join(kinds)}", "a change is reported" if result["changed"] else ""


def main() -> int:
    counts = [int(word) for word in sys.argv[1:]]
    faults, harmless = counts if len(counts) == 2 else (40, 100)
    shared = Path(os.environ.get("KBOT_SHARED", ROOT.parent / "shared"))
    folder = Path(tempfile.mkdtemp(prefix="kbot-bench-"))
    try:
        bench = Bench(folder, shared)
        missed = [f"{what}: {why}" for what, why in map(bench.fault, range(faults)) if why]
        with_fault = bench.slowest
        alarms = [f"{what}: {why}" for what, why in map(bench.harmless, range(harmless)) if why]
    finally:
        shutil.rmtree(folder)
    print(f"faulty line first        {faults - len(missed):4d} of {faults}   (target: {FOUND:.0%})")
    print(f"false alarms             {len(alarms):4d} of {harmless}  (target: {FALSE})")
    print(f"slowest comparison       {with_fault:6.1f} s     (target: {LIMIT:g})")
    for text in (*missed, *alarms):
        print(f"  {text}")
    is_met = len(missed) <= faults * (1 - FOUND) and len(alarms) <= FALSE and with_fault <= LIMIT
    return 0 if is_met else 1


if __name__ == "__main__":
    sys.exit(main())
