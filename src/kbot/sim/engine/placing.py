"""Places robots: their lowest point, the ground below them, and places around an occupied one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import mujoco
import numpy as np

_TYPE = mujoco.mjtGeom
TERRAIN_GROUP = 5
"""The engine's group of height fields."""
MESH_GROUP = 3
"""The engine's group of static meshes, which may be a floor."""
PLANE_GROUP = 4
"""The engine's group of shapes that only planes touch. Rays of sensors do not hit this group."""

_AROUND = (-0.3, -0.15, 0.0, 0.15, 0.3)
"""Offsets in m at which terrain is sampled around a robot's centre."""
_STEP = 0.1
"""Distance in m between the places that are tried around an occupied one."""
_REACH = 5.0
"""Distance in m to the furthest of them. The 7650 places take seconds in a large world."""
_SKY = 1e4
"""Height in m from which rays are cast down: above any terrain."""
_FLOOR = 0.1
"""Height in m from which rays are cast down on meshes. A floor that is a mesh is a little above 0."""


def places_around() -> Iterator[tuple[float, float]]:
    """Offsets (x, y) in m of places around an occupied one, the nearest first."""
    for ring in range(1, round(_REACH / _STEP) + 1):
        count = 6 * ring  # about one per step
        for index in range(count):
            angle = 2.0 * math.pi * index / count
            yield ring * _STEP * math.cos(angle), ring * _STEP * math.sin(angle)


def lowest_point(model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int]) -> float | None:
    """Height in m of the lowest point of the geometries that can collide.

    None if none of them can. The engine's frames must be up to date.
    """
    heights = [
        bottom(model, data, geom)
        for geom in geoms
        if model.geom_contype[geom] or model.geom_conaffinity[geom]
    ]
    return min(heights, default=None)


def bottom(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Height in m of the lowest point of a geometry. The engine's frames must be up to date."""
    return float(data.geom_xpos[geom][2]) - _reach_down(model, data, geom)


def ground_height(model: mujoco.MjModel, data: mujoco.MjData, x: float, y: float) -> float:
    """Height in m of the ground within 0.3 m of x, y: the highest point of a height field, or of a mesh that
    is a floor. 0 without one."""
    terrain = _heights(model, data, x, y, TERRAIN_GROUP, _SKY)
    if terrain:
        return max(terrain)
    floor = _heights(model, data, x, y, MESH_GROUP, _FLOOR)
    return max(0.0, *floor) if len(floor) == len(_AROUND) ** 2 else 0.0


def _heights(
    model: mujoco.MjModel, data: mujoco.MjData, x: float, y: float, group: int, above: float
) -> list[float]:
    """Heights in m at which rays from the height `above`, cast down around x, y, hit shapes of a group."""
    groups = np.zeros(6, dtype=np.uint8)
    groups[group] = 1
    hit, heights = np.zeros(1, dtype=np.int32), []
    for dx in _AROUND:
        for dy in _AROUND:
            start = np.array([x + dx, y + dy, above])
            down = mujoco.mj_ray(model, data, start, np.array([0.0, 0.0, -1.0]), groups, 1, -1, hit)
            if down >= 0.0:
                heights.append(above - down)
    return heights


def _reach_down(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """How far a geometry reaches below its own origin, in m."""
    rotation = data.geom_xmat[geom].reshape(3, 3)
    down = np.abs(rotation[2])
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == _TYPE.mjGEOM_SPHERE:
        return float(size[0])
    if kind == _TYPE.mjGEOM_CAPSULE:
        return float(size[0] + size[1] * down[2])
    if kind == _TYPE.mjGEOM_CYLINDER:
        return float(size[0] * np.hypot(down[0], down[1]) + size[1] * down[2])
    if kind == _TYPE.mjGEOM_BOX:
        return float(down @ size)
    if kind == _TYPE.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        return -float((model.mesh_vert[start : start + count] @ rotation[2]).min())
    return 0.0
