"""Searches over designs: runs a scenario with many values of a robot's arguments and properties."""

from kbot.sweep.api import sweep

__all__ = ["sweep"]
