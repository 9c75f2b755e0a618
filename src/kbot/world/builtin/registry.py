"""The built-in worlds by name, with their parameters: `maze:size=8,seed=3`."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import get_type_hints

from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world.builtin.buildings import corridor, rooms
from kbot.world.builtin.maze import maze
from kbot.world.builtin.simple import boxes, empty
from kbot.world.builtin.terrain import obstacle_course, ramp, stairs
from kbot.world.builtin.track import track
from kbot.world.world import World

BUILDERS: dict[str, Callable[..., World]] = {
    builder.__name__: builder
    for builder in (empty, boxes, maze, rooms, corridor, ramp, stairs, obstacle_course, track)
}


def build_world(text: str) -> World:
    """The built-in world `name` or `name:parameter=value,parameter=value`.

    Raises:
        KbotError: no such world or parameter (the nearest names are said), or no such value.
    """
    builder, values = _read(text)
    return builder(**values)


def parameters(text: str) -> dict[str, int | float]:
    """A world's parameters: as `text` gives them, as for `build_world`, or what they are when not given.

    Raises:
        KbotError: as `build_world`.
    """
    builder, values = _read(text)
    return {key: p.default for key, p in inspect.signature(builder).parameters.items()} | values


def built_in(text: str) -> str:
    """The built-in world that a text names, empty for none."""
    name = text.partition(":")[0].replace("-", "_")
    return name if name in BUILDERS else ""


def _read(text: str) -> tuple[Callable[..., World], dict[str, int | float]]:
    """A world's builder and the parameters that are given."""
    name, _, written = text.partition(":")
    builder = BUILDERS.get(name.replace("-", "_"))
    if builder is None:
        raise KbotError(_unknown(f"there is no world '{name}'", name, list(BUILDERS)))
    types = {key: kind for key, kind in get_type_hints(builder).items() if key != "return"}
    values: dict[str, int | float] = {}
    for word in written.split(",") if written else ():
        key, equals, value = word.partition("=")
        key = key.strip()
        if not equals:
            raise KbotError(f"world '{name}': '{word}' should read parameter=value")
        if key not in types:
            raise KbotError(_unknown(f"world '{name}' has no parameter '{key}'", key, list(types)))
        if key in values:
            raise KbotError(f"world '{name}': {key} is given twice")
        values[key] = _number(name, key, value.strip(), types[key])
    return builder, values


def _number(world: str, key: str, value: str, kind: type) -> int | float:
    try:
        number = int(value) if kind is int else float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or abs(number) > 1e6 or (key == "seed" and number < 0):
        what = "a whole number" if kind is int else "a number"
        raise KbotError(f"world '{world}': {key} is {what} of sensible size, not '{value}'")
    return number


def _unknown(what: str, name: str, known: list[str]) -> str:
    return f"{what}: {did_you_mean(name, known) or 'there are ' + ', '.join(known)}"
