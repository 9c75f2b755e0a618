"""Spawns descriptions that peers send. Nothing in them is evaluated, and they can name only allowed files."""

from __future__ import annotations

import re
import reprlib

from kbot.kinematics.transform import Transform
from kbot.model import Mesh, RobotModel
from kbot.model.load import read_urdf_text
from kbot.model.meshes import load_mesh
from kbot.sim import Simulation
from kbot.sim.naming import is_model_name
from kbot.text import DescriptionError, Diagnostic, KbotError, Origin, Severity
from kbot.world.sdf.reach import Reach
from kbot.world.sdf.resources import NOT_IN_REACH

_FIRST_TAG = re.compile(r"(?>\s|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>)*+<(?P<tag>[\w:.-]+)", re.DOTALL)


def spawn_text(
    simulation: Simulation,
    name: str,
    xml: str,
    place: Transform,
    namespace: str | None = None,
    default_format: str = "urdf",
) -> str:
    """Spawn a robot from URDF or a model from SDF, and return a sentence that reports it. The first tag gives
    the format; for any other tag it is `default_format`.

    Raises:
        DescriptionError, KbotError: the text cannot be used, or another object is in its place.
    """
    if not xml.strip():
        raise KbotError(f"the model text is empty: send {default_format.upper()}")
    first = _FIRST_TAG.match(xml)
    tag = first["tag"] if first is not None else ""
    kind = {"sdf": "sdf", "gazebo": "sdf", "robot": "urdf"}.get(tag, default_format)
    if not xml.lstrip().startswith("<"):  # the readers take other texts for the name of a file
        raise KbotError(f"the model text is not {kind.upper()}: it does not begin with a tag")
    if kind == "sdf":
        return _spawn_sdf(simulation, name, xml, place)
    reach = Reach()
    # an unchecked name could have a path in it
    robot = read_urdf_text(xml, f"{name if is_model_name(name) else 'model'}.urdf", reach)
    _check_files(robot, reach)
    return _spawn_robot(simulation, robot, name, place, namespace)


def summary_of(error: DescriptionError) -> str:
    """The errors of a description in one line."""
    errors = "; ".join(f"{d.origin}: {d.message}" for d in error.diagnostics if d.is_error)
    return errors or str(error)


def _spawn_sdf(simulation: Simulation, name: str, sdf: str, place: Transform) -> str:
    if name and not is_model_name(name):
        raise KbotError(
            f"{reprlib.repr(name)} is not a model name: use letters, digits and _, and begin with a letter"
        )
    spawned = simulation.models.spawn_sdf(sdf, name or None, place, is_confined=True)[0].belongs_to
    x, y, z = place.translation.tolist()
    return f"spawned {spawned} at {x:.3f}, {y:.3f}, {z:.3f}"


def _spawn_robot(
    simulation: Simulation, robot: RobotModel, name: str, place: Transform, namespace: str | None
) -> str:
    x, y, _ = place.translation.tolist()
    spawned = simulation.models.spawn_model(robot, name or None, x, y, place.yaw, namespace=namespace)
    where = f"/{spawned.naming.namespace}" if spawned.naming.namespace else "the root"
    return f"spawned {spawned.name} on the ground at {x:.3f}, {y:.3f}; its topics are under {where}"


def _check_files(robot: RobotModel, reach: Reach) -> None:
    """Raises DescriptionError: the robot names a mesh or a parameter file that peers may not use, or a broken
    mesh."""
    wrong: dict[str, Origin] = {}
    for link in robot.links.values():
        for shape in (part.geometry for part in link.shapes):
            error = _mesh_error(shape) if isinstance(shape, Mesh) else ""
            if error:
                wrong.setdefault(error, shape.origin)
    for extension in robot.extensions:
        for plugin in extension.elements("plugin"):
            for element in plugin.elements("parameters"):
                file = element.text.strip()
                if not reach.holds(file):
                    wrong.setdefault(NOT_IN_REACH.format(f"the file {file}"), element.origin)
    if wrong:
        raise DescriptionError([Diagnostic("F008", Severity.ERROR, m, o) for m, o in wrong.items()])


def _mesh_error(mesh: Mesh) -> str:
    if mesh.path is None:
        return NOT_IN_REACH.format(f"the mesh {mesh.uri}")
    try:
        load_mesh(mesh.path)
    except KbotError as error:
        return str(error)
    return ""
