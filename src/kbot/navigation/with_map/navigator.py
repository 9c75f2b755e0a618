"""Drives a robot to a goal on a map: plans a path, follows it, and recovers if the robot is stuck."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

from kbot.brief import Brief
from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, STILL, ControllerLimits, Observation, twist
from kbot.navigation.followers.go_to_pose import GoToPose
from kbot.navigation.followers.obstacle_guard import ObstacleGuard
from kbot.navigation.followers.path_follower import Guidance, PathFollower
from kbot.navigation.followers.pure_pursuit import RegulatedPurePursuit
from kbot.navigation.goal_checks import require_goal, require_timeout
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.path import Path
from kbot.navigation.planning.planner import NoPath, Planner
from kbot.navigation.space.footprint import Outline
from kbot.navigation.with_map.progress_checker import ProgressChecker
from kbot.navigation.with_map.turning_centre import TurningCentre


@dataclass(frozen=True, slots=True)
class NavigatorSettings:
    """Limits that end every goal.

    limits       of speed and braking, and when a goal is reached
    patience     seconds without progress before the robot backs up and plans again
    attempts     how often it does so
    back_up      distance in m by which it backs up
    corrections  how often a robot that is off the goal after its last turn is sent there again
    silence      seconds without a scan of the lidar after which the robot is stuck
    slack        how many times the time that its path needs at full speed a goal may take
    grace        seconds more than that
    """

    limits: ControllerLimits = GENTLE
    patience: float = 4.0
    attempts: int = 3
    back_up: float = 0.15
    corrections: int = 5
    silence: float = 2.0
    slack: float = 4.0
    grace: float = 20.0


DEFAULTS = NavigatorSettings()

_MOST_CUSPS = 6
"""The time limit of a path with headings allows for as many stops."""
_BACKWARDS = 0.1
"""Speed in m/s with which the robot backs up."""
_BASE = PlanarPose()
"""The base's origin in the base's frame."""


def _follow(path: Path, limits: ControllerLimits) -> PathFollower:
    """Regulated pure pursuit that cuts corners by less than the free room beside the path."""
    room = 0.06 if path.margin is None else path.margin
    return RegulatedPurePursuit(path, limits, lookahead=min(0.15, max(0.06, 2.5 * room)))


@dataclass
class _Run:
    """The state of one goal."""

    goal: PlanarPose
    limits: ControllerLimits
    begun: float = math.nan
    deadline: float = math.inf
    follower: PathFollower | None = None
    attempts: int = 0
    corrections: int = 0
    backing_until: float = -math.inf
    learned: PlanarPose = _BASE
    """The turning centre that was known when the path was planned."""
    guided: PlanarPose = _BASE
    """The point of the base's frame that follows the path."""


class Navigator(Brief):
    """A controller that drives to goals. `status` is the state of the current goal, and `path` its path."""

    def __init__(
        self,
        planner: Planner | None,
        settings: NavigatorSettings = DEFAULTS,
        outline: Outline | None = None,
        guidance: Guidance | None = None,
    ) -> None:
        """Drive to goals.

        Args: planner: finds paths; without one every goal is refused. settings: limits for each goal.
        outline: of the robot; if given, the robot stops before obstacles that a lidar detects, and while the
        lidar is silent. guidance: of a base that does not turn on the spot to follow a path; the outline is
        then in the frame of its point."""
        self.planner, self.settings = planner, settings
        self.guidance = guidance
        self.path: Path | None = None
        self.status: GoalReport | None = None
        self._progress = ProgressChecker(settings.patience)
        self._turning_centre = TurningCentre()
        self._guard: ObstacleGuard | None = None
        if outline is not None:
            self.guard_with_lidar(outline)
        self._run: _Run | None = None
        self._timeout: float | None = None

    def go(self, goal: PlanarPose, timeout: float | None = None, any_heading: bool = False) -> GoalReport:
        """Replace the current goal; `timeout` in s replaces the time limit from the path's length. With
        `any_heading`, the goal's yaw does not matter.

        Raises:
            KbotError: a number is not finite, the goal is too far away, or the timeout is not above 0.
        """
        require_goal(goal)
        require_timeout(timeout)
        self._turning_centre.interrupt()
        self.path, self._timeout = None, timeout
        limits = self.settings.limits
        if any_heading:
            limits = replace(limits, angle=math.pi)  # no heading is further off
        self._run = _Run(goal, limits)
        return self._report(GoalState.ACCEPTED)

    def guard_with_lidar(self, outline: Outline, rate: float = 20.0) -> None:
        """Stop the robot before obstacles that a lidar with a rate in Hz detects, and while the lidar is
        silent.

        It is silent if there is no scan for the time of 2.5 scans, or for 0.5 s if that is longer.
        """
        braking, silence = self.settings.limits.braking, max(0.5, 2.5 / rate)
        self._guard = ObstacleGuard(_StandStill(), outline, braking=braking, silence=silence)

    def cancel(self, reason: str = "cancelled by its sender") -> None:
        """Cancel the goal, if there is one. The robot stops at the next update."""
        if self._run is not None:
            self._end(GoalState.CANCELLED, reason)

    def refuse(self, reason: str) -> None:
        """Refuse the goal, if there is one, for a reason that the navigator does not know."""
        if self._run is not None:
            self._end(GoalState.REFUSED, reason)

    def update(self, observation: Observation) -> Twist:
        if self.guidance is not None:
            return self._update(observation.seen_from(self.guidance.point))
        wanted = self._update(observation)
        self._turning_centre.watch(observation, wanted)
        return wanted

    def _update(self, observation: Observation) -> Twist:
        run, settings = self._run, self.settings
        if run is None:
            return STILL
        if math.isnan(run.begun):
            run.begun = observation.time
        if observation.fallen:
            return self._end(GoalState.STUCK, observation.fallen)
        if observation.time < run.backing_until:
            return self._guarded(observation, twist(-_BACKWARDS, 0.0))
        if self._needs_path(run) and not self._plan(run, observation):
            return STILL
        if observation.time > run.deadline:
            took = observation.time - run.begun
            return self._end(
                GoalState.STUCK, f"out of time: not at the goal after {took:.1f} s, {self._left(run)} left"
            )
        follower = run.follower
        assert follower is not None
        wanted = follower.update(observation.of_point(run.guided))
        if follower.is_done:
            return self._arrive(run, observation)
        allowed = self._guarded(observation, wanted)
        guard = self._guard
        silent_since = guard.silent_since if guard else None
        if silent_since is not None:
            silence = observation.time - silent_since
            if silence > settings.silence:
                return self._end(GoalState.STUCK, f"the lidar has been silent for {silence:.1f} s")
            return allowed
        if self._progress.is_stalled(observation.time, follower.remaining, follower.heading_error):
            return self._recover(run, observation)
        return allowed

    def _needs_path(self, run: _Run) -> bool:
        """Whether there is no path yet, or the turning centre has changed since the last plan."""
        centre, known = self._turning_centre.in_base, run.learned
        learned = math.hypot(centre.x - known.x, centre.y - known.y)
        return run.follower is None or learned > self.settings.limits.distance

    def _arrive(self, run: _Run, observation: Observation) -> Twist:
        """Once the robot is at rest, end the goal if it is reached, else plan a correction."""
        if not observation.is_at_rest:
            return STILL
        limits, pose, goal = run.limits, observation.pose, run.goal
        if self.guidance is not None:
            pose = pose @ self.guidance.point.inverse()
        off = math.hypot(goal.x - pose.x, goal.y - pose.y)
        turned = abs(wrap(goal.yaw - pose.yaw))
        if off <= limits.distance and turned <= limits.angle:
            return self._end(GoalState.REACHED, "")
        if run.corrections >= self.settings.corrections:
            return self._end(
                GoalState.STUCK,
                f"{off * 1000:.0f} mm and {math.degrees(turned):.1f} degrees from the goal after "
                f"{run.corrections} corrections: {self._why_off}",
            )
        run.corrections += 1
        run.follower = None
        return STILL

    @property
    def _why_off(self) -> str:
        if self.guidance is None:
            return "the robot drifts when it turns on the spot"
        return "the robot does not follow its path exactly enough"

    def _goal_of_point(self, run: _Run) -> PlanarPose:
        """The goal of the point that the observations are of."""
        return run.goal if self.guidance is None else run.goal @ self.guidance.point

    def _guarded(self, observation: Observation, wanted: Twist) -> Twist:
        return wanted if self._guard is None else self._guard.guard(observation, wanted)

    def _plan(self, run: _Run, observation: Observation) -> bool:
        """Find a path and begin to follow it. Returns False if there is none."""
        if self.planner is None:
            self._end(GoalState.REFUSED, "there is no map to plan on")
            return False
        planners = [self.planner]
        if run.attempts and observation.obstacles is not None:
            # then on the map alone: what the lidar detected may have been in the way only for a while
            planners.insert(0, self.planner.with_obstacles(observation.pose.apply(observation.obstacles)))
        run.learned = self._turning_centre.in_base
        any_heading = run.limits.angle >= math.pi
        goal = self._goal_of_point(run)
        # then for the base: the planner's radius is that of a turn about the base's origin
        for planner, point in dict.fromkeys(product(planners, (run.learned, _BASE))):
            path = planner.plan(observation.pose @ point, goal @ point, any_heading)
            run.guided = point
            if isinstance(path, Path):
                break
        if isinstance(path, NoPath):
            self._end(GoalState.REFUSED if math.isinf(run.deadline) else GoalState.STUCK, path.reason)
            return False
        self.path = path
        run.follower = self._follower(run, path)
        if math.isinf(run.deadline):
            limits, settings = self.settings.limits, self.settings
            turns = len(path.points) if path.yaws is None else _MOST_CUSPS
            needed = path.length / limits.linear + turns * math.pi / limits.angular
            bound = self._timeout or settings.slack * needed + settings.grace
            run.deadline = run.begun + bound
        self._progress.begin(observation.time)
        self._report(GoalState.DRIVING)
        return True

    def _follower(self, run: _Run, path: Path) -> PathFollower:
        """The controller for a path. A correction is driven gently, and backwards if the goal is behind."""
        limits = run.limits
        make = _follow if self.guidance is None else self.guidance.follower
        if not run.corrections:
            return make(path, limits)
        # a robot that missed the goal brakes less than its limits: half the speed and a quarter of the
        # braking give the same stopping distance, with a braking that the robot can reach
        gentle = replace(limits, linear=limits.linear / 2.0, braking=limits.braking / 4.0)
        is_straight = path.yaws is None and len(path.points) == 2
        if not is_straight:
            return make(path, gentle)
        # well inside the tolerance, because the turn that follows may move the robot out of it again
        return GoToPose(run.goal @ run.guided, replace(gentle, distance=limits.distance / 2.0))

    def _recover(self, run: _Run, observation: Observation) -> Twist:
        """Back up and plan again around what the lidar detects; after `attempts` times the robot is stuck."""
        is_blocked = self._guard is not None and self._guard.blocked_since is not None
        if run.attempts >= self.settings.attempts:
            what = "an obstacle is in the way" if is_blocked else "the robot makes no progress"
            return self._end(
                GoalState.STUCK, f"{what}: tried {run.attempts + 1} times, {self._left(run)} left"
            )
        run.attempts += 1
        if self.guidance is None:  # other bases plan a way out, backwards if that is free
            run.backing_until = observation.time + self.settings.back_up / _BACKWARDS
        run.follower = None
        return STILL

    def _left(self, run: _Run) -> str:
        return f"{run.follower.remaining:.2f} m" if run.follower is not None else "the whole path"

    def _report(self, state: GoalState, reason: str = "") -> GoalReport:
        assert self._run is not None
        self.status = GoalReport(self._run.goal, state, reason)
        return self.status

    def _end(self, state: GoalState, reason: str) -> Twist:
        self._report(state, reason)
        self._run = None
        return STILL


class _StandStill:
    def update(self, observation: Observation) -> Twist:
        return STILL
