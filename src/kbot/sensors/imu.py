"""Inertial measurement units: angular velocity, specific force and orientation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.transform import Transform
from kbot.messages import Quaternion, Vector3
from kbot.messages import sensing as msg
from kbot.messages.sensing import Covariance
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation

Vector = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, repr=False)
class Imu(Spec):
    """An IMU. The noises `gyroscope` (rad/s) and `accelerometer` (m/s^2) apply to each axis."""

    kind: ClassVar[str] = "imu"
    rate: float = 100.0
    gyroscope: Noise = NONE
    accelerometer: Noise = NONE

    def mount(self, simulation: Simulation) -> ImuSensor:
        return ImuSensor(simulation, self)


class ImuSensor(Sensor[msg.Imu]):
    """Publishes an Imu message.

    The specific force is the mean since the last sample, as in chips that integrate velocity changes. At rest
    it is gravity upwards. The orientation is the true one in the world.
    """

    message_type = msg.Imu
    spec: Imu

    def __init__(self, simulation: Simulation, spec: Imu) -> None:
        super().__init__(simulation, spec)
        self._gyroscope = self._noise_of(spec.gyroscope, "gyroscope", 3)
        self._accelerometer = self._noise_of(spec.accelerometer, "accelerometer", 3)
        self._gyroscope_covariance = _diagonal(spec.gyroscope.variance)
        self._accelerometer_covariance = _diagonal(spec.accelerometer.variance)
        self._before = self._motion()

    def _motion(self) -> tuple[float, Vector, Vector, Vector]:
        """The time, and the sensor's velocity, axes and angular velocity in the world."""
        model, data, place, axes = self._place()
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, self._body, velocity, 0)
        spin = velocity[:3]
        return self.simulation.time, velocity[3:] + np.cross(spin, place - data.xpos[self._body]), axes, spin

    def measure(self, sample: int | None = None) -> msg.Imu:
        now, velocity, axes, spin = self._motion()
        before, velocity_before, axes_before, _ = self._before
        if sample is not None:
            self._before = now, velocity, axes, spin
        passed = now - before
        gravity = np.array(self.simulation.world.gravity)
        # after a reset there is no earlier velocity
        gained = (velocity - velocity_before) / passed if passed > 1e-9 else np.zeros(3)
        half_way = (axes + axes_before) / 2.0 if passed > 1e-9 else axes
        force = half_way.T @ (gained - gravity)
        turning = axes.T @ spin
        if sample is not None:
            force = self._accelerometer.apply(force, sample)
            turning = self._gyroscope.apply(turning, sample)
        orientation = Transform.from_rotation_translation(axes, (0.0, 0.0, 0.0)).quaternion_xyzw
        return msg.Imu(
            self._header(),
            Quaternion(*orientation),
            _diagonal(0.0),
            Vector3(*turning.tolist()),
            self._gyroscope_covariance,
            Vector3(*force.tolist()),
            self._accelerometer_covariance,
        )


def _diagonal(variance: float) -> Covariance:
    return variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance
