"""Wheel encoders: joint angles as counts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from kbot.kinematics.drive.drive import NoDrive
from kbot.messages import JointState
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean


@dataclass(frozen=True, kw_only=True, repr=False)
class Encoders(Spec):
    """Encoders of `joints`, by default of the driving wheels.

    `resolution` is in counts per turn, 0 for continuous angles. `noise` (rad) is added before counting.
    `link` only names a frame.
    """

    kind: ClassVar[str] = "encoders"
    link: str = ""
    rate: float = 50.0
    joints: tuple[str, ...] = ()
    resolution: int = 0
    noise: Noise = NONE

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.resolution < 0:
            raise KbotError(
                f"{self.label}: the resolution must be at least 0 counts per turn, not {self.resolution}"
            )

    def mount(self, simulation: Simulation) -> EncoderSensor:
        return EncoderSensor(simulation, self)


class EncoderSensor(Sensor[JointState]):
    """Publishes a JointState: angles in rad, in whole counts, and their mean speeds since the last sample."""

    message_type = JointState
    spec: Encoders

    def __init__(self, simulation: Simulation, spec: Encoders) -> None:
        """Raises KbotError: a joint does not exist, or none is given and the robot cannot drive."""
        self._joints = spec.joints or _driving(simulation, spec)
        robot = simulation.robots.named(spec.robot or None)
        known = robot.body.joint_positions
        for joint in self._joints:
            if joint not in known:
                hint = did_you_mean(joint, known)
                raise KbotError(f"{spec.label}: unknown joint '{joint}'" + (f": {hint}" if hint else ""))
        super().__init__(simulation, replace(spec, link=spec.link or robot.robot.root))
        self._noise = self._noise_of(spec.noise, "angle", len(self._joints))
        self._before: tuple[float, tuple[float, ...]] | None = None

    def measure(self, sample: int | None = None) -> JointState:
        positions = self.simulation.robots.named(self.owner).body.joint_positions
        angles = np.array([positions[joint] for joint in self._joints])
        if sample is not None:
            angles = self._noise.apply(angles, sample)
        if self.spec.resolution:
            count = 2.0 * math.pi / self.spec.resolution
            angles = np.floor(angles / count) * count
        now, counted = self.simulation.time, tuple(angles.tolist())
        speeds = (0.0,) * len(counted)
        if self._before is not None and now - self._before[0] > 1e-9:
            passed = now - self._before[0]
            speeds = tuple((p - b) / passed for p, b in zip(counted, self._before[1], strict=True))
        if sample is not None:
            self._before = now, counted
        return JointState(self._header(), self._joints, counted, speeds)


def _driving(simulation: Simulation, spec: Encoders) -> tuple[str, ...]:
    drive = simulation.robots.named(spec.robot or None).drive
    if isinstance(drive, NoDrive):
        raise KbotError(f"{spec.label}: name its joints, because the robot cannot drive: {drive.reason}")
    if not drive.joints:
        raise KbotError(f"{spec.label}: name its joints, because a plugin moves the robot without joints")
    return drive.joints
