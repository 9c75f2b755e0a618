"""Accepts, drives to and cancels the goals of a running simulation, from the page, topics or Python."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import STILL, Observation
from kbot.navigation.footprint import outline, turning_radius
from kbot.navigation.goal_status import GoalReport
from kbot.navigation.navigator import DEFAULTS, Navigator, NavigatorSettings
from kbot.navigation.path import Path
from kbot.navigation.planner import GridPlanner
from kbot.navigation.simulated import LidarPoints, Pilot, level_lidar, lies, require_turning, robot_planner
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.world.occupancy import FREE_BELOW, OccupancyGrid

FAULTS = Complaints(logging.getLogger(__name__))
"""Where maps that fail are reported: every goal makes a map, and a crash file for each would be too many."""


class Goals:
    """Takes one goal at a time. Nothing is made before the first: then the map of the world and the planner's
    tables are, and the robot's own lidar is looked for.

    `status` says how the last goal stands, `path` the way to it. What it commands is journalled as any
    command is. Who drives by hand calls `give_way`.
    """

    def __init__(
        self,
        simulation: Simulation,
        grid: OccupancyGrid | None = None,
        lidar: LidarSensor | None = None,
        settings: NavigatorSettings = DEFAULTS,
        in_background: bool = False,
    ) -> None:
        """`grid` stands in for the map of the world, `lidar` for the one that the description declares.
        `in_background`: the map is made on another thread, and the robot waits for it while time passes;
        else a run is the same every time.
        """
        self._simulation, self._given, self._lidar = simulation, grid, lidar
        self._in_background = in_background
        self._navigator = Navigator(None, settings)
        self._making: Future[GridPlanner] | None = None
        self._seen: LidarPoints | None = None
        self._radius: float | None = None
        self._pilot: Pilot | None = None
        self._prepared: PlanarPose | None = None
        self._time = -math.inf
        self._watchers: list[Callable[[], None]] = []
        self._told: tuple[int, GoalReport | None, Path | None] = (0, None, None)
        self.count = 0
        """How many goals it was given."""

    @property
    def status(self) -> GoalReport | None:
        """How the last goal stands; None before the first."""
        return self._navigator.status

    @property
    def path(self) -> Path | None:
        """The way to the last goal, in the world; None until there is one."""
        return self._navigator.path

    @property
    def is_driving(self) -> bool:
        return self._pilot is not None

    @property
    def grid(self) -> OccupancyGrid | None:
        """The map; None until it is made, which `prepare` and the first goal see to."""
        self._collect()
        planner = self._navigator.planner
        return planner.grid if planner is not None else None

    def watch(self, changed: Callable[[], None]) -> None:
        """Call back whenever the status or the path is another, or that of another goal."""
        self._watchers.append(changed)

    def unwatch(self, changed: Callable[[], None]) -> None:
        """Call back no more."""
        self._watchers.remove(changed)

    def go(self, goal: PlanarPose, timeout: float | None = None) -> None:
        """Take a goal (in the world) in place of any other; `timeout` in s bounds it. A robot that lies on
        its side or its back refuses it.

        Raises:
            KbotError: a number is not finite, the goal too far off, the timeout not above 0, or the robot
                cannot drive or has no size.
        """
        self._wake()
        self._navigator.go(goal, timeout)
        self.count += 1
        self._time = self._simulation.time
        if how := lies(self._simulation):
            self._navigator.refuse(how)
            self._stand_still()
            return
        if self._pilot is None:
            self._pilot = Pilot(self._simulation, self, seen=self._seen)
        self._tell()
        self.prepare(goal)

    def cancel(self, reason: str = "cancelled by its sender") -> None:
        """Give up the goal and stand still; without one nothing happens."""
        self._navigator.cancel(reason)
        self._stand_still()

    def _stand_still(self) -> None:
        """Drive no more, where a goal was driven to."""
        if self._pilot is not None:
            self._simulation.cmd_vel(0.0, 0.0)
        self._let_go()

    def give_way(self, reason: str) -> None:
        """Give up the goal and leave the wheels to somebody else; without one nothing happens."""
        if self._pilot is not None:
            self._navigator.cancel(reason)
            self._let_go()

    def place(self, pose: PlanarPose) -> None:
        """Put the robot somewhere else, standing still; a goal is given up.

        Raises:
            KbotError: a number is not finite, or an obstacle is there, on the map if there is one.
        """
        grid = self.grid
        if grid is not None and math.isfinite(pose.x + pose.y) and grid.value(pose.x, pose.y) > FREE_BELOW:
            raise KbotError(f"the robot cannot stand at ({pose.x:.2f}, {pose.y:.2f}): an obstacle is there")
        self.cancel("the robot was put elsewhere")
        self._simulation.cmd_vel(0.0, 0.0)
        self._simulation.models.set_pose(pose.x, pose.y, pose.yaw)

    def prepare(self, goal: PlanarPose | None = None) -> None:
        """See to it that there is a map, and that it reaches to where the robot is and to a goal.

        Raises:
            KbotError: the robot cannot drive or has no size.
        """
        self._wake()
        places = [self._simulation.ground_truth.pose, *([goal] if goal is not None else [])]
        around = [(place.x, place.y) for place in places]
        known = self.grid
        if self._making is not None:
            return  # asked again once that is there
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

    def look_again(self) -> None:
        """The world is another: make the map anew, at once where there is a goal."""
        if self._given is not None or self.grid is None:
            return
        self._navigator.planner = None
        if self._pilot is not None and self.status is not None:
            self.prepare(self.status.goal)

    def update(self, observation: Observation) -> Twist:
        """As a controller; called by the pilot while there is a goal."""
        status = self.status
        if observation.time < self._time and status is not None:
            self._navigator.cancel("the simulation was reset")
        self._time = observation.time
        self._collect()
        wanted = STILL if self._making is not None else self._navigator.update(observation)
        self._tell()
        if self.status is not None and self.status.state.is_end:
            self._let_go()
            return STILL
        return wanted

    def _wake(self) -> None:
        """Before the first goal: how large the robot is, and what it sees with."""
        if self._radius is not None:
            return
        robot, base = self._simulation.robot, require_turning(self._simulation).base
        radius = turning_radius(robot, base)
        lidar = self._lidar or level_lidar(self._simulation)
        if lidar is not None:
            self._seen = LidarPoints(lidar)
            self._navigator.watch_out(outline(robot, base), lidar.spec.rate)
        self._radius = radius

    def _make(self, around: list[tuple[float, float]]) -> GridPlanner:
        """Raises KbotError: the world is too large for a map."""
        if self._given is not None:
            return GridPlanner(self._given, self._radius or 0.0)
        return robot_planner(self._simulation, around)

    def _make_and_try(
        self, planner: GridPlanner | None, places: list[PlanarPose], around: list[tuple[float, float]]
    ) -> GridPlanner:
        """A planner that has made all that a plan from the first to the last of the places takes."""
        planner = planner or self._make(around)
        planner.plan(places[0], places[-1])
        return planner

    def _collect(self) -> None:
        """Take over a map that another thread has made."""
        making = self._making
        if making is None or not making.done():
            return
        self._making = None
        self._take(making.result)
        goal = self.status.goal if self.status is not None else None
        if self._pilot is not None and goal is not None and goal != self._prepared:
            self.prepare(goal)

    def _take(self, result: Callable[[], GridPlanner]) -> None:
        try:
            self._navigator.planner = result()
        except KbotError as error:
            self._navigator.refuse(str(error))
        except Exception as error:  # noqa: BLE001 - it refuses the goal, and the run goes on
            self._navigator.refuse(f"no map: {FAULTS.fault('making a map', error)}")

    def _let_go(self) -> None:
        if self._pilot is not None:
            self._pilot.close()
            self._pilot = None
        self._tell()

    def _tell(self) -> None:
        now = self.count, self.status, self.path
        if now != self._told:
            self._told = now
            for changed in tuple(self._watchers):
                changed()
