"""The action follow_joint_trajectory of ROS 1's trajectory controllers, on the topics of actionlib."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from kbot.messages import actions as msg
from kbot.messages.bus import Bus
from kbot.messages.clock import NANOSECONDS, Clock
from kbot.messages.control import Duration, JointTrajectoryPoint
from kbot.messages.navigation import GoalID
from kbot.messages.types import Header
from kbot.sim.joint_control.control import JointController
from kbot.sim.joint_control.trajectory_goal import (
    Bounds,
    Constraints,
    GoalRefused,
    TrajectoryGoal,
    read_goal,
)
from kbot.sim.robot import SimulatedRobot
from kbot.text import KbotError

Result, Status = msg.FollowJointTrajectoryResult, msg.GoalStatus
Numbers = tuple[float, ...]

RATE = 20.0
"""Rate of the feedback in Hz: the default action_monitor_rate of joint_trajectory_controller."""
STATUS_EVERY = 4
"""The status of all goals is published with every 4th feedback: 5 Hz, as actionlib does."""
SETTLE = 0.5
"""Seconds that servos have to come to rest after a trajectory's end, even if `goal_time` is shorter.

A trajectory of positions without velocities ends at full speed. Gazebo stops its joints at once there.
"""
KEPT, MOST_KEPT = 5 * NANOSECONDS, 100
"""How long, in ns, a finished goal stays in the status, and how many finished goals do."""

_FAILURES = {Status.REJECTED: "rejected", Status.ABORTED: "aborted"}


class _Active(NamedTuple):
    id: GoalID
    goal: TrajectoryGoal
    start: int
    """Nanoseconds."""


class _Over(NamedTuple):
    status: msg.GoalStatus
    since: int


class TrajectoryAction:
    """Follows one goal at a time. A newer goal, a cancel, or another command of its joints ends it."""

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        robot: SimulatedRobot,
        controller: JointController,
        report: Callable[[str], None],
    ) -> None:
        """`report` receives reports to the user, such as why a goal was rejected."""
        self._clock, self._robot, self._controller, self._report = clock, robot, controller, report
        self._constraints = controller.constraints or Constraints()
        self._active: _Active | None = None
        self._over: list[_Over] = []
        self._updates = self._named = 0
        stem = robot.naming.topic(f"{controller.topic.rpartition('/')[0]}/follow_joint_trajectory")
        self._status = bus.advertise(f"{stem}/status", msg.GoalStatusArray)
        self._feedback = bus.advertise(f"{stem}/feedback", msg.FollowJointTrajectoryActionFeedback)
        self._result = bus.advertise(f"{stem}/result", msg.FollowJointTrajectoryActionResult)
        self._subscriptions = (
            bus.subscribe(f"{stem}/goal", msg.FollowJointTrajectoryActionGoal, self._take),
            bus.subscribe(f"{stem}/cancel", GoalID, self._cancel),
        )
        self._timer = clock.every(RATE, self._update)

    def close(self) -> None:
        """Accept no more goals, and end the active one."""
        self._end(Status.PREEMPTED, "the controller was removed")
        self._timer.cancel()
        for topic in (self._status, self._feedback, self._result, *self._subscriptions):
            topic.close()

    def _take(self, message: msg.FollowJointTrajectoryActionGoal) -> None:
        now = self._clock.nanoseconds
        goal_id = message.goal_id
        if not goal_id.id:
            self._named += 1
            goal_id = GoalID(goal_id.stamp, f"goal-{self._named}-{now}")
        if goal_id.id in self._known():
            return
        try:
            self._controller.require_active()
            goal = read_goal(
                message.goal,
                self._controller.joints,
                self._constraints,
                now / NANOSECONDS,
                allows_partial=self._controller.allows_partial,
            )
            self._robot.follow_trajectory(goal.joints, goal.points)
        except KbotError as error:
            code = error.code if isinstance(error, GoalRefused) else Result.INVALID_GOAL
            self._close(goal_id, Status.REJECTED, code, str(error))
            return
        self._end(Status.PREEMPTED, "a newer goal replaced it")
        self._active = _Active(goal_id, goal, now)
        self._publish_status()

    def _known(self) -> set[str]:
        active = {self._active.id.id} if self._active is not None else set()
        return active | {over.status.goal_id.id for over in self._over}

    def _cancel(self, wanted: GoalID) -> None:
        """Cancel the goal with an ID, all goals up to a time stamp, or with neither all goals."""
        active = self._active
        if active is None:
            return
        stamp = wanted.stamp.nanoseconds
        is_old = 0 < active.id.stamp.nanoseconds <= stamp
        if wanted.id == active.id.id or is_old or (not wanted.id and not stamp):
            self._hold(active.goal)
            self._end(Status.PREEMPTED, "cancelled")

    def _hold(self, goal: TrajectoryGoal) -> None:
        self._robot.follow_trajectory(goal.joints, ())

    def _update(self) -> None:
        now = self._clock.nanoseconds
        if self._active is not None:
            self._follow(self._active, now)
        self._updates += 1
        if self._updates % STATUS_EVERY == 0 and self._status.has_subscribers:
            self._publish_status()

    def _follow(self, active: _Active, now: int) -> None:
        goal, servos = active.goal, self._robot.joints.servos
        passed = (now - active.start) / NANOSECONDS
        is_over = passed > goal.seconds - 1e-6
        desired = self._last(goal) if is_over else servos.desired(goal.joints, now / NANOSECONDS)
        if passed < 0.0 or desired is None:
            self._end(Status.PREEMPTED, "its joints received another command")
            return
        body = self._robot.body
        positions, velocities = body.joint_positions, body.joint_velocities
        actual = (
            tuple(positions[joint] for joint in goal.joints),
            tuple(velocities[joint] for joint in goal.joints),
        )
        error = _minus(desired[0], actual[0]), _minus(desired[1], actual[1])
        if is_over:
            self._arrive(active, error, passed)
        elif off := _too_far(goal.joints, error, goal.constraints.path):
            self._hold(goal)
            self._end(Status.ABORTED, off, Result.PATH_TOLERANCE_VIOLATED)
        elif self._feedback.has_subscribers:
            self._publish_feedback(active, desired, actual, error)

    def _arrive(self, active: _Active, error: tuple[Numbers, Numbers], passed: float) -> None:
        goal = active.goal
        off = _too_far(goal.joints, error, goal.constraints.goal)
        if not off:
            self._end(Status.SUCCEEDED, "", Result.SUCCESSFUL)
        elif passed > goal.seconds + max(goal.constraints.goal_time, SETTLE):
            self._end(Status.ABORTED, off, Result.GOAL_TOLERANCE_VIOLATED)

    def _last(self, goal: TrajectoryGoal) -> tuple[Numbers, Numbers]:
        """The final positions, at rest."""
        now = self._robot.body.joint_positions
        end = goal.points[-1].positions if goal.points else tuple(now[joint] for joint in goal.joints)
        return end, (0.0,) * len(end)

    def _end(self, status: int, text: str, code: int = Result.SUCCESSFUL) -> None:
        if self._active is not None:
            ended, self._active = self._active, None
            self._close(ended.id, status, code, text)

    def _close(self, goal_id: GoalID, status: int, code: int, text: str) -> None:
        """Publish the result of a goal that ended."""
        if status in _FAILURES:
            self._report(f"{self._controller.name}: goal {_FAILURES[status]}: {text}")
        over = Status(goal_id, status, text)
        self._over = [*self._over[1 - MOST_KEPT :], _Over(over, self._clock.nanoseconds)]
        header = Header(self._clock.stamp)
        self._result.publish(msg.FollowJointTrajectoryActionResult(header, over, Result(code, text)))
        self._publish_status()

    def _publish_status(self) -> None:
        now = self._clock.nanoseconds
        self._over = [over for over in self._over if 0 <= now - over.since <= KEPT]
        goals = [over.status for over in self._over]
        if self._active is not None:
            goals.append(Status(self._active.id, Status.ACTIVE))
        self._status.publish(msg.GoalStatusArray(Header(self._clock.stamp), tuple(goals)))

    def _publish_feedback(
        self,
        active: _Active,
        desired: tuple[Numbers, Numbers],
        actual: tuple[Numbers, Numbers],
        error: tuple[Numbers, Numbers],
    ) -> None:
        header = Header(self._clock.stamp)
        passed = Duration.from_seconds((self._clock.nanoseconds - active.start) / NANOSECONDS)
        points = (
            JointTrajectoryPoint(positions, velocities, time_from_start=passed)
            for positions, velocities in (desired, actual, error)
        )
        feedback = msg.FollowJointTrajectoryFeedback(header, active.goal.joints, *points)
        status = Status(active.id, Status.ACTIVE)
        self._feedback.publish(msg.FollowJointTrajectoryActionFeedback(header, status, feedback))


def _minus(a: Sequence[float], b: Sequence[float]) -> Numbers:
    return tuple(x - y for x, y in zip(a, b, strict=True))


def _too_far(joints: tuple[str, ...], error: tuple[Numbers, Numbers], bounds: Bounds) -> str:
    """The first joint whose error exceeds its tolerance, as a message. Empty if none does."""
    for joint, position, velocity in zip(joints, *error, strict=True):
        bound = bounds[joint]
        if abs(position) > bound.position:
            return f"the position of '{joint}' is off by {abs(position):.4g}, more than {bound.position:g}"
        if abs(velocity) > bound.velocity:
            return f"the velocity of '{joint}' is off by {abs(velocity):.4g}, more than {bound.velocity:g}"
    return ""
