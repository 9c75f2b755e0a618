"""Chooses the world that a launch is simulated in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from kbot.ros.launch.absent_packages import absent_package, readable
from kbot.world import BUILDERS, World, load_world


class ChosenWorld(NamedTuple):
    """A world, and the name of the built-in world or file that it is loaded from."""

    name: str
    world: World


def choose_world(wanted: str | None, launched: str, note: Callable[[str], None]) -> ChosenWorld:
    """Load the world `wanted`, otherwise the one that the launch file names: its file if that exists, else
    KBot's world of the same name, else the empty world, with a note for the user.

    Raises:
        DescriptionError, KbotError: the world cannot be used.
    """
    name = wanted or _known(launched, note)
    return ChosenWorld(name, load_world(name))


def _known(name: str, note: Callable[[str], None]) -> str:
    if Path(name).is_file():
        return name
    own = PurePosixPath(name.replace("\\", "/")).stem
    if own in BUILDERS:
        return own
    shown = readable(name) if absent_package(name) else f"'{name}'"
    note(f"The world {shown} is not found. The robot starts in 'empty'.")
    return "empty"
