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
"""rad/s or m/s: ROS's default of `constraints.stopped_velocity_tolerance`."""

Bounds = Mapping[str, "Tolerance"]


class GoalRefused(KbotError):
    """A goal that the controller rejects. `code` is one of FollowJointTrajectoryResult."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


class Tolerance(NamedTuple):
    """The largest error of a joint: rad or m, rad/s or m/s."""

    position: float = inf
    velocity: float = inf


@dataclass(frozen=True, slots=True)
class Constraints:
    """The tolerances of each joint, along the path and at the goal.

    The goal may be reached `goal_time` seconds late.
    """

    path: Bounds = field(default_factory=dict)
    goal: Bounds = field(default_factory=dict)
    goal_time: float = 0.0

    @classmethod
    def of(cls, values: Mapping[str, object], joints: Iterable[str]) -> Constraints:
        """Read a controller's parameters. A value that is not a number above 0 sets no tolerance."""

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
        """The duration in s."""
        return self.points[-1].time if self.points else 0.0


def read_goal(
    goal: FollowJointTrajectoryGoal,
    known: tuple[str, ...],
    constraints: Constraints,
    now: float,
    *,
    allows_partial: bool = False,
) -> TrajectoryGoal:
    """Check a goal for a controller of the joints `known`. The times of its points start at `now` (s).

    With `allows_partial` the goal may omit joints.

    Raises:
        GoalRefused: the joints are not those of the controller, the trajectory is over already, or the goal
            is not valid.
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
            message = f"the trajectory started at {start:.3f} s and ended before now ({now:.3f} s)"
            raise GoalRefused(FollowJointTrajectoryResult.OLD_HEADER_TIMESTAMP, message)
    return TrajectoryGoal(joints, points, bounds)


def require_joints(named: tuple[str, ...], known: tuple[str, ...], *, allows_partial: bool) -> None:
    """Raises GoalRefused: a trajectory's joints (`named`) do not fit the controller's joints (`known`)."""
    unknown = [joint for joint in named if joint not in known]
    lacking = [joint for joint in known if joint not in named]
    if unknown:
        hint = did_you_mean(unknown[0], known) or f"its joints are {', '.join(known)}"
        what = f"the controller does not command '{unknown[0]}': {hint}"
    elif lacking and not (allows_partial and named):
        what = (
            f"the trajectory lacks '{lacking[0]}': name all joints of the controller, or set its"
            " allow_partial_joints_goal to true"
        )
    elif len(named) > len(set(named)):
        what = f"the trajectory names a joint twice: {', '.join(named)}"
    else:
        return
    raise GoalRefused(FollowJointTrajectoryResult.INVALID_JOINTS, what)


def _bounds(defaults: Bounds, wanted: Iterable[JointTolerance]) -> Bounds:
    """A goal's tolerances: 0 means the controller's default, a negative number means no limit."""
    found = dict(defaults)
    for tolerance in wanted:
        if not (is_within(tolerance.position, FURTHEST) and is_within(tolerance.velocity, FURTHEST)):
            raise KbotError(f"the tolerances of '{tolerance.name}' must be finite numbers")
        if tolerance.name in found:
            own = found[tolerance.name]
            found[tolerance.name] = Tolerance(
                _bound(own.position, tolerance.position), _bound(own.velocity, tolerance.velocity)
            )
    return found


def _bound(own: float, wanted: float) -> float:
    return own if wanted == 0.0 else wanted if wanted > 0.0 else inf
