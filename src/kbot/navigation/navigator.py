"""Drives a robot to a goal on a map: plans, follows the path, recovers when stuck, and ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, STILL, ControllerLimits, Observation, twist, wrapped
from kbot.navigation.footprint import Outline
from kbot.navigation.go_to_pose import GoToPose
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.obstacle_guard import ObstacleGuard
from kbot.navigation.path import Path
from kbot.navigation.planner import GridPlanner, NoPath
from kbot.navigation.pure_pursuit import RegulatedPurePursuit
from kbot.sim.numbers import FURTHEST
from kbot.text import KbotError

_ENOUGH = 0.5
"""rad of turning before a centre is used. By then 5 mm of drift shift it by 1 cm, which a goal allows."""


class TurningCentre:
    """Watches a robot turn. Skidding wheels, or an axle that is not under the base's origin, move the base.

    Only turns that begin at a standstill count. A robot that still rolls forward as it begins to turn moves
    as if it turned about a point far to its side.
    """

    def __init__(self) -> None:
        self.in_base = PlanarPose()
        """The centre in the base's frame (its yaw is 0), as of the last turn that ended; m."""
        self._last: PlanarPose | None = None
        self._forward = self._left = self._turned = 0.0

    def watch(self, observation: Observation, wanted: Twist) -> None:
        """Take in where the robot is now, and what it is commanded until the next observation."""
        if self._last is not None:
            self._add(self._last, observation.pose)
        if wanted.linear.x == 0.0 and wanted.angular.z != 0.0:
            if self._last is not None or observation.stands:
                self._last = observation.pose
        elif self._last is not None:
            self.interrupt()
            if self._turned >= _ENOUGH:
                # a base at -c from the centre moves by turn * (c.y, -c.x)
                self.in_base = PlanarPose(-self._left / self._turned, self._forward / self._turned)

    def interrupt(self) -> None:
        """Expect the next observation anywhere: the robot may be moved until then."""
        self._last = None

    def _add(self, before: PlanarPose, now: PlanarPose) -> None:
        turned = now.yaw - before.yaw
        half_way = PlanarPose(before.x, before.y, before.yaw + turned / 2.0)
        forward, left = half_way.local(now.x, now.y)
        self._forward += math.copysign(forward, forward * turned)
        self._left += math.copysign(left, left * turned)
        self._turned += abs(turned)


_RADIAN_IN_METRES = 0.1
"""What turning by a radian counts for beside driving."""
_LEAST = 0.01
"""m of progress that count: a robot that pushes a wall slips and rocks by less."""


class ProgressChecker:
    """Watches what is left to do. A robot that spins or pushes a wall does not reduce it."""

    def __init__(self, patience: float) -> None:
        """`patience`: seconds that may pass without any progress."""
        self.patience = patience
        self.begin(0.0)

    def begin(self, time: float) -> None:
        """Start anew, as after a new plan."""
        self._least, self._since, self._only_turns = math.inf, time, False

    def stalled(self, time: float, metres: float, radians: float) -> bool:
        """Whether what is left has not become less for longer than the patience lasts."""
        if metres == 0.0 and not self._only_turns:
            # the last turn is left, which was not counted before
            self.begin(time)
            self._only_turns = True
        left = metres + _RADIAN_IN_METRES * abs(radians)
        if left < self._least - _LEAST:
            self._least, self._since = left, time
        return time - self._since > self.patience


class PathFollower(Protocol):
    """A controller that follows a path and says how much of it is left."""

    is_done: bool
    remaining: float
    heading_error: float

    def update(self, observation: Observation) -> Twist: ...


@dataclass(frozen=True, slots=True)
class NavigatorSettings:
    """Bounds within which every goal ends; seconds, metres, tries.

    `patience`: without progress before it is tried anew. `attempts`: how often, each after backing up by
    `back_up`. `corrections`: how often a robot that its last turn moved off the goal goes there again.
    `silence`: how long a lidar that is relied on may say nothing. `slack`: a goal may take this
    many times the time that its path needs at full speed, and `grace` more, whatever else happens.
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

_BACKWARDS = 0.1
"""m/s."""
_BASE = PlanarPose()
"""The base's origin, as a point of the base's frame."""


def require_goal(goal: PlanarPose) -> None:
    """Raises KbotError: a number is not finite, or the goal further off than anything goes."""
    if not all(math.isfinite(v) for v in (goal.x, goal.y, goal.yaw)):
        raise KbotError("a goal is a finite x and y in m and a finite yaw in rad")
    if max(abs(goal.x), abs(goal.y)) > FURTHEST:
        raise KbotError(f"a goal is at most {FURTHEST:g} m away, unlike ({goal.x:g}, {goal.y:g})")


def follow(path: Path, limits: ControllerLimits) -> PathFollower:
    """Regulated pure pursuit that cuts a corner by less than the room there is beside the path."""
    room = 0.06 if path.margin is None else path.margin
    return RegulatedPurePursuit(path, limits, lookahead=min(0.15, max(0.06, 2.5 * room)))


@dataclass
class _Run:
    """One goal on its way."""

    goal: PlanarPose
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


class Navigator:
    """A controller that goes to goals. `status` says how the present one stands, `path` the way it takes."""

    def __init__(
        self,
        planner: GridPlanner | None,
        settings: NavigatorSettings = DEFAULTS,
        outline: Outline | None = None,
        follower: Callable[[Path, ControllerLimits], PathFollower] = follow,
    ) -> None:
        """Without a planner every goal is refused, for there is no map. With an `outline` the robot stops
        before what a lidar sees, and relies on it."""
        self.planner, self.settings = planner, settings
        self.path: Path | None = None
        self.status: GoalReport | None = None
        self._make_follower = follower
        self._progress = ProgressChecker(settings.patience)
        self._turning_centre = TurningCentre()
        self._guard: ObstacleGuard | None = None
        if outline is not None:
            self.watch_out(outline)
        self._run: _Run | None = None
        self._timeout: float | None = None

    def go(self, goal: PlanarPose, timeout: float | None = None) -> GoalReport:
        """Take a goal in place of any other; `timeout` in s replaces the bound that its path gives.

        Raises:
            KbotError: a number is not finite, the goal further off than anything goes, or the timeout not
                above 0.
        """
        require_goal(goal)
        if timeout is not None and not (math.isfinite(timeout) and timeout > 0.0):
            raise KbotError(f"a timeout is a finite number of seconds above 0, not {timeout}")
        self._turning_centre.interrupt()
        self.path, self._timeout = None, timeout
        self._run = _Run(goal)
        return self._say(GoalState.ACCEPTED)

    def watch_out(self, outline: Outline, rate: float = 20.0) -> None:
        """Stop before what a lidar sees that scans at `rate` (Hz), and rely on it."""
        braking, silence = self.settings.limits.braking, max(0.5, 2.5 / rate)
        self._guard = ObstacleGuard(_Nothing(), outline, braking=braking, silence=silence)

    def cancel(self, reason: str = "cancelled by its sender") -> None:
        """Give up the goal; the robot stops at the next update. Without a goal nothing happens."""
        if self._run is not None:
            self._end(GoalState.CANCELLED, reason)

    def refuse(self, reason: str) -> None:
        """Refuse the goal for a reason that lies outside; without one nothing happens."""
        if self._run is not None:
            self._end(GoalState.REFUSED, reason)

    def update(self, observation: Observation) -> Twist:
        wanted = self._update(observation)
        self._turning_centre.watch(observation, wanted)
        return wanted

    def _update(self, observation: Observation) -> Twist:
        run, settings = self._run, self.settings
        if run is None:
            return STILL
        if math.isnan(run.begun):
            run.begun = observation.time
        if observation.lies:
            return self._end(GoalState.STUCK, observation.lies)
        if observation.time < run.backing_until:
            return self._guarded(observation, twist(-_BACKWARDS, 0.0))
        if self._needs_path(run) and not self._plan(run, observation):
            return STILL
        if observation.time > run.deadline:
            took = observation.time - run.begun
            return self._end(GoalState.STUCK, f"not there after {took:.1f} s, {self._left(run)} to go")
        follower = run.follower
        assert follower is not None
        wanted = follower.update(observation.of_point(run.guided))
        if follower.is_done:
            return self._arrive(run, observation)
        allowed = self._guarded(observation, wanted)
        guard = self._guard
        silent = guard.silent_since if guard else None
        if silent is not None:
            if observation.time - silent > settings.silence:
                return self._end(
                    GoalState.STUCK, f"the lidar has been silent for {observation.time - silent:.1f} s"
                )
            return allowed
        if self._progress.stalled(observation.time, follower.remaining, follower.heading_error):
            return self._recover(run, observation)
        return allowed

    def _needs_path(self, run: _Run) -> bool:
        """Whether to plan: there is no path yet, or the turning centre moved after the last plan."""
        centre, known = self._turning_centre.in_base, run.learned
        learned = math.hypot(centre.x - known.x, centre.y - known.y)
        return run.follower is None or learned > self.settings.limits.distance

    def _arrive(self, run: _Run, observation: Observation) -> Twist:
        """Once the robot stands, end a goal that is reached; else plan a correction."""
        if not observation.stands:
            return STILL
        limits, pose = self.settings.limits, observation.pose
        off = math.hypot(run.goal.x - pose.x, run.goal.y - pose.y)
        turned = abs(wrapped(run.goal.yaw - pose.yaw))
        if off <= limits.distance and turned <= limits.angle:
            return self._end(GoalState.REACHED, "")
        if run.corrections >= self.settings.corrections:
            return self._end(
                GoalState.STUCK,
                f"{off * 1000:.0f} mm and {math.degrees(turned):.1f} degrees from the goal after "
                f"{run.corrections} corrections: the robot drifts when it turns on the spot",
            )
        run.corrections += 1
        run.follower = None
        return STILL

    def _guarded(self, observation: Observation, wanted: Twist) -> Twist:
        return wanted if self._guard is None else self._guard.guard(observation, wanted)

    def _plan(self, run: _Run, observation: Observation) -> bool:
        """Find a path and begin it; whether there is one."""
        if self.planner is None:
            self._end(GoalState.REFUSED, "there is no map to plan on")
            return False
        planners = [self.planner]
        if run.attempts and observation.obstacles is not None:
            # the plain map comes next: what the lidar saw may have been in the way only for a while
            planners.insert(0, self.planner.with_obstacles(observation.pose.apply(observation.obstacles)))
        run.learned = self._turning_centre.in_base
        # the base comes next: the planner's radius is that of a turn about the base's origin
        for planner, point in dict.fromkeys(product(planners, (run.learned, _BASE))):
            path = planner.plan(observation.pose @ point, run.goal @ point)
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
            needed = path.length / limits.linear + len(path.points) * math.pi / limits.angular
            bound = self._timeout or settings.slack * needed + settings.grace
            run.deadline = run.begun + bound
        self._progress.begin(observation.time)
        self._say(GoalState.DRIVING)
        return True

    def _follower(self, run: _Run, path: Path) -> PathFollower:
        """What drives a path. A correction is driven gently, and backwards where that is nearer."""
        limits = self.settings.limits
        if not run.corrections:
            return self._make_follower(path, limits)
        # a robot that missed the goal brakes less than its limits say: half the speed and a quarter of the
        # braking give it the same distance to stop, at a braking that it can reach
        gentle = replace(limits, linear=limits.linear / 2.0, braking=limits.braking / 4.0)
        is_straight = len(path.points) == 2
        return GoToPose(run.goal @ run.guided, gentle) if is_straight else self._make_follower(path, gentle)

    def _recover(self, run: _Run, observation: Observation) -> Twist:
        """Back up and plan anew around what the lidar sees; after so many times, give up."""
        blocked = self._guard is not None and self._guard.blocked_since is not None
        if run.attempts >= self.settings.attempts:
            what = "an obstacle is in the way" if blocked else "the robot does not get on"
            return self._end(
                GoalState.STUCK, f"{what}: tried {run.attempts + 1} times, {self._left(run)} to go"
            )
        run.attempts += 1
        run.backing_until = observation.time + self.settings.back_up / _BACKWARDS
        run.follower = None
        return STILL

    def _left(self, run: _Run) -> str:
        return f"{run.follower.remaining:.2f} m" if run.follower is not None else "the whole way"

    def _say(self, state: GoalState, reason: str = "") -> GoalReport:
        assert self._run is not None
        self.status = GoalReport(self._run.goal, state, reason)
        return self.status

    def _end(self, state: GoalState, reason: str) -> Twist:
        self._say(state, reason)
        self._run = None
        return STILL


class _Nothing:
    def update(self, observation: Observation) -> Twist:
        return STILL
