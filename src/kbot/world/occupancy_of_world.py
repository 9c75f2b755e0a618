"""Converts a world to an occupancy grid: the obstacles of a robot of a given height."""

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
HEIGHTS = (0.01, 0.25)
"""What is lower is driven over, what is higher is driven under; metres."""
MARGIN = 0.5
"""Free ground around all that stands in a world."""
_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def world_grid(
    world: World,
    resolution: float = RESOLUTION,
    heights: tuple[float, float] = HEIGHTS,
    around: Iterable[tuple[float, float]] = ((0.0, 0.0),),
    margin: float = MARGIN,
    most_cells: int | None = None,
) -> OccupancyGrid:
    """The world's solid things between two heights (m) as a grid; nothing in it is unknown.

    A cell is occupied as soon as something reaches into it, so a wall thinner than a cell is not lost. The
    heights count from the ground beneath a thing. What is driven on (ground, ramps, stairs, height fields) is
    free, but for slopes too steep and edges too high for wheels. The grid reaches `margin` m beyond every
    thing and beyond the points `around`; things that can move stand where they start. With `most_cells` the
    cells of a large world are wider than `resolution`, so that there are no more of them.

    Raises:
        KbotError: a resolution that is none, heights out of order, or a world too large for it.
    """
    low, high = heights
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise KbotError(f"a grid's resolution is a length above 0 m, not {resolution}")
    if not low < high:
        raise KbotError(f"the heights to map go up, unlike {low} to {high} m")
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
    """A grid that reaches `margin` m beyond all corners (n, 2), each of its cells free.

    Raises:
        KbotError: there would be too many cells.
    """
    if not len(corners):
        corners = np.zeros((1, 2))
    if most_cells is not None:
        area = float(np.prod(np.ptp(corners, axis=0) + 2.0 * margin))
        resolution *= max(1.0, math.ceil(math.sqrt(area / most_cells) / resolution))
    # cells lie on whole multiples of the resolution, so that maps of one world lie on each other
    first = np.floor((corners.min(axis=0) - margin) / resolution + 1e-9)
    last = np.ceil((corners.max(axis=0) + margin) / resolution - 1e-9)
    across, along = np.maximum(last - first, 1).tolist()
    if not across * along <= MOST_CELLS:
        wide = f"{across * resolution:.4g} x {along * resolution:.4g} m"
        raise KbotError(f"world '{name}' spreads over {wide}: too much for cells of {resolution} m")
    x, y = (first * resolution).tolist()
    cells = np.full((int(along), int(across)), FREE, dtype=np.int8)
    return OccupancyGrid(cells, resolution, PlanarPose(x, y))


def _extents_of_ground(world: World) -> list[Points]:
    """Corners of ground that has an end and is not of one height: height fields, ramps, stairs."""
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
    """Height of the ground where a thing stands; 0 where there is none."""
    row, column = grid.cell(*pose.translation[:2].tolist())
    height = float(ground[row, column]) if grid.contains(row, column) else math.nan
    return height if math.isfinite(height) else 0.0


def _fill(grid: OccupancyGrid, outline: Points) -> None:
    """Mark every cell that a convex outline reaches into: no edge of it parts the two (the separating
    axis theorem; the axes of the cells are seen to by the range of cells looked at)."""
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
