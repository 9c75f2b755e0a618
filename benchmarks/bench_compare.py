"""Whether `kbot compare` finds the line behind a change of behaviour, and reports none where there is none.

    python benchmarks/bench_compare.py [FAULTS] [HARMLESS]

Five robots are edited. FAULTS copies (40 by default) have one fault hidden among three to five harmless
edits of a seeded generator: the size of a wheel, the separation, a caster, a mass or inertia, friction, a
limit or a plugin's parameter. `kbot compare BEFORE AFTER --json` must report the faulty line first. HARMLESS
copies (100 by default) have only harmless edits: comments, order, colours, renamed properties, visuals, equal
values written otherwise. There, nothing may be reported as changed. The time is wall-clock time of the whole
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
from generated_edits import (  # noqa: E402 - found by the path set above
    ARGUMENTS,
    CORPUS,
    KBOT,
    Robot,
    Texts,
    edit_harmlessly,
    texts_of,
    write,
)

from kbot.trials.compare.revisions import Description  # noqa: E402 - after the import above

FAULTS: dict[str, tuple[tuple[str, str, str], ...]] = {
    "kbot": (
        ("kbot.xacro", 'name="wheel_radius" default="0.035"', 'name="wheel_radius" default="0.0385"'),
        ("kbot.xacro", 'name="base_wheel_gap" default="0.007"', 'name="base_wheel_gap" default="0.015"'),
        ("kbot.xacro", "${-0.375*base_len}", "${-0.3*base_len}"),
        ("kbot.xacro", "${4000*base_len", "${6000*base_len"),
        (
            "kbot_macros.xacro",
            'velocity="${max_speed/wheel_radius}"',
            'velocity="${max_speed/wheel_radius/2}"',
        ),
        ("kbot_control.xacro", "<mu1>1.0</mu1>", "<mu1>0.3</mu1>"),
        ("kbot_control.xacro", "<wheelSeparation>${wheel", "<wheelSeparation>${1.1*wheel"),
        ("kbot_control.xacro", "<wheelAcceleration>1.0", "<wheelAcceleration>0.5"),
    ),
    "burger": (
        ("burger.urdf", 'radius="0.033"', 'radius="0.0363"'),
        ("burger.urdf", 'xyz="0.0 0.08 0.023"', 'xyz="0.0 0.09 0.023"'),
        ("burger.urdf", 'xyz="0.0 -0.080 0.023"', 'xyz="0.01 -0.080 0.023"'),
        ("burger.urdf", 'xyz="-0.081 0 -0.004"', 'xyz="-0.06 0 -0.004"'),
        ("burger.urdf", '<mass value="8.2573504e-01"/>', '<mass value="1.2"/>'),
        ("burger.urdf", 'izz="2.0064271e-03"', 'izz="4.0e-03"'),
        ("burger.urdf", '<mass value="0.114" />', '<mass value="0.3" />'),
        ("burger.urdf", 'xyz="-0.032 0 0.172"', 'xyz="-0.032 0.03 0.172"'),
    ),
    "kobuki": (
        ("kobuki.urdf.xacro", 'radius="0.035"', 'radius="0.0385"'),
        ("kobuki.urdf.xacro", "${0.23/2} 0.0250", "${0.25/2} 0.0250"),
        ("kobuki.urdf.xacro", 'xyz="0.115 0.0 0.007"', 'xyz="0.095 0.0 0.007"'),
        ("kobuki.urdf.xacro", 'xyz="-0.135 0.0 0.009"', 'xyz="-0.135 0.0 0.012"'),
        ("kobuki.urdf.xacro", '<mass value="2.4"/>', '<mass value="3.2"/>'),
        ("kobuki.urdf.xacro", 'xyz="0.01 0 0"', 'xyz="0.05 0 0"'),
        ("kobuki.urdf.xacro", 'izz="0.03675"', 'izz="0.1"'),
        ("kobuki_gazebo.urdf.xacro", "<mu1>1.0</mu1>", "<mu1>0.2</mu1>"),
    ),
    "linorobot2": (
        (
            "2wd_properties.urdf.xacro",
            'name="wheel_radius" value="0.045"',
            'name="wheel_radius" value="0.05"',
        ),
        ("2wd_properties.urdf.xacro", 'name="wheel_pos_x" value="0.0"', 'name="wheel_pos_x" value="0.02"'),
        ("2wd_properties.urdf.xacro", 'name="wheel_pos_y" value="0.13"', 'name="wheel_pos_y" value="0.143"'),
        ("2wd_properties.urdf.xacro", 'name="base_mass" value="1"', 'name="base_mass" value="1.5"'),
        ("caster_wheel.urdf.xacro", "${-(base_length / 2)", "${-(base_length / 2.5)"),
        ("diff_drive.urdf.xacro", "<wheel_separation>${wheel", "<wheel_separation>${1.1 * wheel"),
        (
            "diff_drive.urdf.xacro",
            "<wheel_diameter>${wheel_radius * 2}",
            "<wheel_diameter>${wheel_radius * 2.2}",
        ),
        ("diff_drive.urdf.xacro", "<max_wheel_acceleration>1.0", "<max_wheel_acceleration>0.4"),
    ),
    "diffbot": (
        ("front_wheel.yaml", "radius: 0.0331", "radius: 0.0364"),
        ("front_wheel.yaml", "y_offset: 0.015", "y_offset: 0.025"),
        ("front_wheel.yaml", "x_offset: 0.079", "x_offset: 0.089"),
        ("front_wheel.yaml", "mass: 0.5", "mass: 0.8"),
        ("base.yaml", "mass: 0.8", "mass: 1.2"),
        ("caster_wheel.yaml", "dx: -0.016", "dx: -0.03"),
        ("caster_wheel.yaml", "mass: 0.5", "mass: 0.9"),
        ("common_macros.urdf.xacro", "${reflect* pos_y_joint}", "${reflect* pos_y_joint + 0.005}"),
    ),
}
"""Faults by robot: the end of the file's name, and the text of which the first occurrence is replaced. Each
changes a wheel's size, the separation, a caster, a mass or inertia, friction, a limit or a parameter."""
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
        name, old, new = FAULTS[robot.name][number // len(self.robots)]
        rng = random.Random(number)
        place = next(path for path in Path(after.file).parents[1].rglob("*") if path.name.endswith(name))
        untouched = {**original, place: place.read_text()}
        texts: Texts = {}
        while old not in texts.get(place, ""):  # an edit may have rewritten the place of the fault
            texts = dict(original)
            for _ in range(rng.randint(3, 5)):
                edit_harmlessly(rng, texts)
            texts = {**untouched, **texts}
        at = texts[place].index(old)
        line = texts[place].count("\n", 0, at) + 1
        texts[place] = texts[place].replace(old, new, 1)
        write(texts)
        result = self.compare(robot, before, after)
        write(untouched)
        what = f"{robot.name}: {name}:{line}, {new}"
        causes = [(Path(cause["file"]).name, cause["line"]) for cause in result["causes"]]
        if not result["changed"]:
            return what, "no change is reported"
        return what, "" if causes and causes[0] == (place.name, line) else f"causes: {causes}"

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
