"""What configures KBot, and what it adds to other programs: files of settings, environment variables, entry
points, extras, worlds, environments, the pytest plugin, the GitHub action and the hook."""

from __future__ import annotations

import inspect
import re
import tomllib
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import yaml

import kbot
from kbot import pytest_plugin
from kbot.checks import load_config
from kbot.pytest_plugin.settings import MARKER
from kbot.world import BUILDERS, parameters

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "kbot"
_VARIABLE = re.compile(
    r"""["']((?:KBOT|ROS|RMW|AMENT|GAZEBO|GZ|IGN|SDF|XDG|ZENOH|CYCLONEDDS)_(?!IGNORE|TO_)[A-Z_]+|NO_COLOR)["']"""
)
"""A text in the source that names an environment variable of KBot, ROS, Gazebo, a transport or the desktop.
`AMENT_IGNORE` is a file, `ROS_TO_GZ` a value."""
_GROUP = re.compile(r'entry_points\(group="([\w.]+)"')


def lines() -> Iterator[str]:
    """One line for each setting and name."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    yield f"python: {project['requires-python']}"
    yield from (f"extra: {name}" for name in sorted(project["optional-dependencies"]))
    yield from (f"command: {name}" for name in sorted(project["scripts"]))
    for group, names in sorted(project["entry-points"].items()):
        yield from (f"entry point of {group}: {name}" for name in sorted(names))
    yield from (f"entry points that KBot loads: {group}" for group in _in_source(_GROUP))
    yield from (f"key of [tool.kbot.check]: {key}" for key in _keys())
    yield from (f"environment variable: {name}" for name in _in_source(_VARIABLE))
    for name in sorted(BUILDERS):
        yield f"world: {name}"
        yield from (f"world {name}: {key} = {value}" for key, value in parameters(name).items())
    for name in sorted(each for each in gymnasium.registry if "kbot" in each.lower()):
        yield f"environment of Gymnasium: {name}"
    yield from _of_pytest()
    action = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
    yield from (
        f"input of the GitHub action: {key} = {value['default']!r}"
        for key, value in sorted(action["inputs"].items())
    )
    for hook in yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8")):
        yield f"hook of pre-commit: {hook['id']}"


def _keys() -> list[str]:
    """The keys that the error about an unknown key lists."""
    with TemporaryDirectory() as folder, chdir(folder):
        Path("kbot.toml").write_text("[check]\nunknown = 1\n")
        try:
            load_config("robot.urdf")
        except kbot.KbotError as error:
            return sorted(str(error).rpartition("one of ")[2].split(", "))
    raise AssertionError("an unknown key is accepted")


def _of_pytest() -> Iterator[str]:
    """The fixtures, options and the marker of the pytest plugin."""
    for name, value in sorted(vars(pytest_plugin).items()):
        function = getattr(value, "_fixture_function", None)
        if function is not None:
            yield f"fixture of pytest: {name} -> {inspect.signature(function).return_annotation}"
    parser = _Parser()
    pytest_plugin.pytest_addoption(parser)  # type: ignore[arg-type]
    yield from sorted(parser.found)
    yield f"marker of pytest: {MARKER.partition(':')[0]}"
    yield from (f"files that pytest collects: *{ending}" for ending in sorted(pytest_plugin.ENDINGS))


class _Parser:
    """Collects the options that a plugin of pytest adds."""

    def __init__(self) -> None:
        self.found: list[str] = []

    def getgroup(self, *_: str) -> _Parser:
        return self

    def addoption(self, name: str, **_: Any) -> None:
        self.found.append(f"option of pytest: {name}")

    def addini(self, name: str, *_: str, **others: Any) -> None:
        self.found.append(f"ini option of pytest: {name} ({others.get('type', 'string')})")


def _in_source(pattern: re.Pattern[str]) -> list[str]:
    texts = (file.read_text("utf-8") for file in SOURCE.rglob("*.py"))
    return sorted({found for text in texts for found in pattern.findall(text)})
