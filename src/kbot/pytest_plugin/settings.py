"""The settings of a test: its marker, and the files that the marker names."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from kbot.kinematics import PlanarPose
    from kbot.robot import Value
    from kbot.world import World

MARKER = (
    "kbot(robot, world, seeds, properties, arguments, start): the robot and the world for KBot's fixtures. "
    "A relative path starts at the folder of the test file. Several seeds run the test once with each."
)


@dataclass(frozen=True, slots=True)
class Settings:
    """The marker of a test. A marker of the function precedes that of its class, and that of its module."""

    robot: str | os.PathLike[str] | None = None
    world: str | World = "empty"
    seeds: Sequence[int] = (0,)
    properties: Mapping[str, Value] = field(default_factory=dict)
    arguments: Mapping[str, Value] = field(default_factory=dict)
    start: PlanarPose | Sequence[float] | None = None


def settings_of(node: pytest.Item) -> Settings:
    """Merge the markers of a test. Ends the test, or the collection of its file, if they are not valid."""
    given: dict[str, object] = {}
    for mark in node.iter_markers("kbot"):  # the closest first
        if mark.args:
            pytest.fail('the marker kbot takes only keywords, such as robot="robot.xacro"', False)
        given = {**mark.kwargs, **given}
    known = [entry.name for entry in fields(Settings)]
    for name in given:
        if name not in known:
            from kbot.text.suggest import suggest_or_list

            pytest.fail(
                f"unknown argument '{name}' of the marker kbot: {suggest_or_list(name, known)}", False
            )
    seeds = given.get("seeds", (0,))
    given["seeds"] = seeds = tuple(seeds) if isinstance(seeds, Iterable) else (seeds,)
    if not seeds or not all(type(seed) is int and seed >= 0 for seed in seeds):
        pytest.fail(f"seeds of the marker kbot must be whole numbers of at least 0, not {seeds}", False)
    robot, start = given.get("robot"), given.get("start")
    if not (robot is None or isinstance(robot, str | os.PathLike)):
        pytest.fail(f"robot of the marker kbot must be the name of a file, not {robot!r}", False)
    if not (start is None or _is_pose(start)):
        pytest.fail(f"start of the marker kbot must be x, y and yaw in m and rad, not {start!r}", False)
    return Settings(**given)  # type: ignore[arg-type]  # the values were checked, or are when they are used


def _is_pose(start: object) -> bool:
    from kbot.kinematics import PlanarPose

    if isinstance(start, PlanarPose):
        return True
    return isinstance(start, Sequence) and len(start) == 3 and all(isinstance(v, int | float) for v in start)


def start_of(node: pytest.Item) -> PlanarPose | None:
    from kbot.kinematics import PlanarPose

    start = settings_of(node).start
    return start if start is None or isinstance(start, PlanarPose) else PlanarPose(*start)


def robot_file(node: pytest.Item) -> str:
    """The file of the test's robot, or `kbot`. Raises KbotError: there is none."""
    from kbot.trials.places import find_robot

    given = settings_of(node).robot
    return default_robot(node) if given is None else find_robot(os.fspath(given), node.path.parent)


def default_robot(node: pytest.Item) -> str:
    """The robot of the ini option `kbot_robot`, or else of the package around the test file.

    Raises:
        KbotError: there is none, or the package has several.
    """
    from kbot.text import KbotError
    from kbot.trials.places import find_robot
    from kbot.trials.robot_folder import robot_of_folder

    named, root = node.config.getini("kbot_robot"), node.config.rootpath
    if named:
        return find_robot(named, root)
    packages = (folder for folder in node.path.parents if (folder / "package.xml").is_file())
    try:
        return robot_of_folder(str(next(packages, root)))
    except KbotError as error:
        hint = (
            'Name a robot with @pytest.mark.kbot(robot="FILE"), or with kbot_robot in pytest\'s configuration'
        )
        raise KbotError(f"{error}. {hint}") from None


def world_of(node: pytest.Item, seed: int) -> str | World:
    """The world of a test. Raises KbotError: there is no such file."""
    from kbot.trials.places import find_world

    world = settings_of(node).world
    return (
        find_world(world.replace("{seed}", str(seed)), node.path.parent) if isinstance(world, str) else world
    )


@contextmanager
def without_traceback() -> Iterator[None]:
    """Fail with the text of KBot's errors, and with the source lines of errors in a description."""
    from kbot.text import DescriptionError, KbotError

    try:
        yield
        return
    except DescriptionError as error:
        text = lines_of(error)
    except KbotError as error:
        text = str(error)
    raise pytest.fail.Exception(text, False) from None


def lines_of(error: Exception) -> str:
    """The errors of a description with their source lines; empty for another error."""
    from kbot.text import DescriptionError
    from kbot.text.render import render_text

    if not isinstance(error, DescriptionError):
        return ""
    return render_text(found for found in error.diagnostics if found.is_error) or str(error)
