"""Measures how a robot comes nearer to a goal."""

from __future__ import annotations

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.targets import GoalTarget
from kbot.navigation.local.cost_to_go import CostToGo


class Approach:
    """The way that is left to a goal, on the shortest way around obstacles."""

    def __init__(self, goal: GoalTarget, ways: CostToGo, start: PlanarPose) -> None:
        """`ways` are the lengths of the ways to the goal."""
        self.goal, self._ways = goal, ways
        self.left = self._way(start)
        """m, at the last pose."""

    def advance(self, pose: PlanarPose) -> float:
        """By how many m the way has become shorter since the last pose."""
        before, self.left = self.left, self._way(pose)
        return before - self.left

    def _way(self, pose: PlanarPose) -> float:
        """The length in m of the shortest way; near the goal, of the straight line."""
        straight = self.goal.distance(pose)
        if straight <= 2.0 * self._ways.resolution:
            return straight
        return max(straight, self._ways.at_point(pose.x, pose.y))
