"""Logical cameras: which things are in view, by name, and where; nothing is drawn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from kbot.kinematics.transform import Transform
from kbot.messages import Header
from kbot.messages import types as msg
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError


@dataclass(frozen=True, kw_only=True)
class LogicalCamera(Spec):
    """Looks along x of `pose`: `fov` is the horizontal field of view in rad, `aspect` its width by its
    height, `near` and `far` in m. `noise` in m is added to each coordinate of where a thing is."""

    kind: ClassVar[str] = "logical_camera"
    near: float = 0.0
    far: float = 10.0
    fov: float = math.radians(60)
    aspect: float = 1.0
    noise: Noise = NONE

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.near < self.far < math.inf:
            raise KbotError(f"{self.label}: the planes go up from 0 m, unlike {self.near} to {self.far}")
        if not (0.0 < self.fov < math.pi and self.aspect > 0.0):
            raise KbotError(f"{self.label}: a field of view is above 0 and below pi rad, its aspect above 0")

    @property
    def topics(self) -> tuple[str, ...]:
        return (self.topic or f"{self.label}/models",)

    def mount(self, simulation: Simulation) -> LogicalCameraSensor:
        return LogicalCameraSensor(simulation, self)


class LogicalCameraSensor(Sensor[msg.TFMessage]):
    """Says a TFMessage: a transform from the sensor to each thing whose origin is in view, bodies of the
    world and other robots by their names. What is behind something else is seen too."""

    message_type = msg.TFMessage
    spec: LogicalCamera

    def __init__(self, simulation: Simulation, spec: LogicalCamera) -> None:
        super().__init__(simulation, spec)
        self._most = len(simulation.world.bodies) + 64
        self._noise = self._noise_of(spec.noise, "place", 3 * self._most)

    def measure(self, sample: int | None = None) -> msg.TFMessage:
        _, _, place, axes = self._place()
        sensor_from_world = Transform.from_rotation_translation(axes, place).inverse()
        off = np.zeros((self._most, 3))
        if sample is not None:
            off = self._noise.apply(off.reshape(-1), sample).reshape(-1, 3)
        header = self._header()
        found = []
        for number, (name, pose) in enumerate(self._things()):
            seen = sensor_from_world @ pose
            if self._is_in_view(*seen.translation.tolist()):
                found.append(_transform(header, name, seen, off[number % self._most]))
        return msg.TFMessage(tuple(found))

    def _things(self) -> Iterator[tuple[str, Transform]]:
        """Names and `world_from_thing`; ground is no thing."""
        simulation = self.simulation
        moved = simulation.body_poses()
        for body in simulation.world.bodies:
            if not all(part.ground for part in body.parts):
                yield body.name, moved.get(body.name, body.pose)
        for name, robot in simulation.robots.items():
            if name != self.owner:
                yield name, robot.link_pose(robot.robot.root)

    def _is_in_view(self, x: float, y: float, z: float) -> bool:
        spec = self.spec
        across = x * math.tan(spec.fov / 2.0)
        return spec.near <= x <= spec.far and abs(y) <= across and abs(z) <= across / spec.aspect


def _transform(header: Header, name: str, pose: Transform, off: np.ndarray) -> msg.TransformStamped:
    x, y, z = (pose.translation + off).tolist()
    return msg.TransformStamped(
        header, name, msg.Transform(msg.Vector3(x, y, z), msg.Quaternion(*pose.quaternion_xyzw))
    )
