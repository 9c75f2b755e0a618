"""Measures by how much the way of a robot to a goal becomes shorter."""

from __future__ import annotations

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.interface.targets import GoalTarget
from kbot.navigation.space.cost_to_go import CostToGo


class RemainingWay:
    """The way that is left to a goal, on the shortest way around obstacles."""

    def __init__(self, goal: GoalTarget, ways: CostToGo, start: PlanarPose) -> None:
        """`ways` are the lengths of the ways to the goal."""
        self.goal, self._ways = goal, ways
        self.straight, self.length = self._lengths(start)
        """m to the goal at the last pose: along a straight line, and around obstacles."""

    def advance(self, pose: PlanarPose) -> float:
        """By how many m the way has become shorter since the last pose."""
        before = self.length
        self.straight, self.length = self._lengths(pose)
        return before - self.length

    def _lengths(self, pose: PlanarPose) -> tuple[float, float]:
        """The length of the straight line, and of the shortest way; near the goal, they are the same."""
        straight = self.goal.distance(pose)
        if straight <= 2.0 * self._ways.resolution:
            return straight, straight
        return straight, max(straight, self._ways.at_point(pose.x, pose.y))
