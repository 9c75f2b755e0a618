"""Gazebo's services, with the names that gazebo_ros of ROS 1 gives them.

A model is a robot or a body of the world. A link is named `robot::link`; `link` alone is of the first robot.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.ros.bridges.service import Answer, Service
from kbot.ros.gazebo.peer_descriptions import PeerModel, read_in_worker, spawn, summary_of
from kbot.ros.gazebo.states import (
    in_world,
    link_named,
    put,
    relative_state,
    world_from_frame,
    xyz,
)
from kbot.ros.service_types import service_type
from kbot.sim import Simulation
from kbot.text import DescriptionError, KbotError

_ReadRequest = tuple[srv.SpawnModelRequest, PeerModel | KbotError]

ENDLESS_S = 1e6
"""Seconds that a wrench of negative duration acts: by gazebo_msgs/ApplyBodyWrench it never ends."""


def gazebo_services() -> dict[str, Service]:
    """The services by name."""
    services: list[tuple[str, str, Answer]] = [
        ("/gazebo/pause_physics", "std_srvs/Empty", _empty_service(_pause)),
        ("/gazebo/unpause_physics", "std_srvs/Empty", _empty_service(_unpause)),
        (
            "/gazebo/reset_world",
            "std_srvs/Empty",
            _empty_service(lambda simulation: simulation.snapshots.reset_world()),
        ),
        ("/gazebo/reset_simulation", "std_srvs/Empty", _empty_service(Simulation.reset)),
        ("/gazebo/delete_model", "gazebo_msgs/DeleteModel", _delete_model),
        ("/gazebo/get_model_state", "gazebo_msgs/GetModelState", _get_model_state),
        ("/gazebo/set_model_state", "gazebo_msgs/SetModelState", _set_model_state),
        ("/gazebo/apply_body_wrench", "gazebo_msgs/ApplyBodyWrench", _apply_body_wrench),
    ]
    found = {name: Service(name, service_type(kind), answer) for name, kind, answer in services}
    for kind in ("urdf", "sdf"):
        name = f"/gazebo/spawn_{kind}_model"
        found[name] = Service(name, service_type("gazebo_msgs/SpawnModel"), _spawn_model, _model_reader(kind))
    return found


def _pause(simulation: Simulation) -> None:
    simulation.paused = True


def _unpause(simulation: Simulation) -> None:
    simulation.paused = False


def _empty_service(work: Callable[[Simulation], None]) -> Answer:
    """A service with an empty response."""

    def answer(simulation: Simulation, request: srv.EmptyRequest) -> srv.EmptyResponse:
        work(simulation)
        return srv.EmptyResponse()

    return answer


def _status_service(work: Callable[[Simulation, Any], str]) -> Answer:
    """A service that responds with success or failure, and with a message."""

    def answer(simulation: Simulation, request: Any) -> srv.StatusResponse:  # noqa: ANN401 - of any type
        try:
            return srv.StatusResponse(True, work(simulation, request))
        except DescriptionError as error:
            return srv.StatusResponse(False, summary_of(error))
        except KbotError as error:
            return srv.StatusResponse(False, str(error))

    return answer


def _model_reader(default_format: str) -> Callable[[srv.SpawnModelRequest], _ReadRequest]:
    """Return a function that reads the model of a request. `default_format` is used if the first tag is not
    that of URDF or SDF."""

    def read(request: srv.SpawnModelRequest) -> _ReadRequest:
        try:
            return request, read_in_worker(request.model_name, request.model_xml, default_format)
        except KbotError as error:
            return request, error

    return read


@_status_service
def _spawn_model(simulation: Simulation, given: _ReadRequest) -> str:
    request, model = given
    if isinstance(model, KbotError):
        raise model
    place = in_world(simulation, request.initial_pose, request.reference_frame)
    return spawn(simulation, model, request.model_name, place, request.robot_namespace.strip("/") or None)


@_status_service
def _delete_model(simulation: Simulation, request: srv.DeleteModelRequest) -> str:
    simulation.models.delete_model(request.model_name)
    return f"deleted {request.model_name}"


@_status_service
def _set_model_state(simulation: Simulation, request: srv.SetModelStateRequest) -> str:
    state = request.model_state
    put(simulation, state.model_name, state.pose, state.twist, state.reference_frame)
    return f"moved {state.model_name}"


@_status_service
def _apply_body_wrench(simulation: Simulation, request: srv.ApplyBodyWrenchRequest) -> str:
    """Force and torque are in the axes of the reference frame. A force at a point beside the centre of mass
    adds a torque."""
    robot, link = link_named(simulation, request.body_name)
    if request.start_time.nanoseconds > simulation.clock.nanoseconds:
        raise KbotError("KBot applies a wrench at once, not at a later time: omit start_time")
    axes = world_from_frame(simulation, request.reference_frame).rotation
    lever = axes @ np.array(xyz(request.reference_point))
    force = axes @ np.array(xyz(request.wrench.force))
    torque = axes @ np.array(xyz(request.wrench.torque)) + np.cross(lever, force)
    seconds = request.duration.seconds
    simulation.disturbances.apply_body_wrench(
        link, tuple(force.tolist()), seconds if seconds >= 0.0 else ENDLESS_S, tuple(torque.tolist()), robot
    )
    return f"applied the wrench to {robot}::{link}"


def _get_model_state(simulation: Simulation, request: srv.GetModelStateRequest) -> srv.GetModelStateResponse:
    try:
        pose, twist = relative_state(simulation, request.model_name, request.relative_entity_name)
    except KbotError as error:
        return srv.GetModelStateResponse(status_message=str(error))
    header = msg.Header(simulation.clock.stamp, request.relative_entity_name or "world")
    return srv.GetModelStateResponse(header, pose, twist, True, f"the state of {request.model_name}")
