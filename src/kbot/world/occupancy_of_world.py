"""Converts a world to an occupancy grid of the obstacles for a robot of a given height."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.text import KbotError
from kbot.world.footprints import Points, footprint
from kbot.world.ground import ground_heights, impassable, walls_of_planes
from kbot.world.occupancy import FREE, MOST_CELLS, OCCUPIED, OccupancyGrid
from kbot.world.world import FURTHEST, HeightField, Plane, World

RESOLUTION = 0.02
"""Metres of a cell's edge."""
HEIGHTS = (0.01, 0.25)
"""Metres. A robot drives over lower objects and under higher ones."""
MARGIN = 0.5
"""Metres of free ground around all objects of a world."""
_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def world_grid(
    world: World,
    resolution: float = RESOLUTION,
    heights: tuple[float, float] = HEIGHTS,
    around: Iterable[tuple[float, float]] = ((0.0, 0.0),),
    margin: float = MARGIN,
    most_cells: int | None = None,
) -> OccupancyGrid:
    """The world's solid objects between two heights (m) as a grid. No cell is unknown.

    A cell is occupied if any part of an object is in it, so walls thinner than a cell are kept. The heights
    count from the ground below an object. Ground (including ramps, stairs and height fields) is free, except
    for slopes that are too steep and edges that are too high for wheels. Movable objects are at their start
    poses.

    The grid extends `margin` m beyond all objects and beyond the points `around`. With `most_cells`, the
    cells of a large world become wider than `resolution`, so that the grid has at most that many.

    Raises:
        KbotError: the resolution or the heights are not valid, or the world is too large for the resolution.
    """
    low, high = heights
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise KbotError(f"the resolution of a grid must be above 0 m, not {resolution}")
    if not low < high:
        raise KbotError(f"the lower of the two heights must come first, not {low} to {high} m")
    near = [body for body in world.bodies if np.abs(body.pose.translation).max() <= FURTHEST]
    world = dataclasses.replace(world, bodies=tuple(near))
    things = [
        (part.shape, body.pose @ part.pose)
        for body in world.bodies
        for part in body.parts
        if part.solid and not part.ground
    ]
    extents = [
        outline for thing in things if (outline := footprint(*thing, low, FURTHEST)) is not None
    ] + _extents_of_ground(world)
    corners = np.concatenate([*extents, np.array(list(around), dtype=np.float64).reshape(-1, 2)])
    grid = _free_grid(corners, resolution, margin, most_cells, world.name)
    ground = ground_heights(world, grid)
    if ground is not None:
        grid.cells[impassable(ground, grid.resolution)] = OCCUPIED
    grid.cells[walls_of_planes(world, grid, low)] = OCCUPIED
    for shape, pose in things:
        base = 0.0 if ground is None else _ground_beneath(grid, ground, pose)
        outline = footprint(shape, pose, base + low, base + high)
        if outline is not None:
            _fill(grid, outline)
    return grid


def _free_grid(
    corners: Points, resolution: float, margin: float, most_cells: int | None, name: str
) -> OccupancyGrid:
    """A grid of free cells that extends `margin` m beyond all corners (n, 2).

    Raises:
        KbotError: the grid would have too many cells.
    """
    if not len(corners):
        corners = np.zeros((1, 2))
    if most_cells is not None:
        area = float(np.prod(np.ptp(corners, axis=0) + 2.0 * margin))
        resolution *= max(1.0, math.ceil(math.sqrt(area / most_cells) / resolution))
    # cells start at whole multiples of the resolution, so that the cells of all maps of a world coincide
    first = np.floor((corners.min(axis=0) - margin) / resolution + 1e-9)
    last = np.ceil((corners.max(axis=0) + margin) / resolution - 1e-9)
    across, along = np.maximum(last - first, 1).tolist()
    if not across * along <= MOST_CELLS:
        wide = f"{across * resolution:.4g} x {along * resolution:.4g} m"
        raise KbotError(f"world '{name}' covers {wide}, too much for cells of {resolution} m")
    x, y = (first * resolution).tolist()
    cells = np.full((int(along), int(across)), FREE, dtype=np.int8)
    return OccupancyGrid(cells, resolution, PlanarPose(x, y))


def _extents_of_ground(world: World) -> list[Points]:
    """Corners of ground that is finite: height fields, ramps, stairs."""
    found = []
    for body in world.bodies:
        for part in body.parts:
            pose = body.pose @ part.pose
            if not part.solid or isinstance(part.shape, Plane):
                continue
            if isinstance(part.shape, HeightField):
                x, y = part.shape.size
                found.append(
                    pose.apply(np.array([(sx * x / 2, sy * y / 2, 0.0) for sx, sy in _CORNERS]))[:, :2]
                )
            elif part.ground and (outline := footprint(part.shape, pose, -FURTHEST, FURTHEST)) is not None:
                found.append(outline)
    return found


def _ground_beneath(grid: OccupancyGrid, ground: NDArray[np.float64], pose: Transform) -> float:
    """Height of the ground below an object. 0 without ground."""
    row, column = grid.cell(*pose.translation[:2].tolist())
    height = float(ground[row, column]) if grid.contains(row, column) else math.nan
    return height if math.isfinite(height) else 0.0


def _fill(grid: OccupancyGrid, outline: Points) -> None:
    """Mark every cell that a convex outline overlaps.

    By the separating axis theorem, a cell overlaps if no edge of the outline separates the two. The range of
    cells that are tested takes care of the cells' own axes.
    """
    step = grid.resolution
    local = (outline - (grid.origin.x, grid.origin.y)) / step
    low = np.maximum(np.floor(local.min(axis=0) + 1e-6), 0).astype(int)
    high = np.minimum(np.ceil(local.max(axis=0) - 1e-6), (grid.columns, grid.rows)).astype(int)
    x = np.arange(low[0], high[0])[None, :] + 0.5
    y = np.arange(low[1], high[1])[:, None] + 0.5
    apart = np.zeros((y.size, x.size), dtype=bool)
    for start, end in zip(local, np.roll(local, -1, axis=0), strict=True):
        nx, ny = end[1] - start[1], start[0] - end[0]
        reach = (abs(nx) + abs(ny)) / 2
        apart |= nx * (x - start[0]) + ny * (y - start[1]) - reach >= -1e-6 * reach
    grid.cells[low[1] : high[1], low[0] : high[0]][~apart] = OCCUPIED
