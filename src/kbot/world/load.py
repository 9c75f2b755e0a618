"""A world from what a user wrote: a built-in world's name with parameters."""

from __future__ import annotations

from kbot.world.registry import build_world
from kbot.world.world import World


def load_world(world: str | World = "empty") -> World:
    """The world a text names (`boxes`, `maze:size=8,seed=3`); a World is handed through.

    Raises:
        KbotError: there is no such world, parameter or value.
    """
    return world if isinstance(world, World) else build_world(world)
