"""Checks a goal of control_msgs/FollowJointTrajectory as ROS 1's joint_trajectory_controller does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from kbot.messages.actions import FollowJointTrajectoryGoal, FollowJointTrajectoryResult, JointTolerance
from kbot.sim.joint_control.trajectory import TrajectoryPoint, trajectory_points
from kbot.sim.numbers import FURTHEST, is_within
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

AT_REST = 0.01
"""rad/s or m/s: `constraints.stopped_velocity_tolerance` where it is not given."""

Bounds = Mapping[str, "Tolerance"]


class GoalRefused(KbotError):
    """A goal that is not followed; `code` is one of FollowJointTrajectoryResult."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


class Tolerance(NamedTuple):
    """How far off a joint may be: rad or m, rad/s or m/s."""

    position: float = inf
    velocity: float = inf


@dataclass(frozen=True, slots=True)
class Constraints:
    """By joint, on the way and at its end; `goal_time` in s is how late the end may be reached."""

    path: Bounds = field(default_factory=dict)
    goal: Bounds = field(default_factory=dict)
    goal_time: float = 0.0

    @classmethod
    def of(cls, values: Mapping[str, object], joints: Iterable[str]) -> Constraints:
        """Those among a controller's parameters; what is no number above 0 bounds nothing."""

        def number(name: str, default: float) -> float:
            value = values.get(f"constraints.{name}", default)
            return float(value) if isinstance(value, int | float) and value > 0.0 else inf

        at_rest = number("stopped_velocity_tolerance", AT_REST)
        path = {joint: Tolerance(number(f"{joint}.trajectory", 0.0)) for joint in joints}
        goal = {joint: Tolerance(number(f"{joint}.goal", 0.0), at_rest) for joint in path}
        late = number("goal_time", 0.0)
        return cls(path, goal, late if late < inf else 0.0)


@dataclass(frozen=True, slots=True)
class TrajectoryGoal:
    joints: tuple[str, ...]
    points: tuple[TrajectoryPoint, ...]
    constraints: Constraints

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return self.points[-1].time if self.points else 0.0


def read_goal(
    goal: FollowJointTrajectoryGoal,
    known: tuple[str, ...],
    constraints: Constraints,
    now: float,
    *,
    allows_partial: bool = False,
) -> TrajectoryGoal:
    """A goal for a controller of the joints that are `known`, its points in seconds from `now` (s) on. It may
    leave some of them out where the controller `allows_partial` ones.

    Raises:
        GoalRefused: it names other joints than the controller's, is over already, or is none.
    """
    way = goal.trajectory
    require_joints(way.joint_names, known, allows_partial=allows_partial)
    written = [
        (point.time_from_start.seconds, point.positions, point.velocities, point.accelerations)
        for point in way.points
    ]
    try:
        joints, points = trajectory_points(way.joint_names, written)
        bounds = Constraints(
            _bounds(constraints.path, goal.path_tolerance),
            _bounds(constraints.goal, goal.goal_tolerance),
            goal.goal_time_tolerance.seconds or constraints.goal_time,
        )
    except KbotError as error:
        raise GoalRefused(FollowJointTrajectoryResult.INVALID_GOAL, str(error)) from None
    start = way.header.stamp.nanoseconds * 1e-9
    if start:
        late = start - now
        points = tuple(p._replace(time=p.time + late) for p in points if p.time + late >= 0.0)
        if written and not points:
            message = f"the trajectory began at {start:.3f} s and was over before {now:.3f} s"
            raise GoalRefused(FollowJointTrajectoryResult.OLD_HEADER_TIMESTAMP, message)
    return TrajectoryGoal(joints, points, bounds)


def require_joints(named: tuple[str, ...], known: tuple[str, ...], *, allows_partial: bool) -> None:
    """Raises GoalRefused: a trajectory of these joints is none of a controller's that are `known`."""
    strangers = [joint for joint in named if joint not in known]
    lacking = [joint for joint in known if joint not in named]
    if strangers:
        hint = did_you_mean(strangers[0], known) or f"its joints are {', '.join(known)}"
        what = f"the controller does not command '{strangers[0]}': {hint}"
    elif lacking and not (allows_partial and named):
        what = (
            f"the trajectory leaves out '{lacking[0]}', which the controller commands: name them all,"
            " or set its allow_partial_joints_goal to true"
        )
    elif len(named) > len(set(named)):
        what = f"the trajectory names a joint twice: {', '.join(named)}"
    else:
        return
    raise GoalRefused(FollowJointTrajectoryResult.INVALID_JOINTS, what)


def _bounds(defaults: Bounds, wanted: Iterable[JointTolerance]) -> Bounds:
    """Above 0 it bounds, 0 leaves the controller's own, below 0 bounds nothing."""
    found = dict(defaults)
    for one in wanted:
        if not (is_within(one.position, FURTHEST) and is_within(one.velocity, FURTHEST)):
            raise KbotError(f"the tolerances of '{one.name}' are finite numbers")
        if one.name in found:
            own = found[one.name]
            found[one.name] = Tolerance(
                _bound(own.position, one.position), _bound(own.velocity, one.velocity)
            )
    return found


def _bound(own: float, wanted: float) -> float:
    return own if wanted == 0.0 else wanted if wanted > 0.0 else inf
