"""Worlds: floors, walls and objects that a robot drives on and collides with."""

from kbot.world.builtin.registry import BUILDERS, built_in, parameters
from kbot.world.load import load_world
from kbot.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HeightField,
    Part,
    Plane,
    Shape,
    Sphere,
    TriangleMesh,
    World,
)

__all__ = [
    "BUILDERS",
    "Body",
    "Box",
    "Capsule",
    "Cylinder",
    "Ellipsoid",
    "HeightField",
    "Part",
    "Plane",
    "Shape",
    "Sphere",
    "TriangleMesh",
    "World",
    "built_in",
    "load_world",
    "parameters",
]
