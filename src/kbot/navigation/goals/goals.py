"""Goals of a running simulation: accepts, drives to and cancels them for the page, topics and Python."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from kbot.brief import Brief, brief, counted
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.goal_status import GoalReport
from kbot.navigation.goals.goal_navigation import Driver, GoalNavigation
from kbot.navigation.goals.goals_with_map import WithMap
from kbot.navigation.path import Path
from kbot.navigation.simulated.fall import describe_fall
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.occupancy import FREE_BELOW, OccupancyGrid


class Goals(Brief):
    """Drives a simulation's robot to one goal at a time.

    `status` is the state of the last goal, and `path` its path. The commands are journalled like all other
    commands. Code that drives the robot by hand calls `give_way`.
    """

    def __init__(self, simulation: Simulation, navigation: GoalNavigation | None = None) -> None:
        """Accept goals for the simulation's first robot.

        `navigation` is a `WithMap` on the map of the simulation's world by default, or for example a
        `WithoutMap`."""
        self._simulation = simulation
        self._navigation = navigation or WithMap(simulation)
        self._driver: Driver | None = None
        self._watchers: list[Callable[[], None]] = []
        self._reported: tuple[int, GoalReport | None, Path | None] = (0, None, None)
        self.count = 0
        """The number of goals so far."""

    @property
    def status(self) -> GoalReport | None:
        """The state of the last goal; None before the first."""
        return self._navigation.status

    @property
    def path(self) -> Path | None:
        """The path to the last goal, in the world's frame; None until it is planned."""
        return self._navigation.path

    @property
    def is_driving(self) -> bool:
        return self._driver is not None

    @property
    def has_map(self) -> bool:
        """Whether goals are planned on a map."""
        return self._navigation.surroundings == "map"

    @property
    def has_costs(self) -> bool:
        """Whether there are costs around the robot instead of a map."""
        return self._navigation.surroundings == "costs"

    @property
    def plans(self) -> bool:
        """Whether goals have a path. A policy drives without one."""
        return self._navigation.surroundings != "none"

    @property
    def grid(self) -> OccupancyGrid | None:
        """The map, which is made for `prepare` or the first goal. Without a map, the costs around the robot.
        None before that."""
        return self._navigation.grid

    @property
    def pose(self) -> PlanarPose:
        """The pose of the robot's base in the world's frame, as far as the navigation knows it: the true one
        with a map, else the robot's estimate."""
        return self._navigation.pose

    def watch(self, changed: Callable[[], None]) -> None:
        """Call `changed` whenever the status or the path changes, or belongs to another goal."""
        self._watchers.append(changed)

    def unwatch(self, changed: Callable[[], None]) -> None:
        """Stop calling `changed`."""
        self._watchers.remove(changed)

    def go(self, goal: PlanarPose, timeout: float | None = None, *, any_heading: bool = False) -> None:
        """Replace the current goal by a goal in the world's frame; `timeout` in s is a time limit.

        With `any_heading`, the goal's yaw does not matter. The goal is refused if the robot lies on its side
        or back.

        Raises: KbotError: a number is not finite, the goal is too far away, the timeout is not above 0, or
        the robot cannot drive to goals or has no size."""
        self._navigation.set_up()
        self._navigation.go(goal, timeout, any_heading)
        self.count += 1
        if fallen := describe_fall(self._simulation):
            self._navigation.refuse(fallen)
            self._stand_still()
            return
        if self._driver is None:
            self._driver = self._navigation.drive(self._after_update)
        self._report()
        self._navigation.prepare(goal)

    def cancel(self, reason: str = "cancelled by its sender") -> None:
        """Cancel the goal, if there is one, and stop the robot."""
        self._navigation.cancel(reason)
        self._stand_still()

    def _stand_still(self) -> None:
        """Stop the robot if it drives to a goal."""
        if self._driver is not None:
            self._simulation.cmd_vel(0.0, 0.0)
        self._release()

    def give_way(self, reason: str) -> None:
        """Cancel the goal, if there is one, without stopping the robot: something else commands it now."""
        if self._driver is not None:
            self._navigation.cancel(reason)
            self._release()

    def place(self, pose: PlanarPose) -> None:
        """Place the robot at a pose, at rest, and cancel the goal.

        Raises:
            KbotError: a number is not finite, or the map, if there is one, shows an obstacle there.
        """
        grid = self.grid if self.has_map else None
        if grid is not None and math.isfinite(pose.x + pose.y) and grid.value(pose.x, pose.y) > FREE_BELOW:
            raise KbotError(
                f"the robot cannot be placed at ({pose.x:.2f}, {pose.y:.2f}): the map shows an obstacle there"
            )
        self.cancel("the robot was placed elsewhere")
        self._simulation.cmd_vel(0.0, 0.0)
        self._simulation.models.set_pose(pose.x, pose.y, pose.yaw)

    def prepare(self) -> None:
        """Make the map around the robot, unless there is one.

        Raises:
            KbotError: the robot cannot drive to goals or has no size.
        """
        self._navigation.set_up()
        self._navigation.prepare(None)

    def world_changed(self) -> None:
        """Discard the map, and make a new one if there is a goal."""
        self._navigation.world_changed()

    def _after_update(self) -> None:
        """Report, and release the robot once the goal has ended."""
        self._report()
        if self.status is not None and self.status.state.is_end:
            self._release()

    def _release(self) -> None:
        if self._driver is not None:
            self._driver.close()
            self._driver = None
        self._report()

    def _report(self) -> None:
        now = self.count, self.status, self.path
        if now != self._reported:
            self._reported = now
            for changed in tuple(self._watchers):
                changed()

    def _shown(self) -> Iterator[str]:
        yield brief(self._simulation)
        yield counted(self.count, "goal")
