"""How much room a robot takes as it drives and turns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import hypot

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.differential_drive import NoDrive, find_drive
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import Robot
from kbot.model.shapes import bounds
from kbot.text import KbotError


@dataclass(frozen=True, slots=True)
class Outline:
    """The rectangle about a robot seen from above, in its base's frame; m."""

    rear: float
    front: float
    right: float
    left: float

    def grown(self, margin: float) -> Outline:
        return Outline(self.rear - margin, self.front + margin, self.right - margin, self.left + margin)

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the points (n, 2) are inside."""
        x, y = points[:, 0], points[:, 1]
        return (x > self.rear) & (x < self.front) & (y > self.right) & (y < self.left)


def turning_radius(robot: Robot) -> float:
    """Metres from the base's origin to the robot's furthest point seen from above, joints at zero: what it
    takes to stand there with any heading. A box about each shape stands for it.

    Raises:
        KbotError: the robot does not drive, or has nothing that could touch an obstacle.
    """
    return max(hypot(x, y) for x, y in _corners(robot))


def outline(robot: Robot) -> Outline:
    """The rectangle that holds all of the robot, joints at zero. Raises KbotError as `turning_radius`."""
    xs, ys = zip(*_corners(robot), strict=True)
    return Outline(min(xs), max(xs), min(ys), max(ys))


def _corners(robot: Robot) -> list[tuple[float, float]]:
    found = list(_corners_of_shapes(robot))
    if not found:
        raise KbotError(f"robot '{robot.name}' has no <collision>: nothing says how much room it needs")
    return found


def _corners_of_shapes(robot: Robot) -> Iterator[tuple[float, float]]:
    tree = FrameTree(robot)
    drive = find_drive(robot, tree)
    if isinstance(drive, NoDrive):
        raise KbotError(f"robot '{robot.name}' cannot drive: {drive.reason}")
    for link in robot.links.values():
        for collision in link.collisions:
            reach = bounds(collision.geometry)
            if reach is None:
                continue
            pose = Transform.from_xyz_rpy(collision.pose.xyz, collision.pose.rpy)
            in_base = tree.pose(link.name, in_frame=drive.base) @ pose
            for corner in product(*zip(*(v.tolist() for v in reach), strict=True)):
                x, y, _ = in_base.apply(corner).tolist()
                yield x, y
