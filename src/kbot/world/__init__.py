"""Floors, walls and things: what a robot drives on and runs into."""

from kbot.world.builtin.registry import BUILDERS, parameters
from kbot.world.load import load_world
from kbot.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HeightField,
    Mesh,
    Part,
    Plane,
    Shape,
    Sphere,
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
    "Mesh",
    "Part",
    "Plane",
    "Shape",
    "Sphere",
    "World",
    "load_world",
    "parameters",
]
