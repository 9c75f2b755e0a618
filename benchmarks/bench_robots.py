"""Which public mobile robots drive in KBot as commanded.

    python benchmarks/bench_robots.py [--from FOLDER] [NAME…]

Each robot of `robots.tsv` is fetched at its commit into a temporary folder, with the repositories that its
description includes from. KBot expands it with the arguments that its own simulation uses, checks it, drives
it at 0.3 m/s for 5 s and turns it at 0.5 rad/s for 5 s, each in its own process. A steered robot cannot turn
on the spot: it drives on an arc of 6 m radius. Distance and angle are shares of the command, with the start
from standstill. A robot drives as commanded if the distance is within 5 % and the angle within 10 %. It
drives as its own files state if both are within these shares of what `expected_share.py` computes from the
declared sizes and limits, without a simulation: a robot whose controller declares a wheel radius that is
10 % too large drives 9 % less, in its own simulator too.
Skid-steered robots are counted separately: how far they turn depends on how their wheels slip. A description
is incomplete if it needs a package that is not public, or if its repository lacks the mesh that gives the
size of its wheels. Exit status 1 if a command fails with a traceback, or a repository is not fetched.

`--from FOLDER` reads bare git folders named `OWNER+NAME` or `OWNER+NAME/repo` instead of GitHub, for a
machine without network.
"""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from public_repositories import (
    ENVIRONMENT,
    NotFetched,
    PublicFile,
    chosen_by_user,
    fetch,
    measure_all,
    read_manifest,
    run,
    shortened,
    without_folder,
)

MANIFEST = Path(__file__).with_name("robots.tsv")
SECONDS = 5.0
SPEED, RATE = 0.3, 0.5
"""The commands in m/s and rad/s."""
ARC_RATE = SPEED / 6.0
"""The rate at which a steered robot turns, in rad/s: even a car can follow the arc."""
DISTANCE_ERROR, ANGLE_ERROR = 0.05, 0.10
"""The largest errors of a robot that drives, as shares of the command."""
LIMIT = 180.0
"""Seconds after which a command is stopped."""


@dataclass(frozen=True)
class Robot(PublicFile):
    """A row of the manifest."""

    drive: str
    incomplete: str
    """Why the description is not complete, or empty."""


@dataclass
class Result:
    """What KBot reports on one robot."""

    robot: Robot
    expands: bool = False
    errors: int | None = None
    distance: float | None = None
    """Driven distance, as a share of the command."""
    angle: float | None = None
    """Turned angle, as a share of the command."""
    expected_distance: float | None = None
    expected_angle: float | None = None
    """What the robot's own files state, as shares of the command. They do not state how far a skid-steered
    robot turns."""
    expected_reason: str = ""
    """Why they do not state all of the command."""
    reason: str = ""
    """What KBot reported on a robot that does not drive as commanded."""
    failures: list[str] = field(default_factory=list)
    """Commands that failed with a traceback, and repositories that were not fetched."""

    @property
    def drives(self) -> bool:
        return self.distance is not None and abs(self.distance - 1) <= DISTANCE_ERROR

    @property
    def turns(self) -> bool:
        return self.angle is not None and abs(self.angle - 1) <= ANGLE_ERROR

    @property
    def is_as_commanded(self) -> bool:
        return self.drives and self.turns

    @property
    def is_as_stated(self) -> bool:
        """Whether the robot drives and turns as its own files state."""
        if self.distance is None or self.angle is None or self.expected_distance is None:
            return False
        if abs(self.distance - self.expected_distance) > DISTANCE_ERROR * max(
            1.0, abs(self.expected_distance)
        ):
            return False
        if self.expected_angle is None:
            return self.turns
        return abs(self.angle - self.expected_angle) <= ANGLE_ERROR * max(1.0, abs(self.expected_angle))

    @property
    def text(self) -> str:
        if self.failures:
            return "; ".join(self.failures)
        if self.is_as_commanded:
            return "drives"
        if self.is_as_stated:
            return f"as its own files state: {self.expected_reason or 'slow start'}"
        if self.distance is None or self.angle is None:
            return self.reason
        share = f"turns {100 * self.angle:.0f} %" if self.drives else f"drives {100 * self.distance:.0f} %"
        return f"{share}: {self.reason}" if self.reason else share


class Finished(NamedTuple):
    """A finished command of KBot. The status is None if it took too long."""

    status: int | None
    output: str
    errors: str

    @property
    def failure(self) -> str | None:
        """The last line of a traceback, or what else ended the command unexpectedly."""
        if self.status is not None and self.status < 0:
            return f"ended by signal {-self.status}"
        if "Traceback (most recent call last)" in self.errors:
            return self.errors.strip().splitlines()[-1]
        return None


def main() -> int:
    robots, folder = chosen_by_user(__doc__, read_robots())
    # the robots of one repository share a checkout, which is removed after them
    jobs = [list(group) for _, group in itertools.groupby(robots, key=lambda robot: robot.source)]
    results = list(itertools.chain(*measure_all(lambda job: _measure_together(job, folder), jobs)))
    print("\n".join((*_table(results), "", *_summary(results))))
    return int(any(result.failures for result in results))


def read_robots() -> list[Robot]:
    return [
        Robot(**vars(file), drive=row["drive"], incomplete=row["incomplete"])
        for file, row in read_manifest(MANIFEST)
    ]


def _measure_together(robots: list[Robot], folder: Path | None) -> list[Result]:
    """Measure robots of one repository."""
    with tempfile.TemporaryDirectory() as scratch:
        return [_measure(robot, Path(scratch), folder) for robot in robots]


def _measure(robot: Robot, scratch: Path, folder: Path | None) -> Result:
    result = Result(robot)
    try:
        for source in (robot.source, *robot.packages):
            if not (scratch / source.folder).exists():
                fetch(source, scratch, folder)
    except NotFetched as error:
        result.failures.append(f"not fetched: {error}")
    else:
        _run_commands(result, scratch)
    print(f"{robot.name}: {result.text}", file=sys.stderr)
    return result


def _run_commands(result: Result, scratch: Path) -> None:
    robot = result.robot
    here = scratch / robot.source.folder

    def kbot(verb: str, *options: str) -> Finished:
        packages = [f"--package-path={scratch / package.folder}" for package in robot.packages]
        finished = _kbot([verb, robot.file, *robot.arguments, *packages, *options], here)
        if finished.failure:
            result.failures.append(f"kbot {verb}: {finished.failure}")
        return finished

    result.expands = kbot("expand", "-q").status == 0
    checked = _json(kbot("check", "--json"))
    if checked is not None:
        result.errors = sum(finding["severity"] == "error" for finding in checked["findings"])
    _expect(result, scratch)
    speed, rate = (SPEED, ARC_RATE) if robot.drive == "steered" else (0, RATE)
    straight, turned = (
        kbot("sim", "--headless", "--json", f"--duration={SECONDS:g}", f"--cmd-vel={command}")
        for command in (f"{SPEED},0", f"{speed},{rate}")
    )
    if (report := _json(straight)) is not None:
        result.distance = report["pose"]["x"] / (SPEED * SECONDS)
    if (report := _json(turned)) is not None:
        result.angle = report["turned_rad"] / (rate * SECONDS)
    if not result.drives or not result.turns:
        reason = _reason(turned if result.drives else straight)
        result.reason = shortened(without_folder(reason, scratch))


def _expect(result: Result, scratch: Path) -> None:
    """Compute what the robot's own files state."""
    robot = result.robot
    packages = [f"--package-path={scratch / package.folder}" for package in robot.packages]
    script = str(Path(__file__).with_name("expected_share.py"))
    words = [sys.executable, script, robot.file, *robot.arguments, *packages]
    try:
        ran = run(words, scratch / robot.source.folder, ENVIRONMENT, LIMIT)
        expected = json.loads(ran.stdout)
    except (subprocess.TimeoutExpired, json.JSONDecodeError):
        return
    if expected is not None:
        result.expected_distance, result.expected_angle = expected["distance"], expected["angle"]
        result.expected_reason = expected["reason"]


def _kbot(words: list[str], here: Path) -> Finished:
    try:
        ran = run([sys.executable, "-m", "kbot", *words], here, ENVIRONMENT, LIMIT)
    except subprocess.TimeoutExpired:
        return Finished(None, "", "")
    return Finished(ran.returncode, ran.stdout, ran.stderr)


def _json(finished: Finished) -> dict[str, Any] | None:
    """The printed JSON, or None if the command did not succeed."""
    try:
        printed: dict[str, Any] = json.loads(finished.output)
    except json.JSONDecodeError:
        return None
    return printed


def _reason(finished: Finished) -> str:
    """What a simulation reported: its first finding on the motion, or its first error."""
    if finished.status is None:
        return f"no result within {LIMIT:g} s"
    report = _json(finished)
    if report is not None:
        return next((f"{finding['message']} [{finding['code']}]" for finding in report["findings"]), "")
    lines = finished.errors.strip().splitlines()
    for line in lines:
        where, found, message = line.partition("error: ")
        if found:
            return f"{Path(where).name}{message}"
    return lines[-1] if lines else ""


def _table(results: Iterable[Result]) -> Iterator[str]:
    yield "| robot | drive | expands | errors | distance | stated | angle | stated | result |"
    yield "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | --- |"
    for result in results:
        robot = result.robot
        cells = (
            robot.name,
            robot.drive,
            "yes" if result.expands else "no",
            "" if result.errors is None else str(result.errors),
            _percent(result.distance),
            _percent(result.expected_distance),
            _percent(result.angle),
            _percent(result.expected_angle),
            result.text + (f" (incomplete: {robot.incomplete})" if robot.incomplete else ""),
        )
        yield f"| {' | '.join(cells)} |"


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.0f} %"


def _summary(results: list[Result]) -> Iterator[str]:
    yield "| drive | robots | complete | expand | drive within 5 % | and turn within 10 % | or as stated |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    for drive in sorted({result.robot.drive for result in results}):
        yield _counts(drive, [result for result in results if result.robot.drive == drive])
    others = [result for result in results if result.robot.drive != "skid"]
    yield _counts("all", results)
    yield _counts("all without skid", others)
    complete = [result for result in others if not result.robot.incomplete]
    commanded = sum(result.is_as_commanded for result in complete)
    stated = sum(result.is_as_commanded or result.is_as_stated for result in complete)
    for number, how in (
        (commanded, "drive within 5 % and turn within 10 % of the command"),
        (stated, "do so, or drive and turn within these shares of what their own files state"),
    ):
        share = f", {100 * number / len(complete):.0f} %" if complete else ""
        yield ""
        yield f"{number} of {len(complete)} complete robots that are not skid-steered {how}{share}."


def _counts(drive: str, results: list[Result]) -> str:
    """A row of the summary. Robots are counted as driving only if their descriptions are complete."""
    complete = [result for result in results if not result.robot.incomplete]
    numbers = (
        len(results),
        len(complete),
        sum(result.expands for result in complete),
        sum(result.drives for result in complete),
        sum(result.is_as_commanded for result in complete),
        sum(result.is_as_commanded or result.is_as_stated for result in complete),
    )
    return f"| {drive} | {' | '.join(map(str, numbers))} |"


if __name__ == "__main__":
    sys.exit(main())
