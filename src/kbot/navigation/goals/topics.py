"""Navigation on the bus: receives goals, and publishes path, map and status on the topics of Nav2 and
rviz."""

from __future__ import annotations

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.messages import Header, String, Twist, TwistStamped
from kbot.messages.bus import Publisher
from kbot.messages.clock import Timer
from kbot.messages.navigation import OccupancyGrid, PoseStamped, PoseWithCovarianceStamped
from kbot.messages.navigation import Path as PathMessage
from kbot.navigation.goal_status import GoalState
from kbot.navigation.goals.goals import Goals
from kbot.navigation.goals.move_base_action import ACTION, ACTION_TOPICS, MoveBaseAction
from kbot.navigation.path import Path, from_pose_stamped, to_pose_stamped
from kbot.sim import Simulation
from kbot.sim.topics import odometry_frames
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.tf.foreign_frames import ForeignFrames
from kbot.world.occupancy import OccupancyGrid as Grid

GOALS = ("goal_pose", "move_base_simple/goal")
"""The topics on which rviz2 and rviz publish goals."""
PLACE = "initialpose"
PLANS = ("plan", f"{ACTION}/NavfnROS/plan")
"""The topics on which rviz2 and rviz expect the path from Nav2 and from ROS 1's move_base."""
CURRENT_GOAL = f"{ACTION}/current_goal"
"""The topic on which rviz expects the current goal from ROS 1's move_base."""
COSTMAPS = (f"{ACTION}/local_costmap/costmap", "local_costmap/costmap")
"""The topics on which rviz and rviz2 expect the costs around the robot."""
MAP, STATUS = "map", "navigation_status"
WORLD = ("", "map", "world")
"""Frame names of goals that mean the world, because the simulation knows the true pose of its robot."""
MAP_POLL_RATE = 10.0
"""Checks per second whether a map that is being made is finished."""
TOPICS = frozenset(
    f"/{name}" for name in (*GOALS, *ACTION_TOPICS, PLACE, *PLANS, CURRENT_GOAL, *COSTMAPS, MAP, STATUS)
)


class NavigationTopics(Brief):
    """Subscribes to goals and publishes the navigation's path, map and state.

    It receives goals by the action `move_base`. A PoseStamped on `goal_pose` or `move_base_simple/goal`
    becomes a goal of the action, as in ROS. Another command of the robot cancels the goal. The goal is
    published as a PoseStamped on `move_base/current_goal`, the path as a Path on `plan` and
    `move_base/NavfnROS/plan` unless the navigation plans none, the map on `map`, and each change of state as
    a String on `navigation_status`. Without a map, the costs around the robot are published with each path. A
    pose estimate (`initialpose`) places the robot at that pose.

    The goal, the path, the map and the costs are in the frame of odometry, because `map` -> `odom` is left to
    localisation. The map is made when it is first needed, and again if a goal is beyond it."""

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
        self._prefix = robot.naming.frame_prefix
        self._odometry_frame, *_ = odometry_frames(robot)
        self._goal = bus.advertise(CURRENT_GOAL, PoseStamped, latched=True)
        plans = PLANS if self.goals.plans else ()
        self._plans = [bus.advertise(topic, PathMessage, latched=True) for topic in plans]
        self._status = bus.advertise(STATUS, String, latched=True)
        self._frames = ForeignFrames(bus)
        self._frames.subscribe()
        self._map: Publisher[OccupancyGrid] | None = None
        self._costmaps: list[Publisher[OccupancyGrid]] = []
        if self.goals.has_map:
            self._map = bus.advertise(MAP, OccupancyGrid, latched=True, on_subscribe=self._map_is_wanted)
        if self.goals.has_costs:
            self._costmaps = [bus.advertise(topic, OccupancyGrid) for topic in COSTMAPS]
        self._action = MoveBaseAction(simulation, self.goals, self._go, self._odometry_frame)
        self._subscriptions = [bus.subscribe(topic, PoseStamped, self._action.take) for topic in GOALS]
        self._subscriptions.append(bus.subscribe(PLACE, PoseWithCovarianceStamped, self._place))
        if robot.settings is not None:
            self._subscriptions += [
                bus.subscribe(robot.naming.topic(topic), kind, self._driven)
                for topic, kind in robot.settings.command_topics.items()
            ]
        self.goals.watch(self._report)

    def close(self) -> None:
        """Cancel the goal and unsubscribe."""
        for subscription in self._subscriptions:
            subscription.close()
        self.goals.cancel("navigation was closed")
        self._action.close()
        self.goals.unwatch(self._report)

    def go(self, goal: PlanarPose, *, any_heading: bool = False) -> None:
        """Begin a goal in the world's frame. Raises KbotError: it is refused at once, which is published."""
        try:
            self.goals.go(goal, any_heading=any_heading)
        except KbotError as error:
            self._refuse(error)
            raise

    def _go(self, message: PoseStamped) -> None:
        try:
            goal = self._in_world(from_pose_stamped(message), message.header.frame_id.lstrip("/"))
        except KbotError as error:
            self._refuse(error)
            raise
        self.go(goal)

    def _place(self, message: PoseWithCovarianceStamped) -> None:
        pose = from_pose_stamped(PoseStamped(message.header, message.pose.pose))
        try:
            self.goals.place(self._in_world(pose, message.header.frame_id.lstrip("/")))
        except KbotError as error:
            self._refuse(error)

    def _in_world(self, pose: PlanarPose, frame: str) -> PlanarPose:
        """A pose in the world, in a frame of the robot or its odometry, or in a frame that is connected to
        these on `/tf`. Raises KbotError for another frame."""
        simulation = self._simulation
        if frame in WORLD:
            return pose
        if frame == self._odometry_frame:
            return self._world_from_odom() @ pose
        link = frame.removeprefix(self._prefix)
        if link in simulation.robot.links:
            return self._known(simulation.link_pose(link)) @ pose
        world_from_odom = simulation.ground_truth.pose @ simulation.odometry.pose.inverse()
        x, y, yaw = world_from_odom.x, world_from_odom.y, world_from_odom.yaw
        place = Transform.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw))
        own = {self._odometry_frame: (WORLD[-1], place)}
        links = {self._prefix + name: place for name, place in simulation.link_poses().items()}
        foreign = self._frames.poses(links, own)
        if frame in foreign:
            return self._known(foreign[frame][1]) @ pose
        known = [*WORLD[1:], self._odometry_frame, *simulation.robot.links, *foreign]
        hint = did_you_mean(frame, known)
        raise KbotError(
            f"the goal is in the frame '{frame}', which does not exist" + (f": {hint}" if hint else "")
        )

    def _known(self, place: Transform) -> PlanarPose:
        """Where a place in the world is as far as the navigation knows. It sees the place from the robot."""
        x, y, _ = place.translation.tolist()
        true = PlanarPose(x, y, place.yaw)
        if self.goals.has_map:
            return true
        return self.goals.pose @ (self._simulation.ground_truth.pose.inverse() @ true)

    def _world_from_odom(self) -> PlanarPose:
        return self.goals.pose @ self._simulation.odometry.pose.inverse()

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
        grid = self.goals.grid if self._map is not None else None
        if self._map is None or grid is None or grid is self._grid:
            return
        self._grid = grid
        self._map.publish(self._in_odometry(grid))
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _publish_costmap(self) -> None:
        wanted = [costmap for costmap in self._costmaps if costmap.has_subscribers]
        grid = self.goals.grid if wanted else None
        if grid is not None:
            message = self._in_odometry(grid)
            for costmap in wanted:
                costmap.publish(message)

    def _in_odometry(self, grid: Grid) -> OccupancyGrid:
        odom_from_world = self._world_from_odom().inverse()
        placed = Grid(grid.cells, grid.resolution, odom_from_world @ grid.origin, self._odometry_frame)
        return placed.to_message(self._simulation.clock.stamp)

    def _report(self) -> None:
        """Publish what has changed of map, path and status."""
        self._publish_map()
        path = self.goals.path
        if path is not None and path is not self._path:
            self._path = path
            placed = path.seen_from(self._world_from_odom(), self._odometry_frame)
            for plan in self._plans:
                plan.publish(placed.to_message(self._simulation.clock.stamp))
            self._publish_costmap()
        status = self.goals.status
        current = self.goals.count, str(status)
        if status is not None and current != self._published:
            if self.goals.count != self._published[0]:
                seen = self._world_from_odom().inverse() @ status.goal
                header = Header(self._simulation.clock.stamp, self._odometry_frame)
                self._goal.publish(to_pose_stamped(seen, header))
            self._publish_status(current[1])

    def _refuse(self, error: KbotError) -> None:
        self._publish_status(f"{GoalState.REFUSED}: {error}")

    def _publish_status(self, text: str) -> None:
        self._published = self.goals.count, text
        self._status.publish(String(text))
