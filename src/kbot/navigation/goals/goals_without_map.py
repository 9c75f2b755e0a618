"""Goals without a map: the robot gets its start pose, and after that only what its own sensors measure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.controller import GENTLE
from kbot.navigation.goal_status import GoalReport
from kbot.navigation.path import Path
from kbot.navigation.space.cost_to_go import CostToGo
from kbot.navigation.without_map.local_navigator import LocalNavigator, LocalSettings
from kbot.navigation.without_map.local_pilot import DEFAULT_SETTINGS, LocalPilot, local_navigator
from kbot.navigation.without_map.way import way
from kbot.sim import Simulation
from kbot.world.occupancy import OccupancyGrid


class WithoutMap(Brief):
    """Drives with lidars, wheel odometry and IMU.

    The robot's pose at the first goal is its start pose. The estimate then continues from goal to goal. If
    the robot is placed while it has no goal, or the simulation is reset, it gets the new pose.
    """

    surroundings: Literal["costs"] = "costs"

    def __init__(
        self,
        simulation: Simulation,
        *,
        arrive: float = GENTLE.distance,
        max_speed: tuple[float, float] | None = None,
        settings: LocalSettings = DEFAULT_SETTINGS,
    ) -> None:
        """Args: simulation: whose first robot drives. arrive: radius in m within which a goal is reached, by
        the robot's estimate. max_speed: m/s and rad/s, by default the limits that the robot declares.
        settings: of the navigator."""
        self._simulation, self._arrive = simulation, arrive
        self._max_speed, self._settings = max_speed, settings
        self._navigator: LocalNavigator | None = None
        self._pilot: LocalPilot | None = None
        self._drawn: CostToGo | None = None
        self._path: Path | None = None
        self._after: Callable[[], None] = lambda: None

    @property
    def status(self) -> GoalReport | None:
        return None if self._navigator is None else self._navigator.status

    @property
    def path(self) -> Path | None:
        """The way that the robot would take now; a new one two to four times per second."""
        status, navigator = self.status, self._navigator
        if navigator is None or status is None:
            return None
        cost_to_go = navigator.cost_to_go
        if cost_to_go is not self._drawn:
            self._drawn = cost_to_go
            self._path = None if cost_to_go is None else way(cost_to_go, self.pose, status.goal)
        return self._path

    @property
    def pose(self) -> PlanarPose:
        """The robot's estimate; its start pose before the first goal."""
        return self._simulation.ground_truth.pose if self._pilot is None else self._pilot.pose

    @property
    def grid(self) -> OccupancyGrid | None:
        """The costs of the places around the robot; they move with it."""
        if self._navigator is None:
            return None
        rolling = self._navigator.grid
        return OccupancyGrid(self._navigator.costs(), rolling.resolution, PlanarPose(*rolling.corner))

    def set_up(self) -> None:
        """Before the first goal, mount the sensors and begin to estimate the pose."""
        if self._navigator is None:
            navigator, lidars = local_navigator(self._simulation, self._max_speed, self._settings)
            self._pilot = LocalPilot(self._simulation, navigator, lidars, after=lambda: self._after())
            self._navigator = navigator

    def go(self, goal: PlanarPose, timeout: float | None, any_heading: bool) -> None:
        self._require_navigator().go(goal, any_heading, self._arrive, timeout)

    def drive(self, after: Callable[[], None]) -> WithoutMap:
        """The pilot commands the robot while there is a goal."""
        self._after = after
        return self

    def close(self) -> None:
        """Stop reporting. The robot's pose estimate continues."""
        self._after = lambda: None

    def prepare(self, goal: PlanarPose | None) -> None:
        """There is nothing to prepare."""

    def world_changed(self) -> None:
        """The sensors detect what has changed."""

    def cancel(self, reason: str) -> None:
        if self._navigator is not None:
            self._navigator.cancel(reason)

    def refuse(self, reason: str) -> None:
        if self._navigator is not None:
            self._navigator.refuse(reason)

    def _require_navigator(self) -> LocalNavigator:
        self.set_up()
        assert self._navigator is not None
        return self._navigator
