"""Measures how high a robot must be placed: the lowest point of its shapes and the terrain below it."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

_TYPE = mujoco.mjtGeom
TERRAIN_GROUP = 5
"""The engine's group of height fields."""

_AROUND = (-0.3, -0.15, 0.0, 0.15, 0.3)
"""Offsets in m at which terrain is sampled around a robot's centre."""
_SKY = 1e4
"""Height in m from which rays are cast down: above any terrain."""


def lowest_point(model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int]) -> float | None:
    """Height in m of the lowest point of the geometries that can collide.

    None if none of them can. The engine's frames must be up to date.
    """
    heights = [
        float(data.geom_xpos[geom][2]) - _reach_down(model, data, geom)
        for geom in geoms
        if model.geom_contype[geom] or model.geom_conaffinity[geom]
    ]
    return min(heights, default=None)


def terrain_height(model: mujoco.MjModel, data: mujoco.MjData, x: float, y: float) -> float | None:
    """Height in m of the highest point of a height field within 0.3 m of x, y. None without one."""
    groups = np.zeros(6, dtype=np.uint8)
    groups[TERRAIN_GROUP] = 1
    hit, heights = np.zeros(1, dtype=np.int32), []
    for dx in _AROUND:
        for dy in _AROUND:
            above = np.array([x + dx, y + dy, _SKY])
            down = mujoco.mj_ray(model, data, above, np.array([0.0, 0.0, -1.0]), groups, 1, -1, hit)
            if down >= 0.0:
                heights.append(_SKY - down)
    return max(heights, default=None)


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
