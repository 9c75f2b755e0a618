"""The interface of what drives a simulation's robot to goals: with a map, without one, or with a policy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, Protocol

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.goal_status import GoalReport
from kbot.navigation.path import Path
from kbot.world.occupancy import OccupancyGrid


class Driver(Protocol):
    """Commands the robot until it is closed. The robot keeps its last command."""

    def close(self) -> None: ...


class GoalNavigation(Protocol):
    """Knows the surroundings, plans, and commands the robot. `Goals` owns one."""

    @property
    def surroundings(self) -> Literal["map", "costs", "none"]:
        """What `grid` is: a map of the world, the costs around the robot, or nothing."""

    @property
    def status(self) -> GoalReport | None:
        """The state of the last goal; None before the first."""

    @property
    def path(self) -> Path | None:
        """The path to the last goal, in the world's frame; None until it is planned."""

    @property
    def pose(self) -> PlanarPose:
        """The pose of the robot's base in the world's frame, as far as the navigation knows it."""

    @property
    def grid(self) -> OccupancyGrid | None:
        """What is known of the surroundings, in the world's frame; None before that."""

    def set_up(self) -> None:
        """Prepare for goals. Raises KbotError: the robot cannot drive to goals."""

    def go(self, goal: PlanarPose, timeout: float | None, any_heading: bool) -> None:
        """Replace the current goal. Raises KbotError: a number is not finite or out of range."""

    def drive(self, after: Callable[[], None]) -> Driver:
        """Begin to command the robot, and call `after` after each update."""

    def prepare(self, goal: PlanarPose | None) -> None:
        """Make what planning needs, if it takes long."""

    def world_changed(self) -> None:
        """Forget what is known about the world."""

    def cancel(self, reason: str) -> None:
        """Cancel the goal, if there is one."""

    def refuse(self, reason: str) -> None:
        """Refuse the goal, if there is one, for a reason that the navigation does not know."""
