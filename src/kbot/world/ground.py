"""Computes the height of a world's ground on a grid, and where the ground is not drivable."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.world.footprints import corners, footprint, top
from kbot.world.occupancy import OccupancyGrid
from kbot.world.world import FURTHEST, Body, Box, HeightField, Part, Plane, World

_LEVEL = 1e-9


def is_the_ground(body: Body, part: Part) -> bool:
    """Whether a part is a level plane at z = 0. The page draws it as the grid."""
    if not isinstance(part.shape, Plane):
        return False
    pose = body.pose @ part.pose
    return bool(abs(pose.translation[2]) < _LEVEL and pose.rotation[2, 2] > 1.0 - _LEVEL)


def height_field_triangles(field: HeightField) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) in m and faces (m, 3) of a height field."""
    rows, columns = field.heights.shape
    x = np.linspace(-field.size[0] / 2, field.size[0] / 2, columns)
    y = np.linspace(-field.size[1] / 2, field.size[1] / 2, rows)
    grid_x, grid_y = np.meshgrid(x, y)
    vertices = np.stack([grid_x, grid_y, field.heights], axis=-1).reshape(-1, 3)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    lower = np.stack([corner, corner + 1, corner + columns], axis=1)
    upper = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    return vertices, np.concatenate([lower, upper])


Heights = NDArray[np.float64]

_GAP = 0.02
"""Metres around a point within which a surface counts: a wheel rolls over a narrower gap between tiles."""
STEP = 0.012
"""Highest edge in m that counts as drivable."""
STEEPEST = math.radians(30.0)
"""Steepest slope that counts as drivable."""


def ground_heights(world: World, grid: OccupancyGrid) -> Heights | None:
    """Height in m of the highest ground at the centre of each cell. nan: no ground.

    None if all ground is level at z = 0.
    """
    ground = list(_ground(world))
    if all(isinstance(part.shape, Plane) and _is_floor(pose) for part, pose in ground):
        return None
    heights = np.full((grid.rows, grid.columns), np.nan)
    for part, pose in ground:
        rows, columns = _extent(part, pose, grid)
        if rows.start < rows.stop and columns.start < columns.stop:
            x, y = _middles(grid, rows, columns)
            here = heights[rows, columns]
            np.fmax(here, _surface(part, pose, x, y), out=here)
    return heights


def impassable(heights: Heights, resolution: float) -> NDArray[np.bool_]:
    """Cells at an edge higher than `STEP` or on a slope steeper than `STEEPEST`.

    Cells without ground are not marked.
    """
    most = max(STEP, resolution * math.tan(STEEPEST)) + 1e-9
    blocked = np.zeros(heights.shape, dtype=bool)
    with np.errstate(invalid="ignore"):
        up, right = np.abs(np.diff(heights, axis=0)) > most, np.abs(np.diff(heights, axis=1)) > most
    for edge, low, high in ((up, blocked[:-1], blocked[1:]), (right, blocked[:, :-1], blocked[:, 1:])):
        low |= edge
        high |= edge
    return blocked


class Surfaces:
    """The upper surfaces of a world's parts, found by place. Walls that are planes are left out.

    The boxes around all parts are computed at once, because a hollow mesh has thousands of convex pieces.
    """

    def __init__(self, world: World) -> None:
        self._parts = [(body, part) for body in world.bodies for part in body.parts]
        self._low = np.full((len(self._parts), 2), -np.inf)
        self._high = np.full((len(self._parts), 2), np.inf)
        poses: list[Transform] = []
        around, points, pose_of = [], list[Heights](), list[int]()
        last: tuple[Body, Transform] | None = None
        for index, (body, part) in enumerate(self._parts):
            own = corners(part.shape)
            if own is None:
                continue  # it is infinite
            if last is None or body is not last[0] or part.pose is not last[1]:
                poses.append(body.pose @ part.pose)  # the pieces of a mesh have the same one
                last = body, part.pose
            around.append(index)
            points.append(own)
            pose_of.append(len(poses) - 1)
        if not around:
            return
        counts = [len(own) for own in points]
        which = np.repeat(pose_of, counts)
        rows = np.array([pose.rotation[:2] for pose in poses])[which]
        shifts = np.array([pose.translation[:2] for pose in poses])[which]
        flat = np.einsum("nij,nj->ni", rows, np.concatenate(points)) + shifts
        starts = np.cumsum([0, *counts[:-1]])
        self._low[around] = np.minimum.reduceat(flat, starts)
        self._high[around] = np.maximum.reduceat(flat, starts)

    def at(
        self, x: float, y: float, *, solid: bool = True, within: float = _GAP
    ) -> Iterator[tuple[Body, Part, float]]:
        """The parts at most `within` m from a point, each with its body and the height in m of its surface.

        Without `solid`, these are the parts that are only drawn.
        """
        around_x = x + np.array([[-within, 0.0, within]])
        around_y = y + np.array([[-within], [0.0], [within]])
        place, margin = np.array([x, y]), within + _LEVEL
        near = (self._low <= place + margin).all(axis=1) & (self._high >= place - margin).all(axis=1)
        for index in np.flatnonzero(near).tolist():
            body, part = self._parts[index]
            pose = body.pose @ part.pose
            if part.solid is not solid or (isinstance(part.shape, Plane) and not _is_gentle(pose)):
                continue
            heights = _surface(part, pose, around_x, around_y)
            if not np.isnan(heights).all():
                yield body, part, float(np.nanmax(heights))


def middle_of_ground(world: World, highest: float) -> Iterator[tuple[Body, float, float]]:
    """The parts to drive on whose upper surface is at most at a height in m: the body, and x and y in m of
    the part's middle."""
    for body in world.bodies:
        for part in body.parts:
            pose = body.pose @ part.pose
            is_ground = part.ground or isinstance(part.shape, HeightField)
            if (
                part.solid
                and is_ground
                and not isinstance(part.shape, Plane)
                and top(part.shape, pose) <= highest
            ):
                yield body, float(pose.translation[0]), float(pose.translation[1])


def walls_of_planes(world: World, grid: OccupancyGrid, height: float) -> NDArray[np.bool_]:
    """Cells behind planes that are too steep to be ground, at a height in m."""
    blocked = np.zeros((grid.rows, grid.columns), dtype=bool)
    x, y = _middles(grid, slice(0, grid.rows), slice(0, grid.columns))
    for part, pose in _parts(world):
        if isinstance(part.shape, Plane) and not _is_gentle(pose):
            nx, ny, nz = pose.rotation[:, 2].tolist()
            px, py, pz = pose.translation.tolist()
            blocked |= nx * (x - px) + ny * (y - py) + nz * (height - pz) < 0.0
    return blocked


def _parts(world: World) -> Iterator[tuple[Part, Transform]]:
    for body in world.bodies:
        for part in body.parts:
            if part.solid:
                yield part, body.pose @ part.pose


def _ground(world: World) -> Iterator[tuple[Part, Transform]]:
    """The parts to drive on: gentle planes, height fields, and parts marked as ground."""
    for part, pose in _parts(world):
        if isinstance(part.shape, Plane):
            if _is_gentle(pose):
                yield part, pose
        elif part.ground or isinstance(part.shape, HeightField):
            yield part, pose


def _is_gentle(pose: Transform) -> bool:
    return bool(pose.rotation[2, 2] > math.cos(STEEPEST))


def _is_floor(pose: Transform) -> bool:
    return bool(abs(pose.translation[2]) < 1e-9 and pose.rotation[2, 2] > 1.0 - 1e-12)


def _middles(grid: OccupancyGrid, rows: slice, columns: slice) -> tuple[Heights, Heights]:
    """x (1, columns) and y (rows, 1) of the cells' centres in m. A world's grid is never rotated."""
    x = (np.arange(columns.start, columns.stop) + 0.5) * grid.resolution + grid.origin.x
    y = (np.arange(rows.start, rows.stop) + 0.5) * grid.resolution + grid.origin.y
    return x[None, :], y[:, None]


def _extent(part: Part, pose: Transform, grid: OccupancyGrid) -> tuple[slice, slice]:
    """The rows and columns that a part may cover."""
    if isinstance(part.shape, HeightField):
        half = np.array(part.shape.size) / 2.0
        corners = np.array([(sx * half[0], sy * half[1], 0.0) for sx in (-1, 1) for sy in (-1, 1)])
        outline = pose.apply(corners)[:, :2]
    else:
        found = footprint(part.shape, pose, -FURTHEST, FURTHEST)
        if found is None:
            return slice(0, grid.rows), slice(0, grid.columns)
        outline = found
    local = (outline - (grid.origin.x, grid.origin.y)) / grid.resolution
    low, high = np.floor(local.min(axis=0)).astype(int), np.ceil(local.max(axis=0)).astype(int)
    return (
        slice(max(0, int(low[1])), min(grid.rows, int(high[1]))),
        slice(max(0, int(low[0])), min(grid.columns, int(high[0]))),
    )


def _surface(part: Part, pose: Transform, x: Heights, y: Heights) -> Heights:
    """Height of a part's upper surface at points. nan: outside the part."""
    shape = part.shape
    if isinstance(shape, HeightField):
        return _height_field(shape, pose, x, y)
    if isinstance(shape, Plane):
        return _face(pose.translation, pose.rotation[:, 2], x, y)
    outline = footprint(shape, pose, -FURTHEST, FURTHEST)
    inside = np.zeros((y.size, x.size), dtype=bool)
    if outline is not None and len(outline) > 2:
        inside[:] = True
        for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            inside &= (end[0] - start[0]) * (y - start[1]) - (end[1] - start[1]) * (x - start[0]) >= 0.0
    highest = top(shape, pose)
    if not isinstance(shape, Box):
        return np.where(inside, highest, np.nan)
    # the face whose normal is closest to upwards
    axis = int(np.argmax(np.abs(pose.rotation[2])))
    normal = pose.rotation[:, axis] * math.copysign(1.0, pose.rotation[2, axis])
    face = _face(pose.translation + normal * shape.size[axis] / 2.0, normal, x, y)
    return np.where(inside, np.minimum(face, highest), np.nan)


def _face(point: Heights, normal: Heights, x: Heights, y: Heights) -> Heights:
    nx, ny, nz = normal.tolist()
    px, py, pz = point.tolist()
    face: Heights = pz - (nx * (x - px) + ny * (y - py)) / nz
    return face


def _height_field(field: HeightField, pose: Transform, x: Heights, y: Heights) -> Heights:
    """Bilinear interpolation in a height field, which is assumed to be upright."""
    x0, y0, z0 = pose.translation.tolist()
    u, v = PlanarPose(x0, y0, pose.yaw).local(x, y)
    rows, columns = field.heights.shape
    u = (u / field.size[0] + 0.5) * (columns - 1)
    v = (v / field.size[1] + 0.5) * (rows - 1)
    outside = (u < 0.0) | (u > columns - 1) | (v < 0.0) | (v > rows - 1)
    left = np.clip(np.floor(u), 0, max(columns - 2, 0)).astype(np.intp)
    low = np.clip(np.floor(v), 0, max(rows - 2, 0)).astype(np.intp)
    right, high = np.minimum(left + 1, columns - 1), np.minimum(low + 1, rows - 1)
    a, b, h = u - left, v - low, field.heights
    near = (1.0 - a) * h[low, left] + a * h[low, right]
    far = (1.0 - a) * h[high, left] + a * h[high, right]
    return np.where(outside, np.nan, (1.0 - b) * near + b * far + z0)
