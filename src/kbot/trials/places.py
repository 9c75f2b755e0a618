"""Finds the files that a scenario names: relative to the scenario's file, or in packages."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from kbot.learn.policies.policy import Policy
from kbot.model.load import SHIPPED_NAME
from kbot.text import KbotError
from kbot.text.folders import names_in
from kbot.text.suggest import did_you_mean
from kbot.trials.actions import Action, DriveWithPolicy, RunScript
from kbot.trials.robot_folder import robot_of_folder
from kbot.trials.scenario import Program, RobotSource, Scenario
from kbot.world import parameters
from kbot.world.load import MAP_SUFFIXES, SDF_SUFFIXES
from kbot.xacro import Packages

_PACKAGE = "package://"
_LONGEST_SHOWN = 300
"""Characters of a path that an error names."""


def find_file(name: str, folder: Path) -> str:
    """The path of a file that a file in `folder` names. Raises KbotError: there is no such file."""
    if name.startswith(_PACKAGE):
        package, _, rest = name.removeprefix(_PACKAGE).partition("/")
        path = Path(Packages().beside(str(folder / "scenario")).find(package)) / rest
    else:
        path = folder / name
    if not os.path.exists(path):  # noqa: PTH110 - unlike that of Path, also for a name that is too long
        raise KbotError(f"there is no file {_shortened(str(path))}{_near(path)}")
    return str(path)


def find_regular_file(name: str, folder: Path) -> str:
    """As `find_file`, but not a folder, a device or a pipe."""
    path = find_file(name, folder)
    if not Path(path).is_file():
        raise KbotError(f"{path} is not a file")
    return path


def find_policy(name: str, folder: Path) -> str:
    """As `find_regular_file`, for a policy. Raises KbotError also if it cannot be used."""
    path = find_regular_file(name, folder)
    Policy.read(path)
    return path


def _near(path: Path) -> str:
    """A hint to a file with a similar name."""
    near = did_you_mean(path.name, names_in(path.parent))
    return f" ({near})" if near else ""


def _shortened(name: str) -> str:
    return name if len(name) <= _LONGEST_SHOWN else f"{name[:_LONGEST_SHOWN]}…"


def find_robot(name: str, folder: Path) -> str:
    """The robot's file that a file in `folder` names: a file, a package, or `kbot`.

    Raises:
        KbotError: there is no such file, or the package has no robot or several.
    """
    if name == SHIPPED_NAME:
        return name
    path = find_file(name, folder)
    return robot_of_folder(path) if Path(path).is_dir() else path


def find_world(name: str, folder: Path) -> str:
    """A world's file that a file in `folder` names. The name of a built-in world is not changed.

    Raises:
        KbotError: there is no such file or world, or the world has no such parameter.
    """
    if Path(name).suffix.lower() in (*SDF_SUFFIXES, *MAP_SUFFIXES):
        return str(folder / name) if "{seed}" in name else find_regular_file(name, folder)
    parameters(name.replace("{seed}", "0"))
    return name


def placed(scenario: Scenario, folder: Path) -> Scenario:
    """A scenario of a Python file in `folder`, with the paths of the files that it names."""

    def program(each: Program) -> Program:
        return replace(each, file=find_regular_file(each.file, folder))

    return replace(
        scenario,
        robot=_placed_robot(scenario.robot, folder),
        world=find_world(scenario.world, folder),
        steps=tuple(replace(step, action=_placed_action(step.action, folder)) for step in scenario.steps),
        programs=tuple(map(program, scenario.programs)),
    )


def _placed_action(action: Action, folder: Path) -> Action:
    if isinstance(action, RunScript) and isinstance(action.script, str):
        return RunScript(find_regular_file(action.script, folder))
    if isinstance(action, DriveWithPolicy):
        return replace(action, file=find_policy(action.file, folder))
    return action


def _placed_robot(robot: RobotSource | None, folder: Path) -> RobotSource | None:
    return None if robot is None else replace(robot, file=find_robot(robot.file, folder))
