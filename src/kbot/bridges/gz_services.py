"""gz's services of a world, as ros_gz_bridge carries them: create, remove, set_pose and control."""

from __future__ import annotations

import re
from itertools import count

from kbot.bridges.gazebo_states import in_world, models_of, put
from kbot.bridges.services import Answer, Service
from kbot.kinematics.transform import Transform
from kbot.messages import gz_services as gz
from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.model.load import load_robot, load_robot_text
from kbot.sim import Simulation
from kbot.text import DescriptionError, KbotError
from kbot.wire.services import service_type

MOST_STEPS = 100_000
"""Steps that one call may ask for, so that others are answered too."""
DONE = srv.SuccessResponse(True)
_FIRST_TAG = re.compile(r"(?:\s|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>)*<(?P<tag>[\w:.-]+)", re.DOTALL)


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


def spawn_text(
    simulation: Simulation, name: str, xml: str, place: Transform, namespace: str | None = None
) -> str:
    """Spawn what a text describes, a robot of URDF or a model of SDF, and say so.

    Raises:
        DescriptionError, KbotError: it cannot be used, or cannot stand there.
    """
    first = _FIRST_TAG.match(xml)
    if first is not None and first["tag"] in ("sdf", "gazebo"):
        return _stands(simulation.spawn_sdf(xml, name or None, place)[0].belongs_to, place)
    robot = load_robot_text(xml, f"{name or 'model'}.urdf").require()
    x, y, _ = place.translation.tolist()
    spawned = simulation.spawn_model(robot, name or None, x, y, place.yaw, namespace=namespace)
    where = f"/{spawned.naming.namespace}" if spawned.naming.namespace else "the root"
    return f"{spawned.name} stands on the ground at {x:.3f}, {y:.3f}; its topics are under {where}"


def _stands(name: str, place: Transform) -> str:
    x, y, z = place.translation.tolist()
    return f"{name} is put at {x:.3f}, {y:.3f}, {z:.3f}"


def _create(simulation: Simulation, request: gz.GzSpawnEntityRequest) -> srv.SuccessResponse:
    asked = request.entity_factory
    place = in_world(simulation, asked.pose, asked.relative_to)
    name = asked.name
    if asked.allow_renaming and name in models_of(simulation):
        taken = models_of(simulation)
        name = next(free for n in count(1) if (free := f"{name}_{n}") not in taken)
    try:
        if asked.sdf:
            spawn_text(simulation, name, asked.sdf, place)
        elif asked.sdf_filename.endswith((".urdf", ".xacro")):
            _spawn_robot(simulation, name, place, asked.sdf_filename)
        elif asked.sdf_filename:
            simulation.spawn_sdf(asked.sdf_filename, name or None, place)
        elif asked.clone_name:
            _clone(simulation, name, place, asked.clone_name)
        else:
            raise KbotError("nothing is named to be created: sdf, sdf_filename or clone_name")
    except DescriptionError as error:
        raise KbotError(told_of(error)) from None
    return DONE


def told_of(error: DescriptionError) -> str:
    """In a line: what is wrong with a description."""
    told = "; ".join(f"{d.origin}: {d.message}" for d in error.diagnostics if d.is_error)
    return told or str(error)


def _spawn_robot(simulation: Simulation, name: str, place: Transform, file: str) -> None:
    x, y, _ = place.translation.tolist()
    simulation.spawn_model(load_robot(file).require(), name or None, x, y, place.yaw)


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
