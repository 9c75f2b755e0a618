"""Finds the robot of a package or folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from kbot.checks.file_kinds import kind_of
from kbot.checks.folder_files import entry_points
from kbot.model.load import load_robot
from kbot.text import DescriptionError, KbotError
from kbot.text.file_kind import MAY_BE_ROBOT, ROBOT, kind_of_file
from kbot.text.folders import files_below
from kbot.xacro import Packages
from kbot.xacro.packages import package_around

_TRIED = 100
"""Files of a package that are loaded to find its robot."""
_LISTED = 8
"""Robots of a package that an error names."""


def absolute(path: str | os.PathLike[str]) -> str:
    """An absolute path without `..`. Symbolic links are not resolved."""
    return os.path.normpath(Path(path).absolute())


def robot_files(folder: str) -> Iterator[str]:
    """The files below a folder that are a robot or a part of one. Only the files of some endings are read.

    Raises KbotError: the folder has too many files.
    """
    files = files_below(folder, lambda name: name.endswith(MAY_BE_ROBOT))
    return (file for file in files if kind_of_file(file) == ROBOT)


def own_package(file: str) -> tuple[str, ...]:
    """The package that contains a file, which comes before others of the same name; empty outside one."""
    package = package_around(Path(absolute(file)).parent)
    return () if package is None else (str(package),)


def robot_of_folder(folder: str, package_path: Sequence[str] = (), shown: Callable[[str], str] = str) -> str:
    """The robot of a folder: its only description that is a whole robot and that no other file includes.

    `package_path` lists folders in which packages are searched first. `shown` gives the name of a path in
    errors.

    Raises:
        KbotError: the folder has no robot, several, or too many files.
    """
    try:
        robots = {file for file in entry_points(folder) if kind_of(file) is None}
    except DescriptionError:
        robots = set()
    found = sorted({*robots, *_of_includes(folder, package_path)})
    if not found:
        raise KbotError(f"the folder {shown(folder)} contains no robot (.xacro or .urdf)")
    if len(found) > 1:
        names = ", ".join(map(shown, found[:_LISTED])) + (", …" if len(found) > _LISTED else "")
        raise KbotError(f"the folder {shown(folder)} contains {len(found)} robots. Choose one: {names}")
    return found[0]


def _of_includes(folder: str, package_path: Sequence[str]) -> Iterator[str]:
    """The descriptions of a folder that are a whole robot only with the files that they include."""
    loaded = {
        file: load_robot(file, packages=Packages((*own_package(file), *package_path)))
        for file in sorted(robot_files(folder))[:_TRIED]
    }
    used = {absolute(name) for found in loaded.values() for name in found.expansion.dependencies}
    for file, found in loaded.items():
        if not found.has_errors and found.expansion.dependencies and absolute(file) not in used:
            yield file
