"""Puts a robot on the ground: as high as its lowest point demands."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np

_TYPE = mujoco.mjtGeom


def lowest_point(model: Any, data: Any, geoms: Iterable[int]) -> float | None:  # noqa: ANN401
    """Height in m of the lowest touching point of some geometries.

    None when none of them touches. The engine's frames must be up to date.
    """
    heights = [
        float(data.geom_xpos[geom][2]) - _reach_down(model, data, geom)
        for geom in geoms
        if model.geom_contype[geom] or model.geom_conaffinity[geom]
    ]
    return min(heights, default=None)


def _reach_down(model: Any, data: Any, geom: int) -> float:  # noqa: ANN401
    """How far below its own origin a geometry reaches."""
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
