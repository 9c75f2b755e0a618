"""Reads Gazebo's worlds and models: SDF 1.4 to 1.11 (sdformat.org/spec)."""

from kbot.world.sdf.reader import read_sdf

__all__ = ["read_sdf"]
