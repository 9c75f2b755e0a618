"""What the optional parts of KBot add to its core: file kinds of `kbot check`, verbs, and peers.

The core asks here and imports no such part itself. A part that is not installed adds nothing.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from types import ModuleType

PARTS = ("kbot.ros",)


@cache
def parts() -> tuple[ModuleType, ...]:
    """The module `extensions` of each part that is installed."""
    found = []
    for part in PARTS:
        try:
            found.append(import_module(f"{part}.extensions"))
        except ModuleNotFoundError as error:
            if error.name not in (part, f"{part}.extensions"):
                raise
    return tuple(found)
