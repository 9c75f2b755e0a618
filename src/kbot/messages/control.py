"""Messages that command joints: std_msgs/Float64, Float64MultiArray, trajectory_msgs/JointTrajectory."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.brief import Brief
from kbot.messages.sensing import MultiArrayLayout
from kbot.messages.types import Header, Int32, UInt32

HEADER, LAYOUT = Header(), MultiArrayLayout()


@dataclass(frozen=True, slots=True)
class Duration:
    """`sec + nanosec * 1e-9` seconds. `nanosec` is from 0 to 999999999, also if `sec` is negative."""

    sec: Int32 = 0
    nanosec: UInt32 = 0

    @classmethod
    def from_seconds(cls, seconds: float) -> Duration:
        return cls(*divmod(round(seconds * 1e9), 1_000_000_000))

    @property
    def seconds(self) -> float:
        return self.sec + self.nanosec * 1e-9


@dataclass(frozen=True, slots=True)
class Float64:
    data: float = 0.0


@dataclass(frozen=True, slots=True, repr=False)
class Float64MultiArray(Brief):
    layout: MultiArrayLayout = LAYOUT
    data: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, repr=False)
class JointTrajectoryPoint(Brief):
    """One number per joint in rad or m, rad/s or m/s, …; N or N m. An empty list leaves the quantity open."""

    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()
    time_from_start: Duration = Duration()


@dataclass(frozen=True, slots=True, repr=False)
class JointTrajectory(Brief):
    header: Header = HEADER
    joint_names: tuple[str, ...] = ()
    points: tuple[JointTrajectoryPoint, ...] = ()
