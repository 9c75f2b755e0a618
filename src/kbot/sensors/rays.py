"""Casts rays against the world and ignores the robot's own shapes.

Measured for a lidar of 360 beams among 200 walls: `mj_multiRay` takes 418 us a scan, boxes binned by angle 55
us.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.sim.engine.geometry import own_geometries
from kbot.sim.engine.placing import PLANE_GROUP

_TYPE = mujoco.mjtGeom
_SIMPLE = (
    _TYPE.mjGEOM_PLANE, _TYPE.mjGEOM_SPHERE, _TYPE.mjGEOM_CAPSULE,
    _TYPE.mjGEOM_ELLIPSOID, _TYPE.mjGEOM_CYLINDER, _TYPE.mjGEOM_BOX,
)  # fmt: skip


def are_simple(model: mujoco.MjModel, shapes: NDArray[np.intp]) -> bool:
    """Whether these shapes of a model are fully defined by their sizes."""
    known = np.isin(model.geom_type[shapes], [int(kind) for kind in _SIMPLE])
    return bool(known.all() and (model.geom_matid[shapes] < 0).all())


class Surroundings:
    """A separate model with some of a model's shapes, so that rays do not visit the others."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, shapes: NDArray[np.intp]) -> None:
        """`shapes` (n,): the engine's indices of simple shapes."""
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

    def follow(self, data: mujoco.MjData) -> None:
        """Copy the current poses of moving shapes."""
        if len(self._here):
            self._copy(data, self._here, self._there)

    def _copy(self, data: mujoco.MjData, here: NDArray[np.intp], there: NDArray[np.intp]) -> None:
        self.data.geom_xpos[here] = data.geom_xpos[there]
        self.data.geom_xmat[here] = data.geom_xmat[there]


Array = NDArray[np.float64]


class Slabs:
    """Intersects a fan of beams with boxes. It tests only the beams that can hit a box by their angle."""

    def __init__(
        self, centres: Array, axes: Array, halves: Array, first: float, step: float, beams: int
    ) -> None:
        """Boxes have `centres` (n, 3), `axes` (n, 3, 3; columns in the world) and half edges `halves` (n, 3).

        Lengths are in m. The beams start at the angle `first` about the sensor's z and are `step` apart (rad,
        not 0). They span at most one turn.
        """
        self._centres, self._radii = centres, np.sqrt((halves**2).sum(axis=1))
        count = len(centres)
        # first axes of all boxes, then second, then third: products reshape to rows of (3, n)
        self._axes = np.ascontiguousarray(axes.transpose(2, 0, 1)).reshape(3 * count, 3)
        self._offsets = (self._axes.reshape(3, count, 3) * centres).sum(axis=2)
        self._halves = np.ascontiguousarray(halves.T)
        self._first, self._step, self._beams = math.remainder(first, 2.0 * math.pi), step, beams
        self._turn = 2.0 * math.pi / abs(step)
        angles = first + step * np.arange(beams)
        self._cos, self._sin = np.cos(angles), np.sin(angles)
        self._nearest = np.empty(beams)

    def cast(self, place: Array, axes: Array, most: float) -> Array:
        """Distances (beams,) in m from a sensor at `place` (3,) with `axes` (3, 3). inf: no box is hit.

        Boxes beyond `most` may be missed. The next call overwrites the returned array.
        """
        nearest = self._nearest
        nearest.fill(np.inf)
        box, beam = self._pairs(place, axes, most)
        if not len(box):
            return nearest
        offset = (self._axes @ place).reshape(3, -1) - self._offsets
        along = (self._axes @ axes[:, :2]).reshape(3, -1, 2)
        numbers = np.concatenate(
            [along[..., 0], along[..., 1], -self._halves - offset, self._halves - offset]
        ).take(box, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (numbers[:3] * self._cos[beam] + numbers[3:6] * self._sin[beam])
            low, high = numbers[6:9] * inverse, numbers[9:] * inverse
        enters, leaves = np.minimum(low, high).max(axis=0), np.maximum(low, high).min(axis=0)
        # a sensor inside a box sees the far side
        met = np.where(enters >= 0.0, enters, leaves)
        met[~((enters <= leaves) & (leaves >= 0.0))] = np.inf
        np.minimum.at(nearest, beam, met)
        return nearest

    def _pairs(self, place: Array, axes: Array, most: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Pairs of a box and a beam that may intersect."""
        x, y, z = ((self._centres - place) @ axes).T
        away = np.hypot(x, y)
        near = np.flatnonzero((np.abs(z) <= self._radii) & (away <= self._radii + most))
        away, radii = away[near], self._radii[near]
        middle = np.mod((np.arctan2(y[near], x[near]) - self._first) / self._step, self._turn)
        seen = np.where(radii < away, np.arcsin(np.minimum(radii / np.maximum(away, 1e-300), 1.0)), math.pi)
        half = seen / abs(self._step) + 1e-6
        low, high = middle - half, middle + half
        # a box across the first beam is also hit by beams at the other end of the fan, a turn away
        low = np.ceil(np.concatenate([low - self._turn, low, low + self._turn])).astype(np.intp)
        high = np.floor(np.concatenate([high - self._turn, high, high + self._turn])).astype(np.intp)
        np.maximum(low, 0, out=low)
        counts = np.maximum(np.minimum(high, self._beams - 1) - low + 1, 0)
        ends = np.cumsum(counts)
        beam = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts - low, counts)
        return np.repeat(np.concatenate([near, near, near]), counts), beam


_SEEN = np.array([1, 1, 1, 1, 0, 1], dtype=np.uint8)
"""The geometry groups that rays hit: not `PLANE_GROUP`, to which shapes that rays shall miss are moved."""
_MANY_BOXES = 40
"""From this number of boxes on, `Slabs` is faster than the engine, which tests each ray against each box."""
_MOST_COPIED = 2000
"""Most shapes that are copied to a separate model. Copying more takes longer than it saves."""


class Fan(NamedTuple):
    """Rays in the sensor's x-y plane: the angle of the first, and the angle between neighbours (rad)."""

    first: float
    step: float


class Rays:
    """A bundle of rays from one point. What it needs is allocated once."""

    def __init__(self, robot: str, directions: NDArray[np.float64], fan: Fan | None = None) -> None:
        """`directions` (n, 3) are unit vectors in the sensor's axes. Rays ignore the robot called `robot`.

        `fan` is given if the directions are evenly spaced in a plane.
        """
        self._directions, self._robot = directions, robot
        count = len(directions)
        if fan is not None and not 0.0 < abs(fan.step) * (count - 1) <= 2.0 * math.pi + 1e-6:
            fan = None
        self._fan = fan
        self._model: mujoco.MjModel | None = None
        self._world = np.empty((count, 3))
        self._flat = self._world.reshape(-1)
        self._geometry = np.empty(count, dtype=np.int32)
        self._distance = np.empty(count)
        self._bits = self._distance.view(np.uint64)
        self._missed = np.empty(count, dtype=bool)
        self._most, self._most_bits = math.nan, np.uint64(0)

    def cast(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        place: NDArray[np.float64],
        axes: NDArray[np.float64],
        most: float,
    ) -> NDArray[np.float64]:
        """Distances (n,) in m from `place`. inf: nothing is hit within `most`."""
        if model is not self._model:
            self._model = model
            self._look_at(model, data)
        distances = self._distance
        if self._has_others:
            np.dot(self._directions, axes.T, out=self._world)
            self._ask_engine(model, data, place, most)
        else:
            distances.fill(np.inf)
        # the engine's cutoff only saves time: planes are returned beyond it. A missed ray is negative. As
        # unsigned integers, the bits of negative floats exceed those of all positive ones, so that one
        # comparison finds both.
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

    def _look_at(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Choose for each shape how rays are intersected with it."""
        self._own = own_geometries(model, self._robot)
        others = np.setdiff1d(np.flatnonzero(model.geom_group != PLANE_GROUP), self._own)
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
        self._groups[np.setdiff1d(np.arange(model.ngeom), others)] = PLANE_GROUP
        if 0 < len(others) <= _MOST_COPIED and are_simple(model, others):
            self._others = Surroundings(model, data, others)

    def _ask_engine(
        self, model: mujoco.MjModel, data: mujoco.MjData, place: NDArray[np.float64], most: float
    ) -> None:
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
    """Replace distances below `least` by -inf, and those above `most` by +inf (REP 117)."""
    ranges = np.where(distances < least, -np.inf, distances)
    ranges[distances > most] = np.inf
    return ranges
