"""The interface of controllers that follow a path, and how a base is guided along paths with headings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import ControllerLimits, Observation
from kbot.navigation.path import Path


class PathFollower(Protocol):
    """A controller that follows a path and reports how much of it is left."""

    is_done: bool
    remaining: float
    heading_error: float

    def update(self, observation: Observation) -> Twist: ...


@dataclass(frozen=True, slots=True)
class Guidance:
    """How a base that steers or drives sideways is guided along paths with headings.

    point     the point of the base's frame that follows the path
    follower  makes the controller that follows a path
    """

    point: PlanarPose
    follower: Callable[[Path, ControllerLimits], PathFollower]
