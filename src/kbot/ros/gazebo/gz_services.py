"""gz's services of a world, as ros_gz_bridge carries them: create, remove, set_pose and control."""

from __future__ import annotations

from itertools import count

from kbot.kinematics.transform import Transform
from kbot.messages import gz_services as gz
from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.ros.bridges.service import Answer, Service
from kbot.ros.gazebo.peer_descriptions import spawn_file, spawn_text, told_of
from kbot.ros.gazebo.states import in_world, models_of, put
from kbot.ros.service_types import service_type
from kbot.sim import Simulation
from kbot.text import DescriptionError, KbotError

MOST_STEPS = 100_000
"""Steps that one call may ask for, so that others are answered too."""
DONE = srv.SuccessResponse(True)


def gz_services(world: str) -> dict[str, Service]:
    """By name."""
    found: list[tuple[str, str, Answer]] = [
        ("create", "SpawnEntity", _create),
        ("remove", "DeleteEntity", _remove),
        ("set_pose", "SetEntityPose", _set_pose),
        ("control", "ControlWorld", _control),
    ]
    return {
        (path := f"/world/{world}/{name}"): Service(path, service_type(f"ros_gz_interfaces/{kind}"), answer)
        for name, kind, answer in found
    }


def _create(simulation: Simulation, request: gz.GzSpawnEntityRequest) -> srv.SuccessResponse:
    asked = request.entity_factory
    place = in_world(simulation, asked.pose, asked.relative_to)
    name = asked.name
    if asked.allow_renaming and name in models_of(simulation):
        taken = models_of(simulation)
        name = next(free for n in count(1) if (free := f"{name}_{n}") not in taken)
    try:
        if asked.sdf:
            spawn_text(simulation, name, asked.sdf, place, usual="sdf")
        elif asked.sdf_filename:
            spawn_file(simulation, name, asked.sdf_filename, place)
        elif asked.clone_name:
            _clone(simulation, name, place, asked.clone_name)
        else:
            raise KbotError("nothing is named to be created: sdf, sdf_filename or clone_name")
    except DescriptionError as error:
        raise KbotError(told_of(error)) from None
    return DONE


def _clone(simulation: Simulation, name: str, place: Transform, of: str) -> None:
    if of not in simulation.robots:
        simulation.get_model_state(of)  # raises, with the nearest names, where there is none
        raise KbotError(f"'{of}' is no robot: only robots are cloned")
    x, y, _ = place.translation.tolist()
    simulation.spawn_model(simulation.robots[of].robot, name or None, x, y, place.yaw)


def _remove(simulation: Simulation, request: gz.GzDeleteEntityRequest) -> srv.SuccessResponse:
    simulation.delete_model(_name(request.entity))
    return DONE


def _set_pose(simulation: Simulation, request: gz.SetEntityPoseRequest) -> srv.SuccessResponse:
    put(simulation, _name(request.entity), request.pose, msg.Twist(), "")
    return DONE


def _name(entity: gz.Entity) -> str:
    if not entity.name:
        raise KbotError("an entity is meant by its name here, not by its number")
    return entity.name


def _control(simulation: Simulation, request: gz.ControlWorldRequest) -> srv.SuccessResponse:
    asked = request.world_control
    steps = asked.multi_step or int(asked.step)
    if steps > MOST_STEPS:
        raise KbotError(f"a call does {MOST_STEPS} steps at most, not {steps}")
    if asked.run_to_sim_time.nanoseconds:
        raise KbotError("it runs until it is paused: leave run_to_sim_time out, or use multi_step")
    if asked.seed and asked.seed != simulation.seed:
        raise KbotError(f"the seed of the run is {simulation.seed}; kbot sim --seed {asked.seed} has another")
    if asked.reset.all:
        simulation.reset()
    elif asked.reset.model_only:
        simulation.reset_world()
    elif asked.reset.time_only:
        simulation.reset_time()
    if steps or asked.pause:
        simulation.pause_physics()
    else:
        simulation.unpause_physics()
    simulation.step(steps)
    return DONE
