"""Position sensors: GPS and ground truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np

from kbot.kinematics.transform import Transform
from kbot.messages import (
    Header,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from kbot.messages.sensing import Covariance, NavSatFix
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.sensor import HERE, Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.georeference import Georeference

WGS84_A = 6378137.0
WGS84_F = 1.0 / 298.257223563
_E2 = WGS84_F * (2.0 - WGS84_F)
_DIAGONAL = 2
"""COVARIANCE_TYPE_DIAGONAL_KNOWN."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Gps(Spec):
    """A GPS receiver.

    The world's origin is at `latitude` and `longitude` (degrees) and `altitude` (m above the ellipsoid), with
    x pointing east and y north. If none of them is given, the world's own georeference applies, else all are
    0. The noises `horizontal` (east and north) and `vertical` are in m.
    """

    kind: ClassVar[str] = "gps"
    rate: float = 5.0
    latitude: float | None = None
    longitude: float | None = None
    altitude: float | None = None
    horizontal: Noise = NONE
    vertical: Noise = NONE

    def __post_init__(self) -> None:
        super().__post_init__()
        given = self.georeference(None)
        if not (-90.0 <= given.latitude <= 90.0 and -180.0 <= given.longitude <= 180.0):
            raise KbotError(
                f"{self.label}: the latitude must be from -90 to 90 and the longitude from -180 to 180"
                f" degrees, not {given.latitude} and {given.longitude}"
            )

    def georeference(self, of_world: Georeference | None) -> Georeference:
        """The position of the world's origin: as given in this spec, or else the world's own."""
        if self.latitude is None and self.longitude is None and self.altitude is None:
            return of_world or Georeference()
        return Georeference(self.latitude or 0.0, self.longitude or 0.0, self.altitude or 0.0)

    def mount(self, simulation: Simulation) -> GpsSensor:
        return GpsSensor(simulation, self)


class GpsSensor(Sensor[NavSatFix]):
    """Publishes a NavSatFix."""

    message_type = NavSatFix
    spec: Gps

    def __init__(self, simulation: Simulation, spec: Gps) -> None:
        super().__init__(simulation, spec)
        self._horizontal = self._noise_of(spec.horizontal, "horizontal", 2)
        self._vertical = self._noise_of(spec.vertical, "vertical", 1)
        self._origin = spec.georeference(simulation.world.georeference)
        across, up = spec.horizontal.variance, spec.vertical.variance
        self._covariance: Covariance = (across, 0.0, 0.0, 0.0, across, 0.0, 0.0, 0.0, up)

    def measure(self, sample: int | None = None) -> NavSatFix:
        origin = self._origin
        x, y, up = self._place()[2].tolist()
        east, north = origin.east_north(x, y)
        if sample is not None:
            east, north = self._horizontal.apply(np.array([east, north]), sample).tolist()
            (up,) = self._vertical.apply(np.array([up]), sample).tolist()
        latitude, longitude, altitude = geodetic(
            [east, north, up], origin.latitude, origin.longitude, origin.altitude
        )
        return NavSatFix(
            self._header(),
            latitude=latitude,
            longitude=longitude,
            altitude=altitude,
            position_covariance=self._covariance,
            position_covariance_type=_DIAGONAL,
        )


def geodetic(
    east_north_up: list[float], latitude: float, longitude: float, altitude: float
) -> tuple[float, float, float]:
    """Latitude, longitude (degrees) and altitude (m) of a point given in m east, north and up of another.

    The conversion uses earth-centred coordinates on WGS 84 (B. Hofmann-Wellenhof et al., GNSS, 2008, chapter
    8) and Bowring's formula, whose error near the ground is far below a millimetre.
    """
    phi, lam = math.radians(latitude), math.radians(longitude)
    sin_phi, cos_phi, sin_lam, cos_lam = math.sin(phi), math.cos(phi), math.sin(lam), math.cos(lam)
    n = WGS84_A / math.sqrt(1.0 - _E2 * sin_phi**2)
    east, north, up = east_north_up
    x = (
        (n + altitude) * cos_phi * cos_lam
        - sin_lam * east
        - sin_phi * cos_lam * north
        + cos_phi * cos_lam * up
    )
    y = (
        (n + altitude) * cos_phi * sin_lam
        + cos_lam * east
        - sin_phi * sin_lam * north
        + cos_phi * sin_lam * up
    )
    z = (n * (1.0 - _E2) + altitude) * sin_phi + cos_phi * north + sin_phi * up
    b = WGS84_A * (1.0 - WGS84_F)
    p = math.hypot(x, y)
    theta = math.atan2(z * WGS84_A, p * b)
    other = (WGS84_A**2 - b**2) / b**2
    phi = math.atan2(z + other * b * math.sin(theta) ** 3, p - _E2 * WGS84_A * math.cos(theta) ** 3)
    n = WGS84_A / math.sqrt(1.0 - _E2 * math.sin(phi) ** 2)
    # near the poles the first form divides by almost 0, near the equator the second
    height = p / math.cos(phi) - n if abs(phi) < 1.0 else z / math.sin(phi) - n * (1.0 - _E2)
    return math.degrees(phi), math.degrees(math.atan2(y, x)), height


@dataclass(frozen=True, kw_only=True, repr=False)
class GroundTruth(Spec):
    """The true pose of a link in the world, and its twist in its own axes.

    `fixed_frame` is the name of the world's frame. `offset` moves the pose along the world's axes (m) and
    rotates it about them. `noise` is that of the twist, in m/s and rad/s.
    """

    kind: ClassVar[str] = "ground_truth"
    rate: float = 50.0
    fixed_frame: str = "world"
    offset: Transform = HERE
    noise: Noise = NONE

    def mount(self, simulation: Simulation) -> GroundTruthSensor:
        return GroundTruthSensor(simulation, self)


class GroundTruthSensor(Sensor[Odometry]):
    """Publishes an Odometry in the world's frame."""

    message_type = Odometry
    spec: GroundTruth

    def __init__(self, simulation: Simulation, spec: GroundTruth) -> None:
        super().__init__(simulation, spec)
        self._noise = self._noise_of(spec.noise, "twist", 6)
        variance = spec.noise.variance
        self._covariance = tuple(variance if n % 7 == 0 else 0.0 for n in range(36))

    def measure(self, sample: int | None = None) -> Odometry:
        model, data, place, axes = self._place()
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, self._body, velocity, 0)
        spin = velocity[:3]
        speed = velocity[3:] + np.cross(spin, place - data.xpos[self._body])
        twist = np.concatenate((axes.T @ speed, axes.T @ spin))
        if sample is not None:
            twist = self._noise.apply(twist, sample)
        moved = self.spec.offset
        turned = Transform.from_rotation_translation(moved.rotation @ axes, (0.0, 0.0, 0.0)).quaternion_xyzw
        return Odometry(
            Header(self.simulation.clock.stamp, self.spec.fixed_frame),
            self._frame,
            PoseWithCovariance(
                Pose(Point(*(place + moved.translation).tolist()), Quaternion(*turned)), self._covariance
            ),
            TwistWithCovariance(
                Twist(Vector3(*twist[:3].tolist()), Vector3(*twist[3:].tolist())), self._covariance
            ),
        )
