"""Records the world around a robot: added and removed objects, and their true poses."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kbot.messages.types import (
    WORLD,
    Header,
    Quaternion,
    String,
    TFMessage,
    Transform,
    TransformStamped,
    Vector3,
)
from kbot.record.feed import Packet

if TYPE_CHECKING:
    import mujoco

    from kbot.sim import Simulation

WORLD_TOPIC = "/kbot/world"
"""How the present objects and robots differ from the world that was built, as JSON in a String, after each
change."""
POSES_TOPIC = "/kbot/poses"
"""Transforms from `world` to the robot's root, to each movable object, and to `robot/link` of all other
robots."""
RATE = 50.0
"""Hz of poses."""
FULL_EVERY = 50
"""One message in 50, so one per second, contains all poses. The others contain those that changed."""
STILL = 1e-6
"""Smallest change of a position in metres, or of an entry of the rotation matrix, that is a motion."""
_NEVER = np.inf
"""Marks a pose that must be published again: it differs from any real pose."""


Changes = list[tuple[str, dict[str, object]]]


class WorldRecorder:
    """Records changes and poses while the simulation runs, without influence on the run."""

    def __init__(self, simulation: Simulation, write: Callable[[Packet], None]) -> None:
        self._simulation, self._write = simulation, write
        self._model: mujoco.MjModel | None = None
        self._names: tuple[str, ...] = ()
        self._bodies: NDArray[np.intp] = np.empty(0, np.intp)
        """Body indices of the physics engine, in the order of `_names`."""
        self._published: NDArray[np.float64] = np.empty((0, 12))
        """The last published position (3) and rotation matrix (9) of each body."""
        self._count = 0
        self._seen: Changes | None = None
        self.record_changes()
        self._publish_poses()
        self._timer = simulation.clock.every(RATE, self._publish_poses)

    def record_changes(self) -> None:
        """Record new changes of the world. Call this when objects may have been added or removed."""
        if self._simulation.journal.changes == self._seen:
            return
        self._seen = list(self._simulation.journal.changes)
        text = json.dumps([{"do": what, **numbers} for what, numbers in self._seen])
        self._publish(WORLD_TOPIC, String(text))
        self._published[:] = _NEVER

    def close(self) -> None:
        self._timer.cancel()

    def _publish(self, topic: str, message: object) -> None:
        self._write(Packet(topic, message, self._simulation.clock.nanoseconds))

    def _publish_poses(self) -> None:
        """Publish the poses that changed. Vectorised, because it runs every control period and most objects
        do not move."""
        model, data = self._simulation.engine.current()
        if model is not self._model:
            bodies = _bodies(self._simulation)
            self._model, self._names = model, tuple(bodies)
            self._bodies = np.array(list(bodies.values()), np.intp)
            self._published = np.full((len(bodies), 12), _NEVER)
        if self._count % FULL_EVERY == 0:
            self._published[:] = _NEVER
        self._count += 1
        now = np.concatenate((data.xpos[self._bodies], data.xmat[self._bodies]), axis=1)
        moved = np.flatnonzero(np.abs(now - self._published).max(axis=1) > STILL)
        if not len(moved):
            return
        self._published[moved] = now[moved]
        header = Header(self._simulation.clock.stamp, WORLD)
        transforms = []
        for index in moved.tolist():
            w, x, y, z = data.xquat[self._bodies[index]].tolist()
            place = Vector3(*now[index, :3].tolist())
            transforms.append(
                TransformStamped(header, self._names[index], Transform(place, Quaternion(x, y, z, w)))
            )
        self._publish(POSES_TOPIC, TFMessage(tuple(transforms)))


def _bodies(simulation: Simulation) -> dict[str, int]:
    """Body indices of the first robot's root, of movable objects, and of the links of other robots."""
    from kbot.sim.engine.world_builder import (
        moving_bodies,
    )  # imported lazily: reading recordings needs no physics engine

    model, _ = simulation.engine.current()
    first, *others = simulation.robots.values()
    root = first.robot.root
    bodies = {root: first.body.index(root), **moving_bodies(model, simulation.world)}
    for robot in others:
        bodies.update({f"{robot.name}/{link}": robot.body.index(link) for link in robot.body.links})
    return bodies
