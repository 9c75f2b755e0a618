"""A world from what a user wrote: a built-in world's name with parameters, or a file."""

from __future__ import annotations

import os
from pathlib import Path

from kbot.text import KbotError
from kbot.text.errors import reading
from kbot.text.suggest import did_you_mean
from kbot.world.builtin.registry import BUILDERS, build_world
from kbot.world.world import World

SDF_SUFFIXES = (".world", ".sdf")
MAP_SUFFIXES = (".yaml", ".yml")


def load_world(world: str | os.PathLike[str] | World = "empty") -> World:
    """The world a text names: a built-in one (`boxes`, `maze:size=8,seed=3`), an SDF file (`.world`,
    `.sdf`), or a map (`.yaml` beside its picture). A World is handed through.

    Raises:
        DescriptionError: a file that cannot be used; everything that is wrong with it.
        KbotError: there is no such world, parameter or value.
    """
    if isinstance(world, World):
        return world
    if not isinstance(world, str | os.PathLike):
        raise KbotError(
            f"a world is a World, a name such as 'empty' or 'maze:size=8', or a file, not {world!r}"
        )
    text = os.fspath(world)
    suffix = Path(text).suffix.lower()
    if suffix in SDF_SUFFIXES:
        from kbot.world.sdf import read_sdf  # built-in worlds need no reader: start-up time

        with reading(text):
            return read_sdf(text)
    if suffix in MAP_SUFFIXES:
        from kbot.world.maps import map_world

        with reading(text):
            return map_world(text)
    if "/" in text or os.sep in text or Path(text).is_file():
        known = ", ".join((*SDF_SUFFIXES, *MAP_SUFFIXES))
        near = did_you_mean(text, BUILDERS)
        raise KbotError(f"{text} is no world: a file of one ends in {known}" + (f"; {near}" if near else ""))
    return build_world(text)
