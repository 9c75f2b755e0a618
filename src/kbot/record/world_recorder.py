"""Records the world around a robot: its objects as they change, and their true poses."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kbot.messages.types import (
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
"""What came and went since the world was built, as JSON in a String, each time that something did."""
POSES_TOPIC = "/kbot/poses"
"""`world` to the robot's root, to each thing that can move, and to `robot/link` of every other robot."""
WORLD_FRAME = "world"
RATE = 50.0
WHOLE_EVERY = 50
"""Of so many messages one tells of everything, the others of what moved since."""
STILL = 1e-6
"""Metres, or parts of a turn's matrix, below which nothing moved."""
_NEVER = np.inf
"""Where nothing stands: what was told of last."""


class WorldRecorder:
    """Writes them down as time passes; what is written does not change the run."""

    def __init__(self, simulation: Simulation, write: Callable[[Packet], None]) -> None:
        self._simulation, self._write = simulation, write
        self._model: mujoco.MjModel | None = None
        self._names: tuple[str, ...] = ()
        self._bodies: NDArray[np.intp] = np.empty(0, np.intp)
        """The engine's indices of what is told of, by the order of its names."""
        self._told: NDArray[np.float64] = np.empty((0, 12))
        """Place (3) and axes (9) of each, as they were told last."""
        self._count, self._seen = 0, -1
        self.look()
        self._tell_poses()
        self._timer = simulation.clock.every(RATE, self._tell_poses)

    def look(self) -> None:
        """To be called when something may have come or gone."""
        if len(self._simulation.journal.changes) == self._seen:
            return
        self._seen = len(self._simulation.journal.changes)
        text = json.dumps([{"do": what, **numbers} for what, numbers in self._simulation.journal.changes])
        self._say(WORLD_TOPIC, String(text))
        self._told[:] = _NEVER

    def close(self) -> None:
        self._timer.cancel()

    def _say(self, topic: str, message: object) -> None:
        self._write(Packet(topic, message, self._simulation.clock.nanoseconds))

    def _tell_poses(self) -> None:
        """All at once by numpy, for it is done every control period and most things stand still."""
        model, data = self._simulation.engine.current()
        if model is not self._model:
            bodies = _bodies(self._simulation)
            self._model, self._names = model, tuple(bodies)
            self._bodies = np.array(list(bodies.values()), np.intp)
            self._told = np.full((len(bodies), 12), _NEVER)
        if self._count % WHOLE_EVERY == 0:
            self._told[:] = _NEVER
        self._count += 1
        now = np.concatenate((data.xpos[self._bodies], data.xmat[self._bodies]), axis=1)
        moved = np.flatnonzero(np.abs(now - self._told).max(axis=1) > STILL)
        if not len(moved):
            return
        self._told[moved] = now[moved]
        header = Header(self._simulation.clock.stamp, WORLD_FRAME)
        transforms = []
        for index in moved.tolist():
            w, x, y, z = data.xquat[self._bodies[index]].tolist()
            place = Vector3(*now[index, :3].tolist())
            transforms.append(
                TransformStamped(header, self._names[index], Transform(place, Quaternion(x, y, z, w)))
            )
        self._say(POSES_TOPIC, TFMessage(tuple(transforms)))


def _bodies(simulation: Simulation) -> dict[str, int]:
    """The engine's indices of the first robot's root, things that can move, and links of other robots."""
    from kbot.sim.engine.world_builder import moving_bodies  # the engine, which no recording is read with

    model, _ = simulation.engine.current()
    first, *others = simulation.robots.values()
    root = first.robot.root
    bodies = {root: first.body.index(root), **moving_bodies(model, simulation.world)}
    for robot in others:
        bodies.update({f"{robot.name}/{link}": robot.body.index(link) for link in robot.body.links})
    return bodies
