"""Distances along rays to what stands in the world, the robot's own shapes left out."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.sensors.sensor import own_geometries

_HIDDEN = 5
_SEEN = np.array([1, 1, 1, 1, 1, 0], dtype=np.uint8)
"""Groups of geometries that rays meet."""


class Rays:
    """A bundle of rays from one point; what they need is made once."""

    def __init__(self, robot: str, directions: NDArray[np.float64]) -> None:
        """`directions` (n, 3), of length 1, in the sensor's axes; the robot of this name is not seen."""
        self._directions, self._robot = directions, robot
        self._model: Any = None
        count = len(directions)
        self._world = np.empty((count, 3))
        self._flat = self._world.reshape(-1)
        self._geometry = np.empty(count, dtype=np.int32)
        self._distance = np.empty(count)

    def cast(
        self,
        model: Any,  # noqa: ANN401
        data: Any,  # noqa: ANN401
        place: NDArray[np.float64],
        axes: NDArray[np.float64],
        most: float,
    ) -> NDArray[np.float64]:
        """Distances (n,) in m from `place`, inf where nothing is met within `most`."""
        if model is not self._model:
            self._model, self._own = model, own_geometries(model, self._robot)
        np.matmul(self._directions, axes.T, out=self._world)
        group = model.geom_group
        kept = group[self._own]
        group[self._own] = _HIDDEN
        try:
            # the engine's cutoff may let far planes through, so it is only a help
            mujoco.mj_multiRay(
                model, data, place, self._flat, _SEEN, True, -1,
                self._geometry, self._distance, None, len(self._distance), most,
            )  # fmt: skip
        finally:
            group[self._own] = kept
        missed = (self._geometry < 0) | (self._distance < 0.0) | (self._distance > most)
        return np.where(missed, np.inf, self._distance)


def within(distances: NDArray[np.float64], least: float, most: float) -> NDArray[np.float64]:
    """-inf where something is nearer than `least`, +inf where it is beyond `most` (REP 117)."""
    return np.where(distances < least, -np.inf, np.where(distances > most, np.inf, distances))
