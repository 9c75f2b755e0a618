"""What commands a robot's joints: its controllers, and the joints that are held without one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.sim.joint_control.kinds import Input, Interface
from kbot.sim.joint_control.trajectory_goal import Constraints
from kbot.text import KbotError


@dataclass(frozen=True, slots=True)
class JointController:
    """`joints` in the order in which an array has their numbers."""

    name: str
    topic: str
    input: Input
    joints: tuple[str, ...]
    interface: Interface
    is_active: bool = True
    """Whether it was started; one that was only loaded commands nothing."""
    allows_partial: bool = True
    """Whether a trajectory may leave out joints: in ROS where allow_partial_joints_goal says so."""
    constraints: Constraints | None = None
    """Those of a controller that has the action follow_joint_trajectory, as ROS 1 has it on topics."""

    def require_active(self) -> None:
        """Raises KbotError: the controller was loaded and not started."""
        if not self.is_active:
            raise KbotError(f"{self.name} is loaded and not started: it commands nothing")


@dataclass(frozen=True, slots=True)
class JointControl:
    """What commands the joints of one robot.

    `holds` are the joints that a controller or the hardware holds from the start, `starts` the positions
    (rad or m) of joints that do not start at 0, `state_topics` further topics for joint states.
    """

    controllers: tuple[JointController, ...] = ()
    holds: frozenset[str] = frozenset()
    starts: Mapping[str, float] = field(default_factory=dict)
    state_topics: tuple[str, ...] = ()
