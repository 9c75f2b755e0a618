"""Distances along rays to what stands in the world, the robot's own shapes left out."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.sensors.sensor import own_geometries
from kbot.sensors.slabs import Slabs
from kbot.sensors.surroundings import Surroundings, are_simple

_HIDDEN = 4
_SEEN = np.array([1, 1, 1, 1, 0, 1], dtype=np.uint8)
"""Groups of geometries that rays meet."""
_MANY_BOXES = 40
"""From so many on the engine, which holds each ray against each of them, is slower."""
_MOST_COPIED = 2000
"""Shapes in a model of their own, which is not made for nothing."""


class Fan(NamedTuple):
    """Rays in the sensor's x-y plane: the angle of the first, and between two (rad)."""

    first: float
    step: float


class Rays:
    """A bundle of rays from one point; what they need is made once."""

    def __init__(self, robot: str, directions: NDArray[np.float64], fan: Fan | None = None) -> None:
        """`directions` (n, 3), of length 1, in the sensor's axes; the robot of this name is not seen. `fan`
        says that they are spread evenly in a plane."""
        self._directions, self._robot = directions, robot
        count = len(directions)
        if fan is not None and not 0.0 < abs(fan.step) * (count - 1) <= 2.0 * math.pi + 1e-6:
            fan = None
        self._fan = fan
        self._model: Any = None
        self._world = np.empty((count, 3))
        self._flat = self._world.reshape(-1)
        self._geometry = np.empty(count, dtype=np.int32)
        self._distance = np.empty(count)
        self._bits = self._distance.view(np.uint64)
        self._missed = np.empty(count, dtype=bool)
        self._most, self._most_bits = math.nan, np.uint64(0)

    def cast(
        self,
        model: Any,
        data: Any,
        place: NDArray[np.float64],
        axes: NDArray[np.float64],
        most: float,
    ) -> NDArray[np.float64]:
        """Distances (n,) in m from `place`, inf where nothing is met within `most`."""
        if model is not self._model:
            self._model = model
            self._look_at(model, data)
        distances = self._distance
        if self._has_others:
            np.dot(self._directions, axes.T, out=self._world)
            self._ask_engine(model, data, place, most)
        else:
            distances.fill(np.inf)
        # the engine's cutoff may let far planes through, so it is only a help; what is missed is negative,
        # and the bits of negative numbers stand for more than those of any others
        if most != self._most:
            self._most, self._most_bits = most, np.float64(most).view(np.uint64)
        np.greater(self._bits, self._most_bits, out=self._missed)
        found = distances.copy()
        np.copyto(found, math.inf, where=self._missed)
        if self._slabs is not None:
            boxes = self._slabs.cast(place, axes, most)
            boxes[boxes > most] = np.inf
            np.minimum(found, boxes, out=found)
        return found

    def _look_at(self, model: Any, data: Any) -> None:
        """Sort what is around by how it is met best."""
        self._own = own_geometries(model, self._robot)
        others = np.setdiff1d(np.arange(model.ngeom), self._own)
        self._slabs = None
        if self._fan is not None:
            at_rest = model.body_weldid[model.geom_bodyid[others]] == 0
            boxes = others[at_rest & (model.geom_type[others] == mujoco.mjtGeom.mjGEOM_BOX)]
            boxes = boxes[model.geom_rgba[boxes, 3] > 0.0]
            if len(boxes) >= _MANY_BOXES:
                axes = data.geom_xmat[boxes].reshape(-1, 3, 3)
                place = data.geom_xpos[boxes].copy()
                halves, beams = model.geom_size[boxes], len(self._directions)
                self._slabs = Slabs(place, axes, halves, *self._fan, beams)
                others = np.setdiff1d(others, boxes)
        self._has_others = len(others) > 0
        self._others: Surroundings | None = None
        self._groups = model.geom_group.copy()
        self._groups[np.setdiff1d(np.arange(model.ngeom), others)] = _HIDDEN
        if 0 < len(others) <= _MOST_COPIED and are_simple(model, others):
            self._others = Surroundings(model, data, others)

    def _ask_engine(self, model: Any, data: Any, place: NDArray[np.float64], most: float) -> None:
        count = len(self._distance)
        if self._others is not None:
            self._others.follow(data)
            around = self._others
            mujoco.mj_multiRay(
                around.model, around.data, place, self._flat, None, True, -1,
                self._geometry, self._distance, None, count, most,
            )  # fmt: skip
            return
        kept = model.geom_group.copy()
        model.geom_group[:] = self._groups
        try:
            mujoco.mj_multiRay(
                model, data, place, self._flat, _SEEN, True, -1,
                self._geometry, self._distance, None, count, most,
            )  # fmt: skip
        finally:
            model.geom_group[:] = kept


def within(distances: NDArray[np.float64], least: float, most: float) -> NDArray[np.float64]:
    """-inf where something is nearer than `least`, +inf where it is beyond `most` (REP 117)."""
    ranges = np.where(distances < least, -np.inf, distances)
    ranges[distances > most] = np.inf
    return ranges
