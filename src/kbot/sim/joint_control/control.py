"""The joint controllers of a robot, and the joints that are held without one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.sim.joint_control.kinds import Input, Interface
from kbot.sim.joint_control.trajectory_goal import Constraints
from kbot.text import KbotError


@dataclass(frozen=True, slots=True)
class JointController:
    """A controller that commands joints. `joints` are in the order of the numbers in an array message."""

    name: str
    topic: str
    input: Input
    joints: tuple[str, ...]
    interface: Interface
    is_active: bool = True
    """Whether it was started. A controller that was only loaded ignores commands."""
    allows_partial: bool = True
    """Whether a trajectory may omit joints: the parameter allow_partial_joints_goal of ROS's controllers."""
    constraints: Constraints | None = None
    """The tolerances of the action follow_joint_trajectory.

    None: the controller has no such action on topics.
    """

    def require_active(self) -> None:
        """Raises KbotError: the controller was loaded but not started."""
        if not self.is_active:
            raise KbotError(f"the controller {self.name} was loaded but not started: start it first")


@dataclass(frozen=True, slots=True)
class JointControl:
    """The joint controllers of one robot.

    `holds` are the joints that a controller or the hardware holds from the start. `starts` are the positions
    (rad or m) of joints that do not start at 0. `state_topics` are the topics of joint states with their
    rates in Hz. Without an entry, `joint_states` is published every control period.
    """

    controllers: tuple[JointController, ...] = ()
    holds: frozenset[str] = frozenset()
    starts: Mapping[str, float] = field(default_factory=dict)
    state_topics: Mapping[str, float] = field(default_factory=dict)
