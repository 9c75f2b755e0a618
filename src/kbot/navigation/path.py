"""A path on the plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import navigation as nav
from kbot.messages import types as msg
from kbot.text import KbotError

START = msg.Time()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Path(Brief):
    """A path of straight pieces.

    points  corners (n, 2) in m
    yaw     heading at the end in rad, None for any heading
    frame   of the points
    margin  free room in m beside the robot on the path, None if unknown
    yaws    heading of the robot at each point (n,) in rad; None for a robot that looks along the path
    """

    points: NDArray[np.float64]
    yaw: float | None = None
    frame: str = "map"
    margin: float | None = None
    yaws: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 2 or not len(self.points):
            raise KbotError(
                f"a path needs points (x, y) in an array of shape (n, 2), not {self.points.shape}"
            )
        if not np.isfinite(self.points).all():
            raise KbotError("the points of a path must be finite numbers")
        if self.yaws is not None and self.yaws.shape != self.points.shape[:1]:
            raise KbotError(f"a path of {len(self.points)} points needs as many yaws, not {len(self.yaws)}")

    @classmethod
    def through(cls, points: ArrayLike, yaw: float | None = None, frame: str = "map") -> Path:
        """A path through points (n, 2) in m. Raises KbotError for anything else."""
        try:
            array = np.array(points, dtype=np.float64)
        except ValueError:
            raise KbotError("a path needs points (x, y) in an array of numbers of shape (n, 2)") from None
        return cls(array, yaw, frame)

    @classmethod
    def from_poses(cls, poses: Sequence[PlanarPose], frame: str = "map") -> Path:
        """A path through poses; only the last one's heading counts."""
        if not poses:
            raise KbotError("a path needs at least one pose")
        return cls(np.array([(p.x, p.y) for p in poses]), poses[-1].yaw, frame)

    @property
    def length(self) -> float:
        """Metres."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())

    @property
    def goal(self) -> tuple[float, float]:
        x, y = self.points[-1].tolist()
        return x, y

    def headings(self) -> list[float]:
        """The robot's heading at each point; rad.

        Without `yaws`, it is the direction of the path, and `yaw` at the last point."""
        if self.yaws is not None:
            headings: list[float] = self.yaws.tolist()
            return headings
        ahead = [math.atan2(y, x) for x, y in np.diff(self.points, axis=0).tolist()]
        return [*ahead, self.yaw if self.yaw is not None else (ahead[-1] if ahead else 0.0)]

    def seen_from(self, place: PlanarPose, frame: str) -> Path:
        """The same path in another frame, whose pose in this path's frame is `place`."""
        inverse = place.inverse()
        yaw = None if self.yaw is None else self.yaw + inverse.yaw
        yaws = None if self.yaws is None else self.yaws + inverse.yaw
        return Path(inverse.apply(self.points), yaw, frame, self.margin, yaws)

    def to_message(self, stamp: msg.Time = START) -> nav.Path:
        """nav_msgs/Path."""
        header = msg.Header(stamp, self.frame)
        poses = zip(self.points.tolist(), self.headings(), strict=True)
        return nav.Path(
            header, tuple(to_pose_stamped(PlanarPose(x, y, yaw), header) for (x, y), yaw in poses)
        )

    @classmethod
    def from_message(cls, message: nav.Path) -> Path:
        """Raises KbotError for a path without poses."""
        return cls.from_poses([from_pose_stamped(p) for p in message.poses], message.header.frame_id)


def to_pose_stamped(pose: PlanarPose, header: msg.Header) -> nav.PoseStamped:
    """geometry_msgs/PoseStamped of a pose on the ground."""
    position, turn = msg.Point(pose.x, pose.y, 0.0), msg.Quaternion.about_z(pose.yaw)
    return nav.PoseStamped(header, msg.Pose(position, turn))


def from_pose_stamped(message: nav.PoseStamped) -> PlanarPose:
    """Its position and heading on the ground."""
    position = message.pose.position
    return PlanarPose(position.x, position.y, message.pose.orientation.yaw)
