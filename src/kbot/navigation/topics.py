"""Navigation on the bus: goals in; the way, the map and how it goes out, by the names of Nav2 and rviz."""

from __future__ import annotations

from kbot.kinematics.odometry import PlanarPose
from kbot.messages import String, Twist
from kbot.messages.navigation import OccupancyGrid, PoseStamped
from kbot.messages.navigation import Path as PathMessage
from kbot.navigation.controller import Observation
from kbot.navigation.footprint import outline, turning_radius
from kbot.navigation.navigator import DEFAULTS, Navigator, Settings
from kbot.navigation.path import Path, from_pose_stamped
from kbot.navigation.planner import GridPlanner
from kbot.navigation.simulated import LidarPoints, Pilot
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.occupancy import OccupancyGrid as Grid
from kbot.world.occupancy_of_world import world_grid

GOALS = ("goal_pose", "move_base_simple/goal")
"""Where rviz2 and rviz say goals."""
PLAN, MAP, STATUS = "plan", "map", "navigation_status"
FRAMES = ("", "map", "odom", "world")
"""Frames that a goal may be in; they are one here, for the simulation knows where its robot is."""


class NavigationTopics:
    """Hears goals (PoseStamped on `goal_pose` or `move_base_simple/goal`) and drives to them. Says the way as
    a Path on `plan`, the map on `map`, and each change of state as a String on `navigation_status`."""

    def __init__(
        self,
        simulation: Simulation,
        grid: Grid | None = None,
        lidar: LidarSensor | None = None,
        settings: Settings = DEFAULTS,
        margin: float = 2.0,
    ) -> None:
        """`grid` is by default the map of the simulation's world, `margin` m larger than what stands in it.

        Raises:
            KbotError: the robot cannot drive, or has no size.
        """
        robot, bus = simulation.robot, simulation.bus
        grid = grid or world_grid(simulation.world, margin=margin)
        around = outline(robot) if lidar is not None else None
        self.navigator = Navigator(GridPlanner(grid, turning_radius(robot)), settings, around)
        self._simulation = simulation
        self._seen = LidarPoints(lidar) if lidar is not None else None
        self._pilot: Pilot | None = None
        self._said = ""
        self._path: Path | None = None
        self._plan = bus.advertise(PLAN, PathMessage, latched=True)
        self._status = bus.advertise(STATUS, String, latched=True)
        bus.advertise(MAP, OccupancyGrid, latched=True).publish(grid.to_message())
        self._heard = [bus.subscribe(topic, PoseStamped, self._goal) for topic in GOALS]

    @property
    def is_driving(self) -> bool:
        return self._pilot is not None

    def go(self, goal: PlanarPose, timeout: float | None = None) -> None:
        """Take a goal in place of any other. Raises KbotError for a number that is not finite."""
        self.navigator.go(goal, timeout)
        self._say()
        if self._pilot is None:
            self._pilot = Pilot(self._simulation, self, seen=self._seen)

    def cancel(self, reason: str = "cancelled by its sender") -> None:
        """Give up the goal and stand still; without one nothing happens."""
        self.navigator.cancel(reason)
        self._end()

    def update(self, observation: Observation) -> Twist:
        """As a controller; called by the pilot while there is a goal."""
        wanted = self.navigator.update(observation)
        path = self.navigator.path
        if path is not None and path is not self._path:
            self._path = path
            self._plan.publish(path.to_message(self._simulation.clock.stamp))
        self._end()
        return wanted

    def close(self) -> None:
        """Hear no more goals."""
        for subscription in self._heard:
            subscription.close()
        self.cancel("navigation was closed")

    def _goal(self, message: PoseStamped) -> None:
        frame = message.header.frame_id
        if frame.lstrip("/") not in FRAMES:
            self._publish(f"refused: the goal is in the frame '{frame}', not in the map's")
            return
        try:
            self.go(from_pose_stamped(message))
        except KbotError as error:
            self._publish(f"refused: {error}")

    def _end(self) -> None:
        self._say()
        status = self.navigator.status
        if self._pilot is not None and status is not None and status.state.is_end:
            self._pilot.close()
            self._pilot = None
            self._simulation.cmd_vel(0.0, 0.0)

    def _say(self) -> None:
        if self.navigator.status is not None and str(self.navigator.status) != self._said:
            self._publish(str(self.navigator.status))

    def _publish(self, text: str) -> None:
        self._said = text
        self._status.publish(String(text))
