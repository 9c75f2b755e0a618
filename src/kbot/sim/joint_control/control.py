"""What commands a robot's joints: its controllers, and what is held without one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.sim.joint_control.kinds import Input, Interface
from kbot.sim.joint_control.trajectory_goal import Constraints


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


@dataclass(frozen=True, slots=True)
class ManagedController:
    """One that ROS 1's controller manager has loaded: what it claims of which joints."""

    name: str
    kind: str
    hardware: str
    joints: tuple[str, ...]
    is_active: bool


@dataclass(frozen=True, slots=True)
class JointControl:
    """The controllers, the joints that they or their hardware hold from the start on, where joints start
    that are not to start at 0 (rad or m), and topics on which joint states are told too. `hardware` has the
    joints that are held without a controller, `managed` what the controller manager of ROS 1 has loaded, and
    `manager` its namespace, None where there is no such manager."""

    controllers: tuple[JointController, ...] = ()
    holds: frozenset[str] = frozenset()
    starts: Mapping[str, float] = field(default_factory=dict)
    state_topics: tuple[str, ...] = ()
    hardware: frozenset[str] = frozenset()
    managed: tuple[ManagedController, ...] = ()
    manager: str | None = None
