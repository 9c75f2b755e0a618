"""Messages with the fields, units and frames of their ROS namesakes (ROS 2 spelling of Time).

Lengths in metres, angles in radians, speeds in m/s and rad/s (REP 103). Quaternions are x, y, z, w.
A covariance is 6x6, row by row, over x, y, z and rotations about x, y, z.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, sin
from typing import Annotated

from kbot.brief import Brief

# The ROS type of a field, where the Python type does not determine it. A test compares them with ROS.
Int8 = Annotated[int, "int8"]
UInt8 = Annotated[int, "uint8"]
UInt16 = Annotated[int, "uint16"]
Int32 = Annotated[int, "int32"]
UInt32 = Annotated[int, "uint32"]
Float32 = Annotated[float, "float32"]
Numbers9 = Annotated[tuple[float, ...], "float64[9]"]
Numbers12 = Annotated[tuple[float, ...], "float64[12]"]
Numbers36 = Annotated[tuple[float, ...], "float64[36]"]

WORLD = "world"
"""The fixed frame of the simulated world."""
NO_COVARIANCE: tuple[float, ...] = (0.0,) * 36


@dataclass(frozen=True, slots=True)
class Time:
    """A time of the simulation's clock. `nanosec` is from 0 to 999999999."""

    sec: Int32 = 0
    nanosec: UInt32 = 0

    @classmethod
    def from_nanoseconds(cls, nanoseconds: int) -> Time:
        return cls(*divmod(nanoseconds, 1_000_000_000))

    @property
    def nanoseconds(self) -> int:
        return self.sec * 1_000_000_000 + self.nanosec

    @property
    def seconds(self) -> float:
        return self.sec + self.nanosec * 1e-9


@dataclass(frozen=True, slots=True)
class Header:
    stamp: Time = Time()
    frame_id: str = ""


@dataclass(frozen=True, slots=True)
class Vector3:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True)
class Point:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


def yaw_of(x: float, y: float, z: float, w: float) -> float:
    """The heading in rad, from -pi to pi, of the x axis that a quaternion of any length rotates."""
    return atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


@dataclass(frozen=True, slots=True)
class Quaternion:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0

    @classmethod
    def about_z(cls, yaw: float) -> Quaternion:
        """The rotation by `yaw` rad about z."""
        return cls(0.0, 0.0, sin(yaw / 2.0), cos(yaw / 2.0))

    @property
    def yaw(self) -> float:
        """Heading of the rotated x axis seen from above, in rad from -pi to pi."""
        return yaw_of(self.x, self.y, self.z, self.w)


@dataclass(frozen=True, slots=True)
class Pose:
    position: Point = Point()
    orientation: Quaternion = Quaternion()


@dataclass(frozen=True, slots=True, repr=False)
class PoseWithCovariance(Brief):
    pose: Pose = Pose()
    covariance: Numbers36 = NO_COVARIANCE


@dataclass(frozen=True, slots=True)
class Twist:
    """`linear` in m/s along x, y, z, `angular` in rad/s about them."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()


@dataclass(frozen=True, slots=True)
class TwistStamped:
    header: Header = Header()
    twist: Twist = Twist()


@dataclass(frozen=True, slots=True, repr=False)
class TwistWithCovariance(Brief):
    twist: Twist = Twist()
    covariance: Numbers36 = NO_COVARIANCE


@dataclass(frozen=True, slots=True, repr=False)
class Odometry(Brief):
    """`pose` in `header.frame_id`, `twist` in `child_frame_id`."""

    header: Header = Header()
    child_frame_id: str = ""
    pose: PoseWithCovariance = PoseWithCovariance()
    twist: TwistWithCovariance = TwistWithCovariance()


@dataclass(frozen=True, slots=True, repr=False)
class JointState(Brief):
    """One entry per joint. An empty list means that the quantity is unknown."""

    header: Header = Header()
    name: tuple[str, ...] = ()
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, repr=False)
class Transform(Brief):
    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


@dataclass(frozen=True, slots=True, repr=False)
class TransformStamped(Brief):
    """The pose of `child_frame_id` in `header.frame_id`."""

    header: Header = Header()
    child_frame_id: str = ""
    transform: Transform = Transform()


@dataclass(frozen=True, slots=True, repr=False)
class TFMessage(Brief):
    transforms: tuple[TransformStamped, ...] = ()


@dataclass(frozen=True, slots=True)
class ClockMessage:
    """rosgraph_msgs/Clock."""

    clock: Time = Time()


@dataclass(frozen=True, slots=True, repr=False)
class String(Brief):
    data: str = ""
