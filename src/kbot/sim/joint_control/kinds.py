"""The types of joint controllers in ros_control and ros2_control."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum


class Interface(StrEnum):
    """The commanded quantity of a joint: rad or m, rad/s or m/s, N m or N."""

    POSITION = "position"
    VELOCITY = "velocity"
    EFFORT = "effort"


class Input(StrEnum):
    """The message type of a controller's command topic."""

    NUMBER = "Float64"
    ARRAY = "Float64MultiArray"
    TRAJECTORY = "JointTrajectory"


@dataclass(frozen=True, slots=True)
class Kind:
    """A type of controller.

    interface  the quantity that it commands. None: its parameters set it
    hardware   the hardware interface that it needs. None: any
    joints     the parameter that names its joints or its single joint
    topic      the command topic, below the controller's name
    required   other parameters that it does not start without. JOINT is replaced by each joint's name
    """

    input: Input
    interface: Interface | None
    hardware: Interface | None
    joints: str
    topic: str
    required: tuple[str, ...] = ()


_POSITION, _VELOCITY, _EFFORT = Interface.POSITION, Interface.VELOCITY, Interface.EFFORT


def _single(interface: Interface, hardware: Interface) -> Kind:
    gains = () if interface is hardware else ("pid.p",)
    return Kind(Input.NUMBER, interface, hardware, "joint", "command", gains)


def _group(interface: Interface, hardware: Interface) -> Kind:
    gains = () if interface is hardware else ("JOINT.pid.p",)
    return Kind(Input.ARRAY, interface, hardware, "joints", "command", gains)


def _trajectory(hardware: Interface, *required: str) -> Kind:
    return Kind(Input.TRAJECTORY, _POSITION, hardware, "joints", "command", required)


_ROS_1: Mapping[str, Kind] = {
    "effort_controllers/JointPositionController": _single(_POSITION, _EFFORT),
    "effort_controllers/JointVelocityController": _single(_VELOCITY, _EFFORT),
    "effort_controllers/JointEffortController": _single(_EFFORT, _EFFORT),
    "velocity_controllers/JointPositionController": _single(_POSITION, _VELOCITY),
    "velocity_controllers/JointVelocityController": _single(_VELOCITY, _VELOCITY),
    "position_controllers/JointPositionController": _single(_POSITION, _POSITION),
    "effort_controllers/JointGroupPositionController": _group(_POSITION, _EFFORT),
    "effort_controllers/JointGroupEffortController": _group(_EFFORT, _EFFORT),
    "velocity_controllers/JointGroupVelocityController": _group(_VELOCITY, _VELOCITY),
    "position_controllers/JointGroupPositionController": _group(_POSITION, _POSITION),
    "effort_controllers/JointTrajectoryController": _trajectory(_EFFORT, "gains.JOINT.p"),
    "velocity_controllers/JointTrajectoryController": _trajectory(_VELOCITY, "gains.JOINT.p"),
    "position_controllers/JointTrajectoryController": _trajectory(_POSITION),
    "pos_vel_controllers/JointTrajectoryController": Kind(
        Input.TRAJECTORY, _POSITION, None, "joints", "command"
    ),
}

_ROS_2: Mapping[str, Kind] = {
    **{
        f"{interface}_controllers/JointGroup{interface.capitalize()}Controller": Kind(
            Input.ARRAY, interface, interface, "joints", "commands"
        )
        for interface in Interface
    },
    "forward_command_controller/ForwardCommandController": Kind(
        Input.ARRAY, None, None, "joints", "commands", ("interface_name",)
    ),
    "joint_trajectory_controller/JointTrajectoryController": Kind(
        Input.TRAJECTORY, None, None, "joints", "joint_trajectory"
    ),
}

KINDS: Mapping[int, Mapping[str, Kind]] = {1: _ROS_1, 2: _ROS_2}
"""By ROS version, 1 or 2, then by type."""

_ELSEWHERE = (
    "diff_drive_controller",
    "tricycle_controller",
    "tricycle_steering_controller",
    "ackermann_steering_controller",
    "bicycle_steering_controller",
    "mecanum_drive_controller",
    "omni_wheel_drive_controller",
    "joint_state_controller",
)


def is_handled_elsewhere(kind: str) -> bool:
    """Whether another part of KBot does what a controller of this type does."""
    return kind.partition("/")[0].endswith(("_broadcaster", *_ELSEWHERE))
