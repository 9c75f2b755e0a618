"""Goals of a running simulation: accepts, drives to and cancels them for the page, topics and Python."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Protocol

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import STILL, Observation
from kbot.navigation.goal_status import GoalReport
from kbot.navigation.mobility import Mobility, mobility
from kbot.navigation.navigator import DEFAULTS, Navigator, NavigatorSettings
from kbot.navigation.path import Path
from kbot.navigation.planner import Planner
from kbot.navigation.simulated import (
    RATE,
    LidarPoints,
    Pilot,
    PoseSource,
    describe_fall,
    level_lidar,
    robot_planner,
)
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.world.occupancy import FREE_BELOW, OccupancyGrid

FAULTS = Complaints(logging.getLogger(__name__))
"""Reports maps that fail. Every goal makes a map, so a crash file for each failure would be too many."""


class GoalDriver(Protocol):
    """A controller that drives to one goal at a time, such as a `Navigator`.

    `status` is the state of the last goal, and `path` its path, None without one."""

    @property
    def status(self) -> GoalReport | None: ...

    @property
    def path(self) -> Path | None: ...

    def go(self, goal: PlanarPose, timeout: float | None = None) -> GoalReport:
        """Replace the current goal. Raises KbotError: it is not a goal for this driver."""
        ...

    def update(self, observation: Observation) -> Twist: ...

    def cancel(self, reason: str) -> None: ...

    def refuse(self, reason: str) -> None: ...


class MaplessDriver(GoalDriver, Protocol):
    """One that needs no map. Its poses come from odometry, `rate` times a second."""

    @property
    def rate(self) -> float: ...


class Goals:
    """Drives a simulation's robot to one goal at a time.

    The map of the world and the planner's tables are made for the first goal, and the robot's lidar is then
    mounted. With a driver of its own, there is no map. `status` is the state of the last goal, and `path` its
    path. The commands are journalled like all other commands. Code that drives the robot by hand calls
    `give_way`.
    """

    def __init__(
        self,
        simulation: Simulation,
        grid: OccupancyGrid | None = None,
        lidar: LidarSensor | None = None,
        settings: NavigatorSettings = DEFAULTS,
        in_background: bool = False,
        make_driver: Callable[[Simulation], MaplessDriver] | None = None,
    ) -> None:
        """Accept goals.

        Args: simulation: whose first robot drives. grid: replaces the map of the world. lidar: replaces the
        one that the description declares. settings: limits for each goal. in_background: make the map on
        another thread. The robot waits for it while time passes, so a run is not the same every time.
        make_driver: makes what drives to goals without a map. It raises a KbotError if the robot does not
        fit."""
        self._simulation, self._given, self._lidar = simulation, grid, lidar
        self._in_background = in_background
        self._navigator = Navigator(None, settings)
        self._driver: GoalDriver = self._navigator
        self._make_driver = make_driver
        self._rate = RATE
        self._pose_source: PoseSource = "ground_truth"
        self._making: Future[Planner] | None = None
        self._seen: LidarPoints | None = None
        self._moves: Mobility | None = None
        self._is_set_up = False
        self._pilot: Pilot | None = None
        self._prepared: PlanarPose | None = None
        self._time = -math.inf
        self._watchers: list[Callable[[], None]] = []
        self._reported: tuple[int, GoalReport | None, Path | None] = (0, None, None)
        self.count = 0
        """The number of goals so far."""

    @property
    def status(self) -> GoalReport | None:
        """The state of the last goal; None before the first."""
        return self._driver.status

    @property
    def path(self) -> Path | None:
        """The path to the last goal, in the world's frame; None until it is planned."""
        return self._driver.path

    @property
    def is_driving(self) -> bool:
        return self._pilot is not None

    @property
    def grid(self) -> OccupancyGrid | None:
        """The map; None until it is made for `prepare` or the first goal."""
        self._collect()
        planner = self._navigator.planner
        return planner.grid if planner is not None else None

    def watch(self, changed: Callable[[], None]) -> None:
        """Call `changed` whenever the status or the path changes, or belongs to another goal."""
        self._watchers.append(changed)

    def unwatch(self, changed: Callable[[], None]) -> None:
        """Stop calling `changed`."""
        self._watchers.remove(changed)

    def go(self, goal: PlanarPose, timeout: float | None = None) -> None:
        """Replace the current goal by a goal in the world's frame; `timeout` in s is a time limit.

        The goal is refused if the robot lies on its side or back.

        Raises: KbotError: a number is not finite, the goal is too far away, the timeout is not above 0, or
        the robot cannot drive or has no size."""
        self._set_up()
        self._driver.go(goal, timeout)
        self.count += 1
        self._time = self._simulation.time
        if fallen := describe_fall(self._simulation):
            self._driver.refuse(fallen)
            self._stand_still()
            return
        if self._pilot is None:
            self._pilot = Pilot(self._simulation, self, self._rate, self._pose_source, self._seen)
        self._report()
        self.prepare(goal)

    def cancel(self, reason: str = "cancelled by its sender") -> None:
        """Cancel the goal, if there is one, and stop the robot."""
        self._driver.cancel(reason)
        self._stand_still()

    def _stand_still(self) -> None:
        """Stop the robot if it drives to a goal."""
        if self._pilot is not None:
            self._simulation.cmd_vel(0.0, 0.0)
        self._release()

    def give_way(self, reason: str) -> None:
        """Cancel the goal, if there is one, without stopping the robot: something else commands it now."""
        if self._pilot is not None:
            self._driver.cancel(reason)
            self._release()

    def place(self, pose: PlanarPose) -> None:
        """Place the robot at a pose, at rest, and cancel the goal.

        Raises:
            KbotError: a number is not finite, or the map, if there is one, shows an obstacle there.
        """
        grid = self.grid
        if grid is not None and math.isfinite(pose.x + pose.y) and grid.value(pose.x, pose.y) > FREE_BELOW:
            raise KbotError(
                f"the robot cannot be placed at ({pose.x:.2f}, {pose.y:.2f}): the map shows an obstacle there"
            )
        self.cancel("the robot was placed elsewhere")
        self._simulation.cmd_vel(0.0, 0.0)
        self._simulation.models.set_pose(pose.x, pose.y, pose.yaw)

    def prepare(self, goal: PlanarPose | None = None) -> None:
        """Make a map that reaches to the robot and to a goal, unless there is one.

        Raises:
            KbotError: the robot cannot drive or has no size.
        """
        self._set_up()
        if self._make_driver is not None:
            return
        places = [self._simulation.ground_truth.pose, *([goal] if goal is not None else [])]
        around = [(place.x, place.y) for place in places]
        known = self.grid
        if self._making is not None:
            return  # `_collect` calls this again once the map is made
        reaches = known is not None and all(known.contains(*known.cell(*at)) for at in around)
        planner = self._navigator.planner if self._given is not None or reaches else None
        if not self._in_background:
            if planner is None:
                self._take(lambda: self._make(around))
        elif planner is None or goal is not None:
            self._prepared = goal
            threads = ThreadPoolExecutor(1, "map")
            self._making = threads.submit(self._make_and_try, planner, places, around)
            threads.shutdown(wait=False)

    def world_changed(self) -> None:
        """Discard the map, and make a new one if there is a goal."""
        if self._given is not None or self.grid is None:
            return
        self._navigator.planner = None
        if self._pilot is not None and self.status is not None:
            self.prepare(self.status.goal)

    def update(self, observation: Observation) -> Twist:
        """The command for the robot; the pilot calls this while there is a goal."""
        status = self.status
        if observation.time < self._time and status is not None:
            self._driver.cancel("the simulation was reset")
        self._time = observation.time
        self._collect()
        wanted = STILL if self._making is not None else self._driver.update(observation)
        self._report()
        if self.status is not None and self.status.state.is_end:
            self._release()
            return STILL
        return wanted

    def _set_up(self) -> None:
        """Before the first goal, make the driver, or find the robot's size. Find its lidar."""
        if self._is_set_up:
            return
        if self._make_driver is not None:
            driver = self._make_driver(self._simulation)
            self._driver, self._rate, self._pose_source = driver, driver.rate, "odometry"
        else:
            self._moves = mobility(self._simulation)
            self._navigator.guidance = self._moves.guidance
        lidar = self._lidar or level_lidar(self._simulation)
        if lidar is not None:
            self._seen = LidarPoints(lidar)
            if self._moves is not None:
                self._navigator.guard_with_lidar(self._moves.outline, lidar.spec.rate)
        self._is_set_up = True

    def _make(self, around: list[tuple[float, float]]) -> Planner:
        """Raises KbotError: the world is too large for a map."""
        moves = self._moves or mobility(self._simulation)
        if self._given is not None:
            return moves.planner(self._given)
        return robot_planner(self._simulation, around, moves)

    def _make_and_try(
        self, planner: Planner | None, places: list[PlanarPose], around: list[tuple[float, float]]
    ) -> Planner:
        """A planner that has already made its tables, for a path from the first to the last of the places."""
        planner = planner or self._make(around)
        planner.plan(places[0], places[-1])
        return planner

    def _collect(self) -> None:
        """Use a map that another thread has made."""
        making = self._making
        if making is None or not making.done():
            return
        self._making = None
        self._take(making.result)
        goal = self.status.goal if self.status is not None else None
        if self._pilot is not None and goal is not None and goal != self._prepared:
            self.prepare(goal)

    def _take(self, result: Callable[[], Planner]) -> None:
        try:
            self._navigator.planner = result()
        except KbotError as error:
            self._driver.refuse(str(error))
        except Exception as error:  # noqa: BLE001 - it refuses the goal, and the run goes on
            self._driver.refuse(f"no map: {FAULTS.fault('making a map', error)}")

    def _release(self) -> None:
        if self._pilot is not None:
            self._pilot.close()
            self._pilot = None
        self._report()

    def _report(self) -> None:
        now = self.count, self.status, self.path
        if now != self._reported:
            self._reported = now
            for changed in tuple(self._watchers):
                changed()
