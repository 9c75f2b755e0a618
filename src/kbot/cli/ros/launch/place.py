"""The world that a launch simulates in."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import NamedTuple

from kbot.cli.output import print_note
from kbot.world import BUILDERS, World, load_world


class Place(NamedTuple):
    """A world, and what it is called by: the name of one that is built in, or a file."""

    named: str
    world: World


def find_place(wanted: str | None, launched: str) -> Place:
    """The world that is `wanted`, else that of the launch file: a file that is there, else KBot's own of that
    name, else the empty one, which is said.

    Raises:
        DescriptionError, KbotError: it cannot be used.
    """
    named = wanted or _known(launched)
    return Place(named, load_world(named))


def _known(name: str) -> str:
    if Path(name).is_file():
        return name
    own = PurePosixPath(name.replace("\\", "/")).stem
    if own in BUILDERS:
        return own
    print_note(f"The world '{name}' is not found: the robot starts in 'empty'.")
    return "empty"
