"""Where a policy drives: to a goal, or along a path."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.path import Path
from kbot.text import KbotError

FURTHEST = 20.0
"""m. A policy sees a goal beyond this distance as if it were at this distance."""
AHEAD = (0.2, 0.4, 0.8, 1.6)
"""m. How far ahead on the path the points are that a policy sees. The spacing grows, because a curve matters
more the nearer it is."""
ASIDE = 5.0
"""m. The furthest that a policy sees a point of the path in x or y."""
_WINDOW = 0.5
"""m. How far the nearest place on the path can advance in one update. A path may pass close to itself."""


@dataclass(frozen=True, slots=True)
class Field:
    """One number that a policy sees or commands: its name, its unit, its bounds and what it is.

    A unit of `1` marks a number without a unit.
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str


class Target(Protocol):
    """Where a policy drives. `kind` is a key of `TARGET_FIELDS`."""

    @property
    def kind(self) -> str: ...

    @property
    def end(self) -> tuple[float, float]:
        """The goal, or the end of the path, in the map in m."""
        ...

    def values(self, pose: PlanarPose) -> list[float]:
        """The numbers of the kind's fields, seen from the base at `pose` in the map."""
        ...


GOAL_FIELDS = (
    Field("goal_distance", "m", 0.0, FURTHEST, "distance of the goal"),
    Field("goal_cos", "1", -1.0, 1.0, "cosine of the direction of the goal; 1 is ahead"),
    Field("goal_sin", "1", -1.0, 1.0, "sine of the direction of the goal; 1 is to the left"),
)
PATH_FIELDS = (
    Field("path_remaining", "m", 0.0, FURTHEST, "length of the path that is left"),
    *(
        Field(f"path_{at:g}_{axis}", "m", -ASIDE, ASIDE, f"{axis} of the point {at:g} m ahead on the path")
        for at in AHEAD
        for axis in "xy"
    ),
)
TARGET_FIELDS = {"goal": GOAL_FIELDS, "path": PATH_FIELDS}
"""The fields of each kind of target."""


@dataclass(frozen=True, slots=True)
class GoalTarget:
    """A point in the map in m. The heading at the goal is free."""

    kind: ClassVar[str] = "goal"
    x: float
    y: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.x) and math.isfinite(self.y)):
            raise KbotError(f"a goal must be two finite numbers, not {self.x}, {self.y}")

    @property
    def end(self) -> tuple[float, float]:
        return self.x, self.y

    def distance(self, pose: PlanarPose) -> float:
        """The distance in m from a pose to the goal."""
        return math.hypot(self.x - pose.x, self.y - pose.y)

    def values(self, pose: PlanarPose) -> list[float]:
        ahead, left = pose.local(self.x, self.y)
        bearing = math.atan2(left, ahead)
        return [math.hypot(ahead, left), math.cos(bearing), math.sin(bearing)]


class PathTarget(Brief):
    """A path in the map. It remembers the place that the robot has reached, which never moves back."""

    kind = "path"

    def __init__(self, path: Path) -> None:
        """Raises KbotError: the path has no length."""
        points = path.points
        apart = np.append(True, np.hypot(*np.diff(points, axis=0).T) > 0.0)
        self._points = points[apart]
        pieces = np.diff(self._points, axis=0)
        self._lengths = np.hypot(*pieces.T)
        if not len(self._lengths):
            raise KbotError("a path to follow needs at least two different points")
        self._directions = pieces / self._lengths[:, None]
        self._begins = np.append(0.0, np.cumsum(self._lengths))
        self.length = float(self._begins[-1])
        """Length of the path in m."""
        self.path = path
        self.along = 0.0
        """The place on the path that the robot has reached, in m from the start."""
        self.offset = 0.0
        """Distance in m between the robot and that place."""

    @property
    def start(self) -> PlanarPose:
        """The pose at the start of the path, in its direction."""
        (x, y), (ahead_x, ahead_y) = self._points[0].tolist(), self._directions[0].tolist()
        return PlanarPose(x, y, math.atan2(ahead_y, ahead_x))

    @property
    def end(self) -> tuple[float, float]:
        return self.path.goal

    def advance(self, pose: PlanarPose) -> None:
        """Find the place on the path that is nearest to the robot."""
        away = np.array([pose.x, pose.y]) - self._points[:-1]
        begins = self._begins[:-1]
        low = np.clip(self.along - begins, 0.0, self._lengths)
        high = np.clip(self.along + _WINDOW - begins, 0.0, self._lengths)
        places = np.clip((away * self._directions).sum(axis=1), low, high)
        distances = np.hypot(*(away - places[:, None] * self._directions).T)
        reached = begins + places
        distances[(reached < self.along) | (reached > self.along + _WINDOW)] = np.inf
        nearest = int(distances.argmin())
        self.along, self.offset = float(reached[nearest]), float(distances[nearest])

    def values(self, pose: PlanarPose) -> list[float]:
        self.advance(pose)
        at = self.along + np.array(AHEAD)
        xs, ys = (np.interp(at, self._begins, axis) for axis in self._points.T)
        seen = np.stack(pose.local(xs, ys), axis=1)
        return [self.length - self.along, *seen.ravel().tolist()]
