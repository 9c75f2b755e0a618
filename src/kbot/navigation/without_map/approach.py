"""The last metres to a goal of a base that does not turn on the spot: a direct path, and its follower."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.controller import ControllerLimits
from kbot.navigation.followers.path_follower import PathFollower
from kbot.navigation.path import Path
from kbot.navigation.planning.moves import HolonomicMoves, SteeredMoves
from kbot.navigation.planning.pose_search import Moves
from kbot.navigation.simulated.mobility import RESERVE, TURNING, BaseKind, Mobility

_NEAR = 3.0
"""Turning radii from the goal at which a base that steers looks for a direct way. Most turns need less."""
_NEAR_SIDEWAYS = 0.3
"""m. The same for a base that drives sideways."""
_CELL, _SPACING = 0.2, 0.02
"""Size of a cell, and distance of the poses of a path: turning radii, or m for a base that drives sideways.
Direct connections use the spacing only."""


@dataclass(frozen=True, slots=True)
class Approaches:
    """Makes the controllers of approaches.

    moves     the direct connections of the base
    follower  makes the controller that follows one
    distance  m. Nearer to the goal than this, the base looks for a direct connection
    """

    moves: Moves
    follower: Callable[[Path, ControllerLimits], PathFollower]
    distance: float

    @classmethod
    def of(cls, mobility: Mobility) -> Approaches | None:
        """The approaches of a base; None for one that turns on the spot."""
        if mobility.kind is BaseKind.TURNS:
            return None
        if mobility.steering is not None:
            radius = RESERVE * mobility.steering.radius
            moves: Moves = SteeredMoves(radius, _CELL * radius, _SPACING * radius, mobility.point)
            return cls(moves, mobility.follower, _NEAR * radius)
        moves = HolonomicMoves(_CELL, _SPACING, TURNING * mobility.shape.radius)
        return cls(moves, mobility.follower, _NEAR_SIDEWAYS)

    def make(
        self,
        start: PlanarPose,
        goal: PlanarPose,
        any_heading: bool,
        limits: ControllerLimits,
        is_free: Callable[[NDArray[np.float64]], bool],
    ) -> PathFollower | None:
        """An approach on the first direct connection that is free; None if there is none."""
        for poses in self.moves.connections(start, goal, any_heading, math.inf):
            if is_free(poses):
                return self.follower(Path(poses[:, :2], float(poses[-1, 2]), yaws=poses[:, 2]), limits)
        return None
