"""Messages of sensors, from sensor_msgs, geometry_msgs and std_msgs. Large data are arrays or bytes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from kbot.brief import Brief
from kbot.messages.arrays import Array
from kbot.messages.types import (
    Float32,
    Header,
    Int8,
    Int32,
    Numbers9,
    Numbers12,
    Quaternion,
    UInt8,
    UInt16,
    UInt32,
    Vector3,
)
from kbot.text import KbotError

HEADER, UPRIGHT, ZERO = Header(), Quaternion(), Vector3()

Covariance = Numbers9

UNKNOWN_COVARIANCE: Covariance = (0.0,) * 9


_TURN = 2.0 * math.pi
_SAME_ANGLE = 2e-5
"""rad by which two angles may differ and count as equal. Messages have the angles as 32-bit numbers."""


def _empty() -> Array[np.float32]:
    return np.empty(0, dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LaserScan(Brief):
    """`ranges` in m. +inf: no return. -inf: an object is closer than `range_min` (REP 117)."""

    header: Header = HEADER
    angle_min: Float32 = 0.0
    angle_max: Float32 = 0.0
    angle_increment: Float32 = 0.0
    time_increment: Float32 = 0.0
    scan_time: Float32 = 0.0
    range_min: Float32 = 0.0
    range_max: Float32 = 0.0
    ranges: Array[np.float32] = field(default_factory=_empty)
    intensities: Array[np.float32] = field(default_factory=_empty)

    def sector(self, start: float, end: float) -> Array[np.float32]:
        """The ranges (n,) in m of the beams from `start` to `end` in rad, counter-clockwise.

        Angles are in the frame of the sensor (REP 103): 0 is straight ahead, pi/2 is left, -pi/2 is right. A
        sector may cross the rear: `sector(2.6, -2.6)` is 1.08 rad wide. Both ends are included.

        A value is +inf if nothing was measured: no return, NaN, or a value outside the limits of the sensor.
        It is -inf if an object is closer than `range_min`. `min(scan.sector(-0.5, 0.5))` is the distance to
        the nearest object ahead, or +inf if there is none.

        Raises:
            KbotError: an angle is not finite or is beyond a full turn, as one in degrees is, or the sensor
                has no beam in the sector.
        """
        if not (math.isfinite(start) and math.isfinite(end)):
            raise KbotError(f"a sector needs two finite angles in rad, not {start} and {end}")
        if max(abs(start), abs(end)) > _TURN + _SAME_ANGLE:
            raise KbotError(
                f"a sector needs two angles in rad from -2 pi to 2 pi, not {start:g} and {end:g}. Convert "
                f"angles in degrees: sector(math.radians({start:g}), math.radians({end:g}))"
            )
        angles = self.angle_min + self.angle_increment * np.arange(len(self.ranges))
        width = _TURN if abs(end - start) >= _TURN - _SAME_ANGLE else (end - start) % _TURN
        # rounded, so that the two beams to the rear of a full turn, -pi and pi, keep the scan's order
        after_start = np.round((angles - start + _SAME_ANGLE) % _TURN - _SAME_ANGLE, 5)
        chosen = np.flatnonzero(after_start <= width + _SAME_ANGLE)
        if not len(chosen):
            first, last = sorted((self.angle_min, self.angle_max))
            raise KbotError(
                f"the scan has no beam from {start:.4g} to {end:.4g} rad: it has {len(self.ranges)} beams "
                f"from {first:.4g} to {last:.4g} rad"
            )
        ranges = self.ranges[chosen[np.argsort(after_start[chosen], kind="stable")]]
        low, high = np.float32(self.range_min), np.float32(self.range_max)  # rounded like the ranges
        is_valid = np.isneginf(ranges) | ((ranges >= low) & (ranges <= high))
        return np.where(is_valid, ranges, np.float32(np.inf))


@dataclass(frozen=True, slots=True, repr=False)
class Imu(Brief):
    """Angular velocity in rad/s and specific force in m/s^2, in the sensor's axes.

    At rest, the specific force is that of gravity, upwards.
    """

    header: Header = HEADER
    orientation: Quaternion = UPRIGHT
    orientation_covariance: Covariance = UNKNOWN_COVARIANCE
    angular_velocity: Vector3 = ZERO
    angular_velocity_covariance: Covariance = UNKNOWN_COVARIANCE
    linear_acceleration: Vector3 = ZERO
    linear_acceleration_covariance: Covariance = UNKNOWN_COVARIANCE


ULTRASOUND, INFRARED = 0, 1


@dataclass(frozen=True, slots=True, repr=False)
class Range(Brief):
    """A distance in m, with +inf and -inf as in LaserScan."""

    header: Header = HEADER
    radiation_type: UInt8 = ULTRASOUND
    field_of_view: Float32 = 0.0
    min_range: Float32 = 0.0
    max_range: Float32 = 0.0
    range: Float32 = 0.0
    variance: Float32 = 0.0


@dataclass(frozen=True, slots=True)
class NavSatStatus:
    status: Int8 = 0
    service: UInt16 = 1


@dataclass(frozen=True, slots=True, repr=False)
class NavSatFix(Brief):
    """Degrees, and metres above the WGS 84 ellipsoid. The covariance is in m^2 over east, north, up."""

    header: Header = HEADER
    status: NavSatStatus = NavSatStatus()
    latitude: float = 0.0
    longitude: float = 0.0
    altitude: float = 0.0
    position_covariance: Covariance = UNKNOWN_COVARIANCE
    position_covariance_type: UInt8 = 0


FLOAT32 = 7


@dataclass(frozen=True, slots=True)
class PointField:
    name: str = ""
    offset: UInt32 = 0
    datatype: UInt8 = FLOAT32
    count: UInt32 = 1


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PointCloud2(Brief):
    """Points as bytes: `point_step` bytes per point, `row_step` bytes per row."""

    header: Header = HEADER
    height: UInt32 = 0
    width: UInt32 = 0
    fields: tuple[PointField, ...] = ()
    is_bigendian: bool = False
    point_step: UInt32 = 0
    row_step: UInt32 = 0
    data: bytes = b""
    is_dense: bool = True


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Image(Brief):
    """Pixels row by row from the top. KBot's cameras publish `encoding` rgb8, and 32FC1 for depth in m."""

    header: Header = HEADER
    height: UInt32 = 0
    width: UInt32 = 0
    encoding: str = ""
    is_bigendian: UInt8 = 0
    step: UInt32 = 0
    data: bytes = b""


@dataclass(frozen=True, slots=True)
class RegionOfInterest:
    x_offset: UInt32 = 0
    y_offset: UInt32 = 0
    height: UInt32 = 0
    width: UInt32 = 0
    do_rectify: bool = False


@dataclass(frozen=True, slots=True, repr=False)
class CameraInfo(Brief):
    """Intrinsics in pixels, row by row: `k` (3x3), `r` (3x3), `p` (3x4). Field names are those of ROS 2."""

    header: Header = HEADER
    height: UInt32 = 0
    width: UInt32 = 0
    distortion_model: str = "plumb_bob"
    d: tuple[float, ...] = (0.0,) * 5
    k: Numbers9 = (0.0,) * 9
    r: Numbers9 = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    p: Numbers12 = (0.0,) * 12
    binning_x: UInt32 = 0
    binning_y: UInt32 = 0
    roi: RegionOfInterest = RegionOfInterest()


@dataclass(frozen=True, slots=True)
class Wrench:
    """Force in N and torque in N m."""

    force: Vector3 = ZERO
    torque: Vector3 = ZERO


@dataclass(frozen=True, slots=True, repr=False)
class WrenchStamped(Brief):
    """A wrench in the axes of the header's frame."""

    header: Header = HEADER
    wrench: Wrench = Wrench()


@dataclass(frozen=True, slots=True, repr=False)
class Joy(Brief):
    """The state of a gamepad. Axes are from 1 (left, forward) to -1. A pressed button is 1."""

    header: Header = HEADER
    axes: tuple[Float32, ...] = ()
    buttons: tuple[Int32, ...] = ()


@dataclass(frozen=True, slots=True)
class Bool:
    data: bool = False


@dataclass(frozen=True, slots=True)
class MultiArrayDimension:
    label: str = ""
    size: UInt32 = 0
    stride: UInt32 = 0


@dataclass(frozen=True, slots=True, repr=False)
class MultiArrayLayout(Brief):
    dim: tuple[MultiArrayDimension, ...] = ()
    data_offset: UInt32 = 0


@dataclass(frozen=True, slots=True, repr=False)
class Float32MultiArray(Brief):
    layout: MultiArrayLayout = MultiArrayLayout()
    data: tuple[Float32, ...] = ()
