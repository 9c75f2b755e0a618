"""Drives to a goal without a map: keeps a grid of what the lidars detect, finds the way on it, and
recovers."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist, Vector3
from kbot.messages.sensing import LaserScan
from kbot.navigation.controller import GENTLE, STILL, ControllerLimits, Observation, twist
from kbot.navigation.followers.go_to_pose import GoToPose
from kbot.navigation.followers.obstacle_guard import ObstacleGuard
from kbot.navigation.followers.path_follower import PathFollower
from kbot.navigation.goal_checks import require_goal, require_timeout
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.perception.moving_obstacles import MovingObstacle, MovingObstacles
from kbot.navigation.perception.rolling_grid import RollingGrid, SensorPlace
from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.navigation.space.cost_to_go import CostToGo, Sweeping, costs, halved, weights
from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint import Outline
from kbot.navigation.space.footprint_clearance import FootprintClearance
from kbot.navigation.without_map.approach import Approaches
from kbot.navigation.without_map.sampling_by_base import sampling_for
from kbot.navigation.without_map.trajectory_sampling import SamplingSettings
from kbot.text import KbotError

_FINEST, _COARSEST = 0.02, 0.05
"""m. Limits of a cell's edge. A smaller robot needs smaller cells, which show less of the surroundings."""
_CELLS_PER_RADIUS = 4.0
"""Cells from the robot's middle to its nearest side."""
_FINAL = 0.3
"""m. Nearer to the goal, the robot drives straight to it, because samples of the speed do not hit a point."""
_STOPS_WITHIN = 0.05
"""m. A robot stops this near to a point by its own estimate even if it is fast."""
_STRAIGHT = 2.0
"""It does so if the way is at most this many times as long as the straight line."""

_BESIDE, _SUSPECT = 0.3, 3.0
"""Shares of the outline's outer radius: within the first from its outline, a robot that is blind to the rear
may turn, and up to the second, it expects obstacles where it does not see."""
_TRIES_AGAIN = 0.05
"""m. A base that had no direct way to the goal tries again after it has moved by this."""
_BASE = PlanarPose()

_WIDER = 0.04
"""m by which a way must be wider on each side after two failed attempts, so that another one is tried."""

Scans = Sequence[tuple[LaserScan, SensorPlace]]


@dataclass(frozen=True, slots=True)
class LocalSettings:
    """Limits of a goal without a map.

    rate      control ticks per second
    settle    seconds before the robot moves, in which a gyroscope's bias is measured
    margin    m that the way keeps around the outline
    room      m beyond it in which a way costs more
    patience  seconds without progress before the robot recovers
    attempts  how often it does so
    back_up   seconds that it backs up or turns
    silence   seconds without a scan after which the robot is stuck; it stops earlier
    frozen    seconds of a command to drive after which the odometry must have changed
    lost      seconds after which scans that do not fit the surroundings end the goal
    slack     how many times the straight line's time at full speed a goal may take
    grace     seconds more than that
    sampling  of the controller; its margin is at least `margin` and half a cell
    """

    rate: float = 20.0
    settle: float = 0.5
    margin: float = 0.03
    room: float = 0.4
    patience: float = 4.0
    attempts: int = 6
    back_up: float = 1.5
    silence: float = 2.0
    frozen: float = 0.6
    lost: float = 0.3
    slack: float = 8.0
    grace: float = 60.0
    sampling: SamplingSettings = field(default_factory=SamplingSettings)


@dataclass
class _Run:
    """The state of one goal."""

    goal: PlanarPose
    any_heading: bool
    arrive: float
    timeout: float | None
    begun: float = math.nan
    deadline: float = math.inf
    final: ObstacleGuard | None = None
    approach: PathFollower | None = None
    approach_tried: tuple[float, float] = (math.inf, math.inf)
    """Where the robot was when it last had no direct way to the goal."""
    stood: bool = False
    """Whether the robot has stopped for the approach."""
    attempts: int = 0
    closures: int = 0
    recovering_until: float = -math.inf
    recovery: tuple[float, float] = (0.0, 0.0)
    closed_since: float | None = None


class LocalNavigator:
    """A controller that drives to goals with what lidars and odometry measure.

    `update` takes an observation with the estimated pose, and the new scans. `status` is the state of the
    current goal. The robot stops by its own estimate, well within the arrival radius."""

    def __init__(
        self,
        outline: Outline,
        limits: MotionLimits,
        lidar_rate: float,
        settings: LocalSettings = LocalSettings(),
        seed: int = 0,
        point: PlanarPose = _BASE,
        approaches: Approaches | None = None,
        is_blind: bool = False,
    ) -> None:
        """Drive to goals.

        Args: outline: of the robot, in the frame of `point`. limits: of speeds. lidar_rate: in Hz; the robot
        stops without a scan for the time of 2.5 scans, at least 0.2 s. settings: of the navigator. seed: of
        the samples. point: of the base's frame that commands move. approaches: the last metres to a goal, for
        a base that does not turn on the spot. is_blind: the lidars do not see all around, so the robot avoids
        what is beside and behind it at the start until it has seen it."""
        self.limits, self.settings = limits, settings
        self._point, self._approaches, self._is_blind = point, approaches, is_blind
        self.status: GoalReport | None = None
        inner = FootprintClearance(outline, 1.0).inner
        resolution = min(max(inner / _CELLS_PER_RADIUS, _FINEST), _COARSEST)
        self.grid = RollingGrid(resolution)
        self._footprint = FootprintClearance(outline, 1.5 * resolution)
        self._outline = outline
        # a cell counts from its middle, but a beam may have ended anywhere in it
        margin = settings.margin + 0.5 * resolution
        self._radius = self._footprint.inner + margin
        self.sampling = sampling = replace(settings.sampling, margin=max(margin, settings.sampling.margin))
        self._sampling = sampling_for(self._footprint, limits, sampling, seed)
        self._most = self._footprint.outer + sampling.margin + sampling.room
        self._reach = limits.linear * sampling.time_steps * sampling.model_dt + self._footprint.outer
        self._pause = max(0.2, 2.5 / lidar_rate)
        self._sweeping: Sweeping | None = None
        self._cost_to_go: CostToGo | None = None
        self._moving: dict[str, MovingObstacles] = {}
        self._scans: dict[str, tuple[LaserScan, SensorPlace]] = {}
        """The last one of each lidar."""
        self._commanded = STILL
        self._track: deque[tuple[float, float, float]] = deque()
        self._run: _Run | None = None

    def go(
        self,
        goal: PlanarPose,
        any_heading: bool = False,
        arrive: float = GENTLE.distance,
        timeout: float | None = None,
    ) -> GoalReport:
        """Replace the current goal; `arrive` in m is the radius in which the goal is reached.

        Raises: KbotError: a number is not finite, the goal is too far away, or `arrive` or the timeout is not
        above 0."""
        require_goal(goal)
        if not (math.isfinite(arrive) and arrive > 0.0):
            raise KbotError(f"the arrival radius must be a finite number of metres above 0, not {arrive}")
        require_timeout(timeout)
        self._moving.clear()
        self._run = _Run(goal, any_heading, arrive, timeout)
        self._sweeping = self._cost_to_go = None
        self._sampling.restart()
        self.status = GoalReport(goal, GoalState.ACCEPTED)
        return self.status

    def cancel(self, reason: str = "cancelled by its sender") -> None:
        """Cancel the goal, if there is one. The robot stops at the next update."""
        if self._run is not None:
            self._end(GoalState.CANCELLED, reason)

    def refuse(self, reason: str) -> None:
        """Refuse the goal, if there is one, for a reason that the navigator does not know."""
        if self._run is not None:
            self._end(GoalState.REFUSED, reason)

    @property
    def is_driving(self) -> bool:
        """Whether there is a goal that has not ended."""
        return self._run is not None

    @property
    def cost_to_go(self) -> CostToGo | None:
        """The lengths of the ways to the goal, as last computed; None before that."""
        return self._cost_to_go

    def costs(self) -> NDArray[np.int8]:
        """The costs of the cells of the grid, as in a costmap of ROS."""
        return costs(self.grid.occupied, self.grid.resolution, self._radius, self.settings.room)

    def update(self, observation: Observation, scans: Scans = ()) -> Twist:
        """The command until the next tick. `scans` are new, each with the place of its lidar when it
        measured."""
        self._commanded = self._update(observation.seen_from(self._point), scans)
        return self._commanded

    def _update(self, observation: Observation, scans: Scans) -> Twist:
        run = self._run
        if run is None:
            return STILL
        if math.isnan(run.begun):
            self._begin(run, observation)
        if observation.fallen or observation.fault:
            return self._end(GoalState.STUCK, observation.fallen or observation.fault)
        pose = observation.pose
        self.grid.center_on(pose.x, pose.y)
        for scan, place in scans:
            self.grid.add(scan, place)
            self._scans[scan.header.frame_id] = scan, place
            self._moving.setdefault(scan.header.frame_id, MovingObstacles()).add(scan, place)
        return self._wanted(run, observation)

    @property
    def moving(self) -> list[MovingObstacle]:
        """The obstacles that move, in the frame of the pose estimate. None are known without a goal."""
        return [obstacle for lidar in self._moving.values() for obstacle in lidar.obstacles]

    def _begin(self, run: _Run, observation: Observation) -> None:
        run.begun = observation.time
        straight = math.hypot(run.goal.x - observation.pose.x, run.goal.y - observation.pose.y)
        settings = self.settings
        bound = run.timeout or settings.slack * straight / self.limits.linear + settings.grace
        run.deadline = run.begun + bound
        if self._is_blind:
            self.grid.center_on(observation.pose.x, observation.pose.y)
            own = self._outline.grown(_BESIDE * self._footprint.outer)
            self.grid.suspect(observation.pose, own, _SUSPECT * self._footprint.outer)
        self._restart_progress(observation)

    def _wanted(self, run: _Run, observation: Observation) -> Twist:
        time, settings = observation.time, self.settings
        if time > run.deadline:
            left = math.hypot(run.goal.x - observation.pose.x, run.goal.y - observation.pose.y)
            return self._end(
                GoalState.STUCK,
                f"out of time: not at the goal after {time - run.begun:.1f} s, {left:.2f} m left",
            )
        silence = min(observation.obstacles_age, time - run.begun)
        if observation.obstacles_age > self._pause:
            self._sampling.restart()
            if silence > settings.silence:
                return self._end(GoalState.STUCK, f"the lidar has been silent for {silence:.1f} s")
            return STILL
        if time < run.begun + settings.settle:
            self._replan(run)
            return STILL
        self._replan(run)
        while self._cost_to_go is None:
            self._replan(run)
        cost_to_go = self._cost_to_go
        pose = observation.pose
        if run.final is not None or self._is_near(run, pose, cost_to_go):
            if run.approach is None:
                run.approach = self._make_approach(run, observation)
            if run.approach is not None and run.final is None and not self._may_begin(run, observation):
                return STILL
            if run.approach is not None:
                return self._approach(run, run.approach, observation)
            if run.any_heading and self._left(run, pose) <= self._tolerance(run):
                return self._end(GoalState.REACHED, "") if observation.is_at_rest else STILL
        if cost_to_go.is_blocked(pose.x, pose.y, self._footprint.outer):
            return self._wait_for_a_way(run, observation)
        run.closed_since = None
        field = self._field(pose)
        if time < run.recovering_until:
            return self._hold(run, observation, field)
        last = self._commanded.linear.x, self._commanded.angular.z
        period = 1.0 / settings.rate
        v, w = self._sampling.update(pose, observation.twist, field, cost_to_go, period, last, self.moving)
        if self._is_stalled(observation):
            return self._recover(run, observation)
        if self.status is not None and self.status.state is GoalState.ACCEPTED:
            self.status = GoalReport(run.goal, GoalState.DRIVING)
        return Twist(Vector3(v, self._sampling.lateral, 0.0), Vector3(0.0, 0.0, w))

    def _replan(self, run: _Run) -> None:
        """Continue to compute the cost-to-go: a share of the work per tick."""
        if self._sweeping is None:
            weight = halved(
                weights(
                    self.grid.occupied,
                    self.grid.resolution,
                    self._radius + _WIDER * (run.attempts // 2),
                    self.settings.room,
                )
            )
            goal = run.goal.x, run.goal.y
            self._sweeping = Sweeping(
                weight, self.grid.corner, 2.0 * self.grid.resolution, goal, self._tolerance(run)
            )
            return
        self._sweeping.sweep()
        if self._sweeping.is_done:
            self._cost_to_go = self._sweeping.result()
            self._sweeping = None

    def _field(self, pose: PlanarPose) -> DistanceField:
        """The distances to obstacles wherever a sampled trajectory may lead."""
        occupied, corner = self.grid.around(pose.x, pose.y, self._reach)
        return DistanceField.of(occupied, corner, self.grid.resolution, self._most)

    def _tolerance(self, run: _Run) -> float:
        """The estimated distance in m at which the robot stops. The rest of the radius is for the estimate's
        error: half of a small radius, since a robot does not stop more exactly, and more of a large one."""
        return min(run.arrive / 2.0, max(run.arrive / 4.0, _STOPS_WITHIN))

    def _is_near(self, run: _Run, pose: PlanarPose, cost_to_go: CostToGo) -> bool:
        """Whether the robot is at the goal, or so near that it drives straight to it."""
        left = self._left(run, pose)
        if left <= self._tolerance(run):
            return True
        if self._approaches is not None and left <= self._approaches.distance:
            return True
        way = float(cost_to_go.at(np.array([pose.x]), np.array([pose.y]))[0])
        return left <= _FINAL and way <= _STRAIGHT * left + 2.0 * self.grid.resolution

    def _may_begin(self, run: _Run, observation: Observation) -> bool:
        """Whether the approach may begin. A base that does not turn on the spot stops first, and then makes
        it again from where it is."""
        if self._approaches is None or run.stood:
            return True
        run.approach, run.stood = None, observation.is_at_rest
        run.approach_tried = (math.inf, math.inf)
        return False

    def _left(self, run: _Run, pose: PlanarPose) -> float:
        """The distance in m of the base from the goal, if `point` is at a pose."""
        base = pose @ self._point.inverse()
        return math.hypot(run.goal.x - base.x, run.goal.y - base.y)

    def _make_approach(self, run: _Run, observation: Observation) -> PathFollower | None:
        """The controller for the last metres. None without a direct way to the goal. A base that turns on the
        spot always has one."""
        limits = ControllerLimits(
            linear=min(GENTLE.linear, self.limits.linear),
            angular=min(GENTLE.angular, self.limits.angular),
            braking=min(GENTLE.braking, self.limits.acceleration),
            turn_braking=min(GENTLE.turn_braking, self.limits.angular_acceleration),
            distance=self._tolerance(run),
        )
        if self._approaches is None:
            return GoToPose(run.goal, limits, run.any_heading)
        pose, (x, y) = observation.pose, run.approach_tried
        if math.hypot(pose.x - x, pose.y - y) < _TRIES_AGAIN:
            return None
        run.approach_tried, run.stood = (pose.x, pose.y), run.stood and observation.is_at_rest
        reach = 2.0 * self._approaches.distance + self._footprint.outer
        occupied, corner = self.grid.around(pose.x, pose.y, reach)
        field = DistanceField.of(occupied, corner, self.grid.resolution, self._most)

        def is_free(poses: NDArray[np.float64]) -> bool:
            clearance = self._footprint.of(field, *poses.T)
            return bool((clearance >= min(self._sampling.settings.margin, float(clearance[0]) - 1e-6)).all())

        goal = run.goal @ self._point
        return self._approaches.make(pose, goal, run.any_heading, limits, is_free)

    def _approach(self, run: _Run, approach: PathFollower, observation: Observation) -> Twist:
        """Drive directly to the goal and to its heading, and end."""
        if run.final is None:
            braking = min(GENTLE.braking, self.limits.acceleration)
            run.final = ObstacleGuard(approach, self._outline, braking=braking, silence=self._pause)
            self._restart_progress(observation)
        wanted = run.final.update(observation)
        if approach.is_done:
            return self._end(GoalState.REACHED, "")
        blocked = run.final.blocked_since
        if blocked is not None and observation.time - blocked > self.settings.patience:
            return self._end(
                GoalState.STUCK, f"an obstacle is in the way, {approach.remaining:.2f} m before the goal"
            )
        return wanted

    def _wait_for_a_way(self, run: _Run, observation: Observation) -> Twist:
        """Obstacles leave no way: wait, and forget what was detected before. Give up if they still do."""
        if run.closed_since is None:
            run.closed_since = observation.time
        if observation.time - run.closed_since < self.settings.patience:
            return STILL
        run.closed_since = None
        run.closures += 1
        if run.closures > 1:
            return self._end(GoalState.STUCK, self._why_closed(run))
        self.grid.clear()
        self._sweeping = None
        return STILL

    def _why_closed(self, run: _Run) -> str:
        goal = run.goal
        occupied, corner = self.grid.around(goal.x, goal.y, 2.0 * self._footprint.outer)
        if occupied.size:
            field = DistanceField.of(occupied, corner, self.grid.resolution, self._most)
            if field.at(np.array([goal.x]), np.array([goal.y]))[0] < self._radius:
                return "the goal is inside or too near an obstacle that the lidar detected"
        return "the obstacles that the lidar detected leave no way to the goal that is wide enough"

    def _restart_progress(self, observation: Observation) -> None:
        self._track.clear()
        self._track.append((observation.time, observation.pose.x, observation.pose.y))

    def _is_stalled(self, observation: Observation) -> bool:
        """Whether the robot has stayed within its own radius for `patience`. A robot that returns from a dead
        end has not."""
        time, pose, track = observation.time, observation.pose, self._track
        track.append((time, pose.x, pose.y))
        while len(track) > 1 and track[1][0] <= time - self.settings.patience:
            track.popleft()
        if time - track[0][0] < self.settings.patience:
            return False
        return all(math.hypot(pose.x - x, pose.y - y) < self._footprint.outer for _, x, y in track)

    def _recover(self, run: _Run, observation: Observation) -> Twist:
        """Back up or turn, alternately, and look again. Give up after `attempts` times."""
        if run.attempts >= self.settings.attempts:
            what = "an obstacle is in the way" if self._sampling.is_blocked else "the robot makes no progress"
            left = math.hypot(run.goal.x - observation.pose.x, run.goal.y - observation.pose.y)
            return self._end(
                GoalState.STUCK, f"{what}: tried {run.attempts + 1} times, {left:.2f} m from the goal"
            )
        backwards = -0.15 * self.limits.linear, 0.0
        side = 1.0 if run.attempts % 4 < 2 else -1.0
        turn = 0.0, side * 0.25 * self.limits.angular
        if math.isfinite(self.limits.curvature):  # turn in reverse
            turn = backwards[0], side * backwards[0] * self.limits.curvature
        run.recovery = backwards if run.attempts % 2 == 0 else turn
        run.attempts += 1
        run.recovering_until = observation.time + self.settings.back_up
        if run.attempts % 2 == 0:
            self._look_again()
        self._sampling.restart()
        self._restart_progress(observation)
        return STILL

    def _look_again(self) -> None:
        """Forget what the lidars see now: errors of the pose estimate have made it thicker than it is.

        What they do not see is kept, because the robot may back up to it."""
        for scan, place in self._scans.values():
            self.grid.forget_seen(scan, place)
        self._sweeping = None

    def _hold(self, run: _Run, observation: Observation, field: DistanceField) -> Twist:
        """Continue a recovery while it is free of obstacles."""
        self._restart_progress(observation)
        if self._sampling.is_free(observation.pose, observation.twist, run.recovery, field):
            return twist(*run.recovery)
        run.recovering_until = -math.inf
        return STILL

    def _end(self, state: GoalState, reason: str) -> Twist:
        assert self._run is not None
        self.status = GoalReport(self._run.goal, state, reason)
        self._run = None
        return STILL
