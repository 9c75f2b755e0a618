"""Functions that build bodies of worlds: floors, walls, boxes, slopes."""

from __future__ import annotations

from math import atan2, cos, hypot, sin

from kbot.kinematics.transform import Transform
from kbot.world.world import GREY, Body, Box, Cylinder, Part, Plane, Rgba

FLOOR: Rgba = (0.86, 0.87, 0.88, 1.0)
WALL: Rgba = (0.58, 0.63, 0.70, 1.0)
WOOD: Rgba = (0.76, 0.58, 0.38, 1.0)
ORANGE: Rgba = (0.90, 0.45, 0.13, 1.0)
GREEN: Rgba = (0.33, 0.60, 0.40, 1.0)
BLACK: Rgba = (0.08, 0.08, 0.09, 1.0)
WALL_THICKNESS = 0.02
"""Thickness in m of a wall by default. A wall of `rooms` reaches into a door by half of it on each side."""


def floor(size: float = 40.0, friction: float = 1.0) -> Body:
    """The plane z = 0. A picture shows `size` x `size` metres of it."""
    return Body("ground_plane", (Part(Plane((size, size)), rgba=FLOOR, friction=friction, ground=True),))


def at(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> Transform:
    return Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw))


def box(
    name: str,
    size: tuple[float, float, float],
    x: float,
    y: float,
    z: float | None = None,
    yaw: float = 0.0,
    rgba: Rgba = GREY,
    *,
    ground: bool = False,
) -> Body:
    """A static box. Without the height `z` of its centre, it is on z = 0."""
    height = size[2] / 2 if z is None else z
    return Body(name, (Part(Box(size), rgba=rgba, ground=ground),), at(x, y, height, yaw))


def cylinder(name: str, radius: float, height: float, x: float, y: float, rgba: Rgba = GREY) -> Body:
    """A static upright cylinder on z = 0."""
    return Body(name, (Part(Cylinder(radius, height), rgba=rgba),), at(x, y, height / 2))


def wall(
    name: str,
    start: tuple[float, float],
    end: tuple[float, float],
    height: float = 0.25,
    thickness: float = WALL_THICKNESS,
) -> Body:
    """A wall on z = 0 between two points. It extends beyond them by half its thickness."""
    along, across = end[0] - start[0], end[1] - start[1]
    length = hypot(along, across)
    yaw = atan2(across, along)
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    return box(name, (length + thickness, thickness, height), *middle, yaw=yaw, rgba=WALL)


def slope(
    name: str, length: float, width: float, angle: float, x: float, y: float, z: float, rgba: Rgba = WOOD
) -> Body:
    """A plate to drive up along +x.

    Its upper face starts at (x, y, z), rises at `angle` (rad), and is `length` metres long.
    """
    thickness = 0.04
    centre_x = x + cos(angle) * length / 2 + sin(angle) * thickness / 2
    centre_z = z + sin(angle) * length / 2 - cos(angle) * thickness / 2
    pose = Transform.from_xyz_rpy((centre_x, y, centre_z), (0.0, -angle, 0.0))
    return Body(name, (Part(Box((length, width, thickness)), rgba=rgba, ground=True),), pose)
