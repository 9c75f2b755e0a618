"""What stands around a robot, as rays go through it quickest: in one body, the robot left out."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

_TYPE = mujoco.mjtGeom
_SIMPLE = (
    _TYPE.mjGEOM_PLANE, _TYPE.mjGEOM_SPHERE, _TYPE.mjGEOM_CAPSULE,
    _TYPE.mjGEOM_ELLIPSOID, _TYPE.mjGEOM_CYLINDER, _TYPE.mjGEOM_BOX,
)  # fmt: skip


def are_simple(model: Any, shapes: NDArray[np.intp]) -> bool:
    """Whether these shapes of a model can be copied by their sizes alone."""
    known = np.isin(model.geom_type[shapes], [int(kind) for kind in _SIMPLE])
    return bool(known.all() and (model.geom_matid[shapes] < 0).all())


class Surroundings:
    """Some of the shapes of a model in a model of their own."""

    def __init__(self, model: Any, data: Any, shapes: NDArray[np.intp]) -> None:
        """`shapes` (n,): the engine's indices of simple ones."""
        spec = mujoco.MjSpec()
        spec.memory = 1_000_000 + 200 * len(shapes)
        for shape in shapes.tolist():
            spec.worldbody.add_geom(
                type=int(model.geom_type[shape]), size=model.geom_size[shape], rgba=model.geom_rgba[shape]
            )
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._shapes = shapes
        moving = model.body_weldid[model.geom_bodyid[shapes]] != 0
        self._here, self._there = np.flatnonzero(moving), shapes[moving]
        self._copy(data, np.arange(len(shapes)), shapes)

    def follow(self, data: Any) -> None:
        """Put what can move where it is now."""
        if len(self._here):
            self._copy(data, self._here, self._there)

    def _copy(self, data: Any, here: NDArray[np.intp], there: NDArray[np.intp]) -> None:
        self.data.geom_xpos[here] = data.geom_xpos[there]
        self.data.geom_xmat[here] = data.geom_xmat[there]
