"""Navigation on the bus: receives goals, and publishes path, map and status on the topics of Nav2 and
rviz."""

from __future__ import annotations

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import String, Twist, TwistStamped
from kbot.messages.clock import Timer
from kbot.messages.navigation import OccupancyGrid, PoseStamped, PoseWithCovarianceStamped
from kbot.messages.navigation import Path as PathMessage
from kbot.navigation.goal_status import GoalState
from kbot.navigation.goals import Goals
from kbot.navigation.move_base_action import ACTION, ACTION_TOPICS, MoveBaseAction
from kbot.navigation.path import Path, from_pose_stamped
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world.occupancy import OccupancyGrid as Grid

GOALS = ("goal_pose", "move_base_simple/goal")
"""The topics on which rviz2 and rviz publish goals."""
PLACE = "initialpose"
PLANS = ("plan", f"{ACTION}/NavfnROS/plan")
"""The topics on which rviz2 and rviz expect the path from Nav2 and from ROS 1's move_base."""
MAP, STATUS = "map", "navigation_status"
WORLD = ("", "map", "world")
"""Frame names of goals that mean the world, because the simulation knows the true pose of its robot."""
MAP_POLL_RATE = 10.0
"""Checks per second whether a map that is being made is finished."""
TOPICS = frozenset(f"/{name}" for name in (*GOALS, *ACTION_TOPICS, PLACE, *PLANS, MAP, STATUS))


class NavigationTopics:
    """Subscribes to goals and publishes the navigation's path, map and state.

    It receives goals by the action `move_base`. A PoseStamped on `goal_pose` or `move_base_simple/goal`
    becomes a goal of the action, as in ROS. Another command of the robot cancels the goal. The path is
    published as a Path on `plan` and `move_base/NavfnROS/plan`, the map on `map`, and each change of state as
    a String on `navigation_status`. A pose estimate (`initialpose`) places the robot at that pose.

    The path and the map are in the frame of odometry, because `map` -> `odom` is left to localisation. The
    map is made when it is first needed, and again if a goal is beyond it."""

    def __init__(self, simulation: Simulation, goals: Goals | None = None) -> None:
        """`goals` receives the goals and is reported on; by default a new one is made."""
        self.goals = goals or Goals(simulation)
        self._simulation = simulation
        self._path: Path | None = None
        self._grid: Grid | None = None
        self._published = 0, ""
        """The number of the goal, and the last status published for it."""
        self._timer: Timer | None = None
        bus = simulation.bus
        robot = simulation.robots.first
        settings, naming = robot.settings, robot.naming
        self._prefix = naming.frame_prefix
        self._odometry_frame = self._prefix + (settings.odometry_frame if settings is not None else "odom")
        self._plans = [bus.advertise(topic, PathMessage, latched=True) for topic in PLANS]
        self._status = bus.advertise(STATUS, String, latched=True)
        self._map = bus.advertise(MAP, OccupancyGrid, latched=True, on_subscribe=self._map_is_wanted)
        self._action = MoveBaseAction(simulation, self.goals, self._go, self._odometry_frame)
        self._subscriptions = [bus.subscribe(topic, PoseStamped, self._action.take) for topic in GOALS]
        self._subscriptions.append(bus.subscribe(PLACE, PoseWithCovarianceStamped, self._place))
        if settings is not None:
            self._subscriptions += [
                bus.subscribe(naming.topic(topic), kind, self._driven)
                for topic, kind in settings.command_topics.items()
            ]
        self.goals.watch(self._report)

    def close(self) -> None:
        """Cancel the goal and unsubscribe."""
        for subscription in self._subscriptions:
            subscription.close()
        self.goals.cancel("navigation was closed")
        self._action.close()
        self.goals.unwatch(self._report)

    def go(self, goal: PlanarPose) -> None:
        """Drive to a goal in the world's frame. If it is refused, the reason is published."""
        try:
            self.goals.go(goal)
        except KbotError as error:
            self._refuse(error)

    def _go(self, message: PoseStamped) -> None:
        """Begin a goal. Raises KbotError: it is refused at once."""
        frame = message.header.frame_id.lstrip("/")
        try:
            self.goals.go(self._in_world(from_pose_stamped(message), frame))
        except KbotError as error:
            self._refuse(error)
            raise

    def _place(self, message: PoseWithCovarianceStamped) -> None:
        pose = from_pose_stamped(PoseStamped(message.header, message.pose.pose))
        try:
            self.goals.place(self._in_world(pose, message.header.frame_id.lstrip("/")))
        except KbotError as error:
            self._refuse(error)

    def _in_world(self, pose: PlanarPose, frame: str) -> PlanarPose:
        """A pose in a frame of the robot, its odometry or the world. Raises KbotError for another frame."""
        simulation = self._simulation
        if frame in WORLD:
            return pose
        if frame == self._odometry_frame:
            return self._world_from_odom() @ pose
        link = frame.removeprefix(self._prefix)
        if link in simulation.robot.links:
            place = simulation.link_pose(link)
            x, y, _ = place.translation.tolist()
            return PlanarPose(x, y, place.yaw) @ pose
        known = [*WORLD[1:], self._odometry_frame, *simulation.robot.links]
        hint = did_you_mean(frame, known)
        raise KbotError(
            f"the goal is in the frame '{frame}', which does not exist" + (f": {hint}" if hint else "")
        )

    def _world_from_odom(self) -> PlanarPose:
        simulation = self._simulation
        return simulation.ground_truth.pose @ simulation.odometry.pose.inverse()

    def _driven(self, message: Twist | TwistStamped) -> None:
        message = message if isinstance(message, Twist) else message.twist
        if message.linear.x or message.linear.y or message.angular.z:
            self.goals.give_way("another command drives the robot")

    def _map_is_wanted(self) -> None:
        """For the first subscriber of the map, publish it as soon as it is made."""
        try:
            self.goals.prepare()
        except KbotError:
            return  # there is no map for a robot that cannot drive
        self._publish_map()
        if self._grid is None:
            self._timer = self._simulation.clock.every(MAP_POLL_RATE, self._publish_map)

    def _publish_map(self) -> None:
        """Publish the map if it is a new one."""
        grid = self.goals.grid
        if grid is None or grid is self._grid:
            return
        self._grid = grid
        odom_from_world = self._world_from_odom().inverse()
        placed = Grid(grid.cells, grid.resolution, odom_from_world @ grid.origin, self._odometry_frame)
        self._map.publish(placed.to_message(self._simulation.clock.stamp))
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _report(self) -> None:
        """Publish what has changed of map, path and status."""
        self._publish_map()
        path = self.goals.path
        if path is not None and path is not self._path:
            self._path = path
            placed = path.seen_from(self._world_from_odom(), self._odometry_frame)
            for plan in self._plans:
                plan.publish(placed.to_message(self._simulation.clock.stamp))
        current = self.goals.count, str(self.goals.status)
        if self.goals.status is not None and current != self._published:
            self._publish_status(current[1])

    def _refuse(self, error: KbotError) -> None:
        self._publish_status(f"{GoalState.REFUSED}: {error}")

    def _publish_status(self, text: str) -> None:
        self._published = self.goals.count, text
        self._status.publish(String(text))
