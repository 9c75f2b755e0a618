"""What stands about a recorded robot, and where: its world as it changes, and true poses in it."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from kbot.messages.types import (
    Header,
    Quaternion,
    String,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)
from kbot.wire import Packet

if TYPE_CHECKING:
    from kbot.kinematics.transform import Transform as Pose
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


class Surroundings:
    """Writes them down as time passes; what is written does not change the run."""

    def __init__(self, simulation: Simulation, write: Callable[[Packet], None]) -> None:
        self._simulation, self._write = simulation, write
        self._told: dict[str, np.ndarray] = {}
        self._count, self._seen = 0, -1
        self.look()
        self._tell_poses()
        self._timer = simulation.clock.every(RATE, self._tell_poses)

    def look(self) -> None:
        """To be called when something may have come or gone."""
        if len(self._simulation.changes) == self._seen:
            return
        self._seen = len(self._simulation.changes)
        text = json.dumps([{"do": what, **numbers} for what, numbers in self._simulation.changes])
        self._say(WORLD_TOPIC, String(text))
        self._told.clear()

    def close(self) -> None:
        self._timer.cancel()

    def _say(self, topic: str, message: object) -> None:
        self._write(Packet(topic, message, self._simulation.clock.nanoseconds))

    def _tell_poses(self) -> None:
        if self._count % WHOLE_EVERY == 0:
            self._told.clear()
        self._count += 1
        stamp = self._simulation.clock.stamp
        moved = []
        for name, pose in true_poses(self._simulation).items():
            before = self._told.get(name)
            if before is None or np.abs(before - pose.matrix).max() > STILL:
                self._told[name] = pose.matrix.copy()
                moved.append(_stamped(stamp, name, pose))
        if moved:
            self._say(POSES_TOPIC, TFMessage(tuple(moved)))


def true_poses(simulation: Simulation) -> dict[str, Pose]:
    """`world_from` the first robot's root, things that can move, and links of the other robots."""
    first, *others = simulation.robots.items()
    root = first[1].robot.root
    poses = {root: first[1].link_pose(root), **simulation.body_poses()}
    for name, robot in others:
        poses.update({f"{name}/{link}": pose for link, pose in robot.link_poses().items()})
    return poses


def _stamped(stamp: Time, name: str, pose: Pose) -> TransformStamped:
    transform = Transform(Vector3(*pose.translation.tolist()), Quaternion(*pose.quaternion_xyzw))
    return TransformStamped(Header(stamp, WORLD_FRAME), name, transform)
