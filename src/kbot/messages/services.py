"""Requests and responses of services: std_srvs, and the gazebo_msgs of Gazebo's ROS 1 plugins.

Poses and twists are in the named reference frame. An empty name, `world` and `map` mean the world.
"""

from __future__ import annotations

from dataclasses import dataclass

from kbot.messages.control import Duration
from kbot.messages.sensing import Wrench
from kbot.messages.types import Header, Point, Pose, Time, Twist

ORIGIN, STILL, START, HERE, HEADER = Pose(), Twist(), Time(), Point(), Header()
NO_WRENCH, NO_TIME = Wrench(), Duration()


@dataclass(frozen=True, slots=True)
class ModelState:
    model_name: str = ""
    pose: Pose = ORIGIN
    twist: Twist = STILL
    reference_frame: str = ""


@dataclass(frozen=True, slots=True)
class ModelStates:
    """Every model of the world, including static ones."""

    name: tuple[str, ...] = ()
    pose: tuple[Pose, ...] = ()
    twist: tuple[Twist, ...] = ()


@dataclass(frozen=True, slots=True)
class LinkStates:
    """Every link of the robots. A name is `robot::link`."""

    name: tuple[str, ...] = ()
    pose: tuple[Pose, ...] = ()
    twist: tuple[Twist, ...] = ()


@dataclass(frozen=True, slots=True)
class EmptyRequest:
    """A request without fields."""


@dataclass(frozen=True, slots=True)
class EmptyResponse:
    """A response without fields."""


@dataclass(frozen=True, slots=True)
class StatusResponse:
    """The response of SpawnModel, DeleteModel, SetModelState and ApplyBodyWrench."""

    success: bool = False
    status_message: str = ""


@dataclass(frozen=True, slots=True)
class SpawnModelRequest:
    """`model_xml` is URDF or SDF."""

    model_name: str = ""
    model_xml: str = ""
    robot_namespace: str = ""
    initial_pose: Pose = ORIGIN
    reference_frame: str = ""


@dataclass(frozen=True, slots=True)
class DeleteModelRequest:
    model_name: str = ""


@dataclass(frozen=True, slots=True)
class GetModelStateRequest:
    model_name: str = ""
    relative_entity_name: str = ""


@dataclass(frozen=True, slots=True)
class GetModelStateResponse:
    header: Header = HEADER
    pose: Pose = ORIGIN
    twist: Twist = STILL
    success: bool = False
    status_message: str = ""


@dataclass(frozen=True, slots=True)
class SetModelStateRequest:
    model_state: ModelState = ModelState()


@dataclass(frozen=True, slots=True)
class ApplyBodyWrenchRequest:
    """`reference_point` is in the reference frame. A negative `duration` is unlimited."""

    body_name: str = ""
    reference_frame: str = ""
    reference_point: Point = HERE
    wrench: Wrench = NO_WRENCH
    start_time: Time = START
    duration: Duration = NO_TIME


SERVICES: dict[str, tuple[type, type]] = {
    "std_srvs/Empty": (EmptyRequest, EmptyResponse),
    "gazebo_msgs/SpawnModel": (SpawnModelRequest, StatusResponse),
    "gazebo_msgs/DeleteModel": (DeleteModelRequest, StatusResponse),
    "gazebo_msgs/GetModelState": (GetModelStateRequest, GetModelStateResponse),
    "gazebo_msgs/SetModelState": (SetModelStateRequest, StatusResponse),
    "gazebo_msgs/ApplyBodyWrench": (ApplyBodyWrenchRequest, StatusResponse),
}
"""The request and response of each service type."""
