"""The files on which the results of a sweep depend: of the robot, the worlds and the scenarios."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from kbot.kinematics.controller_files import controller_files
from kbot.kinematics.drive.nearby import with_nearby_drive
from kbot.model.geometry import Mesh
from kbot.model.load import load_robot, resolve_robot_path
from kbot.sweep.plan import design_robot
from kbot.sweep.space import Choices, Dimension, Interval, Levels, Space, Target, Value, Values
from kbot.text import DiagnosticCollector
from kbot.text.files import files_read
from kbot.trials.actions import DriveWithPolicy, RunScript
from kbot.trials.pool import Pool, Task
from kbot.trials.scenario import RobotSource, Scenario
from kbot.worker import WorkerLimits
from kbot.world.load import MAP_SUFFIXES, SDF_SUFFIXES, load_world
from kbot.xacro import Packages

_MOST_COMBINATIONS = 200
"""Combinations of texts whose robots are read. Of more, each text is read once."""
_MOST_SEEDS = 1000
"""Seeds whose worlds are read, if each seed has its own file."""


@dataclass(frozen=True)
class ReadInputs:
    """What was read to find the files.

    files           the files of robots and worlds
    optional_parts  the names of links and joints that only some of the robots have
    """

    files: frozenset[str]
    optional_parts: frozenset[str]


def read_inputs(robot: RobotSource, space: Space, tasks: Sequence[Task], pool: Pool) -> ReadInputs:
    """Read the robots and worlds of a sweep, in processes of the pool.

    Those that cannot be read have no files. Their runs report the reason.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    robots = pool.map(
        read_robot_inputs,
        [design_robot(robot, space, values) for values in sampled_designs(space)],
        lambda _: WorkerLimits().seconds,
    )
    worlds = pool.map(_read_world, _world_files(space, tasks), lambda _: WorkerLimits().seconds)
    if pool.interrupted:
        raise KeyboardInterrupt
    found = [each.value for each in robots if each is not None and each.value is not None]
    files = {file for each in found for file in each.files}
    files |= {file for each in worlds if each is not None for file in each.value or ()}
    parts = [each.parts for each in found if each.parts]
    optional = frozenset.union(*parts) - frozenset.intersection(*parts) if parts else frozenset[str]()
    return ReadInputs(frozenset(files), optional)


def scenario_files(scenario: Scenario, space: Space) -> Iterator[str]:
    """The scripts, policies and programs of a scenario, and files that are values of its keys."""
    actions = [step.action for step in scenario.steps]
    yield from (
        each.script for each in actions if isinstance(each, RunScript) and isinstance(each.script, str)
    )
    yield from (each.file for each in actions if isinstance(each, DriveWithPolicy))
    yield from (program.file for program in scenario.programs)
    for each in space.dimensions:
        if each.target is Target.SCENARIO and each.kind is str:
            yield from (str(value) for value in each.domain.samples() if Path(str(value)).is_file())


def file_digests(files: Iterable[str]) -> dict[str, str]:
    """A digest of the content of each file by its name. It is empty for a file that cannot be read."""
    return {file: _digest(file) for file in sorted(set(files))}


def changed_files(digests: Mapping[str, str]) -> list[str]:
    """The files whose content differs from `file_digests`."""
    return [file for file, digest in digests.items() if _digest(file) != digest]


def _digest(file: str) -> str:
    try:
        with Path(file).open("rb") as opened:
            return hashlib.file_digest(opened, "sha256").hexdigest()
    except OSError:
        return ""


def sampled_designs(space: Space) -> list[Values]:
    """Designs whose robots have all files: texts may name them, in combination. Numbers rarely do.

    These are the combinations of all texts, and few values of each number.
    """
    first = tuple(each.domain.samples()[0] for each in space.dimensions)
    texts = [[value] for value in first]
    single: list[Values] = []
    for index, each in enumerate(space.dimensions):
        if each.target in (Target.ARGUMENT, Target.PROPERTY):
            values = _samples(each)
            if each.kind is str:
                texts[index] = values
            else:
                single += [(*first[:index], value, *first[index + 1 :]) for value in values[1:]]
    if math.prod(map(len, texts)) <= _MOST_COMBINATIONS:
        return [*product(*texts), *single]
    for index, values in enumerate(texts):
        single += [(*first[:index], value, *first[index + 1 :]) for value in values[1:]]
    return [first, *single]


def _samples(dimension: Dimension) -> list[Value]:
    """All texts of a dimension, or the ends of its numbers and one between them."""
    values = dimension.domain.samples()
    if dimension.kind is str or not isinstance(dimension.domain, Choices):
        return values
    return [values[index] for index in sorted({0, len(values) // 2, len(values) - 1})]


@dataclass(frozen=True)
class ReadRobot:
    """The files of a robot, also its meshes and controllers, and the names of its links and joints."""

    files: frozenset[str]
    parts: frozenset[str]


def read_robot_inputs(source: RobotSource) -> ReadRobot:
    """Read a robot with all files on which its simulation depends."""
    loaded = load_robot(source.file, source.arguments, source.properties, Packages(source.packages))
    files = {resolve_robot_path(source.file), *loaded.expansion.dependencies}
    robot = loaded.robot
    if robot is None:
        return ReadRobot(frozenset(files), frozenset())
    shapes = [shape.geometry for link in robot.links.values() for shape in link.shapes]
    files |= {shape.path for shape in shapes if isinstance(shape, Mesh) and shape.path is not None}
    with files_read() as read:
        list(controller_files(robot))
        with_nearby_drive(robot, DiagnosticCollector())
    return ReadRobot(frozenset({*files, *read}), frozenset({*robot.links, *robot.joints}))


def _world_files(space: Space, tasks: Sequence[Task]) -> list[str]:
    """The worlds that are files, of all seeds."""
    varied = {each.target: each.domain for each in space.dimensions}
    found: dict[str, None] = {}
    for task in tasks:
        worlds = varied[Target.WORLD].samples() if Target.WORLD in varied else [task.scenario.world]
        for world in map(str, worlds):
            if Path(world).suffix.lower() in (*SDF_SUFFIXES, *MAP_SUFFIXES):
                seeds = _seeds(varied.get(Target.SEED), task.seed) if "{seed}" in world else [0]
                found |= {world.replace("{seed}", str(seed)): None for seed in seeds}
    return list(found)


def _seeds(domain: Choices | Levels | Interval | None, default: int) -> list[Value]:
    if domain is None or isinstance(domain, Interval):
        return [default]
    return [domain.nth(index) for index in range(min(domain.count, _MOST_SEEDS))]


def _read_world(file: str) -> frozenset[str]:
    with files_read() as read:
        load_world(file)
    return frozenset(read)
