"""The action follow_joint_trajectory of ROS 1's trajectory controllers, on the topics of actionlib."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from kbot.messages import actions as msg
from kbot.messages.action_server import ActionServer, ActionTypes, GoalRejected
from kbot.messages.bus import Bus
from kbot.messages.clock import NANOSECONDS, Clock
from kbot.messages.control import Duration, JointTrajectoryPoint
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
SETTLE = 0.5
"""Seconds that servos have to come to rest after a trajectory's end, even if `goal_time` is shorter.

A trajectory of positions without velocities ends at full speed. Gazebo stops its joints at once there.
"""
TYPES = ActionTypes(
    msg.FollowJointTrajectoryActionGoal,
    msg.FollowJointTrajectoryActionResult,
    msg.FollowJointTrajectoryActionFeedback,
    Result(),
)


class _Active(NamedTuple):
    goal: TrajectoryGoal
    start: int
    """Nanoseconds."""


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
        name = robot.naming.topic(f"{controller.topic.rpartition('/')[0]}/follow_joint_trajectory")
        self._server = ActionServer(bus, clock, name, TYPES, self._accept, self._cancel)
        self._timer = clock.every(RATE, self._update)

    def close(self) -> None:
        """Accept no more goals, and end the active one."""
        self._end(Status.PREEMPTED, "the controller was removed")
        self._timer.cancel()
        self._server.close()

    def _accept(self, goal: msg.FollowJointTrajectoryGoal) -> None:
        now = self._clock.nanoseconds
        try:
            self._controller.require_active()
            read = read_goal(
                goal,
                self._controller.joints,
                self._constraints,
                now / NANOSECONDS,
                allows_partial=self._controller.allows_partial,
            )
            self._robot.follow_trajectory(read.joints, read.points)
        except KbotError as error:
            self._report_failure("rejected", str(error))
            code = error.code if isinstance(error, GoalRefused) else Result.INVALID_GOAL
            raise GoalRejected(str(error), Result(code, str(error))) from None
        self._active = _Active(read, now)

    def _cancel(self) -> None:
        if self._active is not None:
            self._hold(self._active.goal)
            self._end(Status.PREEMPTED, "cancelled")

    def _hold(self, goal: TrajectoryGoal) -> None:
        self._robot.follow_trajectory(goal.joints, ())

    def _update(self) -> None:
        now = self._clock.nanoseconds
        if self._active is not None:
            self._follow(self._active, now)

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
        elif self._server.has_listeners:
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
        if self._active is None:
            return
        self._active = None
        if status == Status.ABORTED:
            self._report_failure("aborted", text)
        self._server.end(status, text, Result(code, text))

    def _report_failure(self, how: str, why: str) -> None:
        self._report(f"{self._controller.name}: goal {how}: {why}")

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
        self._server.publish_feedback(feedback)


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
