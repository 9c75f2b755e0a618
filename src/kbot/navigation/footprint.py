"""The space that a robot needs to drive and to turn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import hypot

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.shapes import bounds
from kbot.text import KbotError
from kbot.world.footprints import convex_outline


@dataclass(frozen=True, eq=False)
class Outline:
    """The convex outline of a robot seen from above: `corners` (n, 2) in m in the base's frame,
    counter-clockwise, grown by `margin`."""

    corners: NDArray[np.float64]
    margin: float = 0.0

    @classmethod
    def rectangle(cls, rear: float, front: float, right: float, left: float) -> Outline:
        """From x = `rear` to `front` and y = `right` to `left`."""
        return cls(np.array([(rear, right), (front, right), (front, left), (rear, left)]))

    @cached_property
    def _edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Outward normals (2, n) of the edges, and their distances from the origin."""
        along = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
        return normals.T, (normals * self.corners).sum(axis=1) + self.margin

    @property
    def reach(self) -> float:
        """Distance in m from the base's origin to the furthest corner."""
        return float(np.hypot(*self.corners.T).max()) + self.margin

    @property
    def middle(self) -> NDArray[np.float64]:
        """The middle of the box around the corners, (2,)."""
        middle: NDArray[np.float64] = (self.corners.min(axis=0) + self.corners.max(axis=0)) / 2.0
        return middle

    def grown(self, margin: float) -> Outline:
        return Outline(self.corners, self.margin + margin)

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the points (n, 2) are inside."""
        normals, offsets = self._edges
        inside: NDArray[np.bool_] = np.all(points @ normals < offsets, axis=1)
        return inside


def turning_radius(robot: RobotModel, base: str) -> float:
    """The radius in m that the robot needs to turn on the spot.

    It is the distance from the origin of the link `base` to the robot's furthest point seen from above, with
    all joints at zero. Each collision shape is replaced by the box around it.

    Raises:
        KbotError: the robot has no collision shape.
    """
    return max(hypot(x, y) for x, y in _corners(robot, base))


def outline(robot: RobotModel, base: str) -> Outline:
    """The robot's convex outline in the frame of the link `base`, joints at zero. Raises KbotError as
    `turning_radius` does."""
    return Outline(convex_outline(np.array(_corners(robot, base))))


def height(robot: RobotModel, base: str) -> float:
    """The robot's height in m along z of the link `base`, joints at zero."""
    heights = [z for _, (_, _, z) in corners_of_shapes(robot, base)]
    return max(heights) - min(heights) if heights else 0.0


def _corners(robot: RobotModel, base: str) -> list[tuple[float, float]]:
    found = [(x, y) for _, (x, y, _) in corners_of_shapes(robot, base)]
    if not found:
        raise KbotError(f"robot '{robot.name}' has no <collision>, so its size is unknown")
    return found


def corners_of_shapes(robot: RobotModel, base: str) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """The corners of the boxes around the collision shapes, each with its link, in m in the frame of `base`,
    joints at zero."""
    tree = FrameTree(robot)
    for link in robot.links.values():
        for collision in link.collisions:
            reach = bounds(collision.geometry)
            if reach is None:
                continue
            in_base = tree.pose(link.name, in_frame=base) @ Transform.of(collision.pose)
            for corner in product(*zip(*(v.tolist() for v in reach), strict=True)):
                x, y, z = in_base.apply(corner).tolist()
                yield link.name, (x, y, z)
