"""The space that a robot needs to drive and to turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import hypot

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.shapes import bounds
from kbot.navigation.space.regions import Regions
from kbot.text import KbotError
from kbot.world.footprints import convex_outline

_SOLID = 0.8
"""Share of its convex outline that a robot fills. A robot that fills less has pockets which matter: an
L-shape passes a corner that its convex outline does not."""
_RASTER = 60
"""Points along each side of the outline's box at which the share is measured."""


@dataclass(frozen=True, eq=False, repr=False)
class Outline(Brief):
    """The outline of a robot seen from above, grown by `margin`, in m in the base's frame.

    corners  the convex outline (n, 2), counter-clockwise
    pieces   convex polygons that together are the outline; none if it is convex
    """

    corners: NDArray[np.float64]
    margin: float = 0.0
    pieces: tuple[NDArray[np.float64], ...] = ()

    @classmethod
    def around(cls, pieces: Sequence[NDArray[np.float64]]) -> Outline:
        """The outline of convex polygons.

        It is convex unless they leave much of their convex outline empty. Polygons that are apart have a
        convex outline too: the shapes between them are missing, for example because a mesh is not found."""
        whole = cls(convex_outline(np.concatenate(pieces)))
        pieces = [piece for piece in pieces if len(piece) > 2]  # a shape without width is a line
        kept = tuple(
            piece
            for index, piece in enumerate(pieces)
            if not any(_contains(other, piece, index > at) for at, other in enumerate(pieces) if at != index)
        )
        if len(kept) < 2:
            return whole
        (left, low), (right, high) = whole.corners.min(axis=0), whole.corners.max(axis=0)
        x, y = np.meshgrid(np.linspace(left, right, _RASTER), np.linspace(low, high, _RASTER))
        points = np.stack([x.ravel(), y.ravel()], axis=1)
        parts = cls(whole.corners, pieces=kept)
        filled = parts.holds(points)
        if filled.sum() >= _SOLID * whole.holds(points).sum():
            return whole
        cells = filled.reshape(x.shape)
        (first, *others), regions = np.argwhere(cells).tolist(), Regions(cells)
        is_whole = all(regions.connect((first[0], first[1]), (row, column)) for row, column in others)
        return parts if is_whole else whole

    @property
    def polygons(self) -> tuple[NDArray[np.float64], ...]:
        """The convex polygons that together are the outline."""
        return self.pieces or (self.corners,)

    def seen_from(self, place: PlanarPose) -> Outline:
        """The same outline in another frame, whose pose in this outline's frame is `place`."""
        if place == PlanarPose():
            return self
        inverse = place.inverse()
        pieces = tuple(inverse.apply(piece) for piece in self.pieces)
        return Outline(inverse.apply(self.corners), self.margin, pieces)

    @classmethod
    def rectangle(cls, rear: float, front: float, right: float, left: float) -> Outline:
        """From x = `rear` to `front` and y = `right` to `left`."""
        return cls(np.array([(rear, right), (front, right), (front, left), (rear, left)]))

    @cached_property
    def _edges(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Outward normals (2, n) of the edges of each polygon, and their distances from the origin."""
        return [edges(polygon, self.margin) for polygon in self.polygons]

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
        return Outline(self.corners, self.margin + margin, self.pieces)

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the points (n, 2) are inside."""
        inside = np.zeros(len(points), dtype=bool)
        for normals, offsets in self._edges:
            inside |= np.all(points @ normals < offsets, axis=1)
        return inside


def edges(
    polygon: NDArray[np.float64], margin: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Outward normals (2, n) of the edges of a convex polygon (n, 2) that is grown by `margin`, and their
    distances from the origin."""
    along = np.roll(polygon, -1, axis=0) - polygon
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    return normals.T, (normals * polygon).sum(axis=1) + margin


def _contains(outer: NDArray[np.float64], inner: NDArray[np.float64], is_first: bool) -> bool:
    """Whether a convex polygon contains another one. Of two equal ones, the first contains the other."""
    normals, offsets = edges(outer)
    beyond = float((inner @ normals - offsets).max())
    return beyond < -1e-9 or (beyond < 1e-9 and is_first)


@dataclass(frozen=True, eq=False)
class RobotShape:
    """The space that a robot takes, as the corners (n, 3) of the box around each of its shapes, in m in the
    frame of its base."""

    boxes: tuple[NDArray[np.float64], ...]

    @property
    def outline(self) -> Outline:
        """Seen from above."""
        return Outline.around([convex_outline(box[:, :2]) for box in self.boxes])

    @property
    def radius(self) -> float:
        """The distance in m from the base's origin to the robot's furthest point seen from above, which it
        needs to turn on the spot."""
        return max(hypot(x, y) for box in self.boxes for x, y, _ in box.tolist())

    @property
    def height(self) -> float:
        """In m along z of the base."""
        heights = np.concatenate(self.boxes)[:, 2]
        return float(heights.max() - heights.min())


def robot_shape(robot: RobotModel, base: str, joints: Mapping[str, float] | None = None) -> RobotShape:
    """The shape of a robot in the frame of the link `base`. Joints that are not given are at zero (rad or m).

    Each collision shape is replaced by the box around it.

    Raises:
        KbotError: the robot has no collision shape.
    """
    corners = [corner for _, corner in corners_of_shapes(robot, base, joints)]
    if not corners:
        raise KbotError(f"robot '{robot.name}' has no <collision>, so its size is unknown")
    return RobotShape(tuple(np.array(corners).reshape(-1, 8, 3)))


def turning_radius(robot: RobotModel, base: str) -> float:
    """The radius in m that the robot needs to turn on the spot, joints at zero. Raises KbotError as
    `robot_shape` does."""
    return robot_shape(robot, base).radius


def outline(robot: RobotModel, base: str) -> Outline:
    """The robot's outline in the frame of the link `base`, joints at zero. Raises KbotError as `robot_shape`
    does."""
    return robot_shape(robot, base).outline


def height(robot: RobotModel, base: str) -> float:
    """The robot's height in m along z of the link `base`, joints at zero; 0 without a collision shape."""
    heights = [z for _, (_, _, z) in corners_of_shapes(robot, base)]
    return max(heights) - min(heights) if heights else 0.0


def corners_of_shapes(
    robot: RobotModel, base: str, joints: Mapping[str, float] | None = None
) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """The eight corners of the box around each collision shape, with its link, in m in the frame of `base`.

    Joints that are not given are at zero (rad or m)."""
    tree = FrameTree(robot)
    for link in robot.links.values():
        for collision in link.collisions:
            reach = bounds(collision.geometry)
            if reach is None:
                continue
            in_base = tree.pose(link.name, base, joints) @ Transform.of(collision.pose)
            for corner in product(*zip(*(v.tolist() for v in reach), strict=True)):
                x, y, z = in_base.apply(corner).tolist()
                yield link.name, (x, y, z)
