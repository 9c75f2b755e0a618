"""Goals on a map of the world, with the true pose, as after perfect localisation."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Literal

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import STILL, Observation
from kbot.navigation.goal_status import GoalReport
from kbot.navigation.path import Path
from kbot.navigation.planning.planner import Planner
from kbot.navigation.simulated.lidars import LidarPoints, level_lidar
from kbot.navigation.simulated.mobility import Mobility, mobility
from kbot.navigation.simulated.pilot import Pilot
from kbot.navigation.with_map.navigator import DEFAULTS, Navigator, NavigatorSettings
from kbot.navigation.with_map.robot_planner import robot_planner
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.complaints import Complaints
from kbot.world.occupancy import OccupancyGrid

FAULTS = Complaints(logging.getLogger(__name__))
"""Reports maps that fail. Every goal makes a map, so a crash file for each failure would be too many."""


class WithMap(Brief):
    """Plans on a map, and stops before obstacles that the robot's lidar detects.

    The map of the world and the planner's tables are made for the first goal, and the robot's lidar is then
    mounted.
    """

    surroundings: Literal["map"] = "map"

    def __init__(
        self,
        simulation: Simulation,
        grid: OccupancyGrid | None = None,
        lidar: LidarSensor | None = None,
        settings: NavigatorSettings = DEFAULTS,
        in_background: bool = False,
    ) -> None:
        """Args: simulation: whose first robot drives. grid: replaces the map of the world. lidar: replaces
        the one that the description declares. settings: limits for each goal. in_background: make the map on
        another thread. The robot waits for it while time passes, so a run is not the same every time."""
        self._simulation, self._given, self._lidar = simulation, grid, lidar
        self._in_background = in_background
        self._navigator = Navigator(None, settings)
        self._making: Future[Planner] | None = None
        self._seen: LidarPoints | None = None
        self._moves: Mobility | None = None
        self._prepared: PlanarPose | None = None
        self._time = -math.inf
        self._after: Callable[[], None] = lambda: None

    @property
    def status(self) -> GoalReport | None:
        return self._navigator.status

    @property
    def path(self) -> Path | None:
        return self._navigator.path

    @property
    def pose(self) -> PlanarPose:
        return self._simulation.ground_truth.pose

    @property
    def grid(self) -> OccupancyGrid | None:
        self._collect()
        planner = self._navigator.planner
        return planner.grid if planner is not None else None

    def set_up(self) -> None:
        """Before the first goal, find how the robot moves, and its lidar."""
        if self._moves is not None:
            return
        moves = mobility(self._simulation)
        self._navigator.guidance = moves.guidance
        lidar = self._lidar or level_lidar(self._simulation)
        if lidar is not None:
            self._seen = LidarPoints(lidar)
            self._navigator.guard_with_lidar(moves.outline, lidar.spec.rate)
        self._moves = moves

    def go(self, goal: PlanarPose, timeout: float | None, any_heading: bool) -> None:
        self._navigator.go(goal, timeout, any_heading)
        self._time = self._simulation.time

    def drive(self, after: Callable[[], None]) -> Pilot:
        self._after = after
        return Pilot(self._simulation, self, seen=self._seen)

    def cancel(self, reason: str) -> None:
        self._navigator.cancel(reason)

    def refuse(self, reason: str) -> None:
        self._navigator.refuse(reason)

    def prepare(self, goal: PlanarPose | None) -> None:
        """Make a map that reaches to the robot and to a goal, unless there is one."""
        places = [self.pose, *([goal] if goal is not None else [])]
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
        goal = self._current_goal
        if goal is not None:
            self.prepare(goal)

    def update(self, observation: Observation) -> Twist:
        """The command for the robot; the pilot calls this while there is a goal."""
        if observation.time < self._time:
            self._navigator.cancel("the simulation was reset")
        self._time = observation.time
        self._collect()
        wanted = STILL if self._making is not None else self._navigator.update(observation)
        self._after()
        return wanted if self._current_goal is not None else STILL

    @property
    def _current_goal(self) -> PlanarPose | None:
        status = self.status
        return None if status is None or status.state.is_end else status.goal

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
        goal = self._current_goal
        if goal is not None and goal != self._prepared:
            self.prepare(goal)

    def _take(self, result: Callable[[], Planner]) -> None:
        try:
            self._navigator.planner = result()
        except KbotError as error:
            self._navigator.refuse(str(error))
        except Exception as error:  # noqa: BLE001 - it refuses the goal, and the run goes on
            self._navigator.refuse(f"no map: {FAULTS.fault('making a map', error)}")
