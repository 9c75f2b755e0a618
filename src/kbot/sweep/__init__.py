"""Searches over designs: runs a scenario with many values of a robot's arguments and properties."""

from kbot.lazy_names import public_names
from kbot.sweep.api import sweep

__all__ = ["sweep"]

__dir__ = public_names(__all__)
