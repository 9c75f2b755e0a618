"""The last metres to a goal of a base that does not turn on the spot: a direct path, and its follower."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import ControllerLimits, Observation
from kbot.navigation.path import Path
from kbot.navigation.pose_search import Moves


class Approach(Protocol):
    """A controller that drives to a goal."""

    is_done: bool
    remaining: float

    def update(self, observation: Observation) -> Twist: ...


@dataclass(frozen=True, slots=True)
class Approaches:
    """Makes approaches.

    moves     the direct connections of the base
    follower  makes the controller that follows one
    distance  m. Nearer to the goal than this, the base looks for a direct connection
    """

    moves: Moves
    follower: Callable[[Path, ControllerLimits], Approach]
    distance: float

    def make(
        self,
        start: PlanarPose,
        goal: PlanarPose,
        any_heading: bool,
        limits: ControllerLimits,
        is_free: Callable[[NDArray[np.float64]], bool],
    ) -> Approach | None:
        """An approach on the first direct connection that is free; None if there is none."""
        for poses in self.moves.connections(start, goal, any_heading, math.inf):
            if is_free(poses):
                return self.follower(Path(poses[:, :2], float(poses[-1, 2]), yaws=poses[:, 2]), limits)
        return None
