"""Messages of actionlib (ROS 1), and of the actions FollowJointTrajectory and MoveBase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kbot.messages.control import Duration, JointTrajectory, JointTrajectoryPoint
from kbot.messages.navigation import GoalID, PoseStamped
from kbot.messages.types import Header, Int32, UInt8

HEADER, NO_TIME, NO_ID = Header(), Duration(), GoalID()
TRAJECTORY, POINT = JointTrajectory(), JointTrajectoryPoint()
POSE = PoseStamped()


@dataclass(frozen=True, slots=True)
class GoalStatus:
    """`status` is one of the numbers below, which a server can publish. `text` is the reason."""

    goal_id: GoalID = NO_ID
    status: UInt8 = 0
    text: str = ""

    ACTIVE: ClassVar[int] = 1
    PREEMPTED: ClassVar[int] = 2
    SUCCEEDED: ClassVar[int] = 3
    ABORTED: ClassVar[int] = 4
    REJECTED: ClassVar[int] = 5
    RECALLED: ClassVar[int] = 8


STATUS = GoalStatus()


@dataclass(frozen=True, slots=True)
class GoalStatusArray:
    header: Header = HEADER
    status_list: tuple[GoalStatus, ...] = ()


@dataclass(frozen=True, slots=True)
class JointTolerance:
    """In rad or m, and their derivatives. 0: the tolerance of the controller; negative: unlimited."""

    name: str = ""
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class FollowJointTrajectoryGoal:
    trajectory: JointTrajectory = TRAJECTORY
    path_tolerance: tuple[JointTolerance, ...] = ()
    goal_tolerance: tuple[JointTolerance, ...] = ()
    goal_time_tolerance: Duration = NO_TIME


@dataclass(frozen=True, slots=True)
class FollowJointTrajectoryResult:
    SUCCESSFUL: ClassVar[Int32] = 0
    INVALID_GOAL: ClassVar[Int32] = -1
    INVALID_JOINTS: ClassVar[Int32] = -2
    OLD_HEADER_TIMESTAMP: ClassVar[Int32] = -3
    PATH_TOLERANCE_VIOLATED: ClassVar[Int32] = -4
    GOAL_TOLERANCE_VIOLATED: ClassVar[Int32] = -5

    error_code: Int32 = 0
    error_string: str = ""


@dataclass(frozen=True, slots=True)
class FollowJointTrajectoryFeedback:
    header: Header = HEADER
    joint_names: tuple[str, ...] = ()
    desired: JointTrajectoryPoint = POINT
    actual: JointTrajectoryPoint = POINT
    error: JointTrajectoryPoint = POINT


GOAL, RESULT = FollowJointTrajectoryGoal(), FollowJointTrajectoryResult()
FEEDBACK = FollowJointTrajectoryFeedback()


@dataclass(frozen=True, slots=True)
class FollowJointTrajectoryActionGoal:
    header: Header = HEADER
    goal_id: GoalID = NO_ID
    goal: FollowJointTrajectoryGoal = GOAL


@dataclass(frozen=True, slots=True)
class FollowJointTrajectoryActionResult:
    header: Header = HEADER
    status: GoalStatus = STATUS
    result: FollowJointTrajectoryResult = RESULT


@dataclass(frozen=True, slots=True)
class FollowJointTrajectoryActionFeedback:
    header: Header = HEADER
    status: GoalStatus = STATUS
    feedback: FollowJointTrajectoryFeedback = FEEDBACK


@dataclass(frozen=True, slots=True)
class MoveBaseGoal:
    target_pose: PoseStamped = POSE


@dataclass(frozen=True, slots=True)
class MoveBaseResult:
    """A result without fields."""


@dataclass(frozen=True, slots=True)
class MoveBaseFeedback:
    base_position: PoseStamped = POSE


MOVE_GOAL, MOVE_RESULT, MOVE_FEEDBACK = MoveBaseGoal(), MoveBaseResult(), MoveBaseFeedback()


@dataclass(frozen=True, slots=True)
class MoveBaseActionGoal:
    header: Header = HEADER
    goal_id: GoalID = NO_ID
    goal: MoveBaseGoal = MOVE_GOAL


@dataclass(frozen=True, slots=True)
class MoveBaseActionResult:
    header: Header = HEADER
    status: GoalStatus = STATUS
    result: MoveBaseResult = MOVE_RESULT


@dataclass(frozen=True, slots=True)
class MoveBaseActionFeedback:
    header: Header = HEADER
    status: GoalStatus = STATUS
    feedback: MoveBaseFeedback = MOVE_FEEDBACK
