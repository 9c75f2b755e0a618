"""Descriptions that peers send: nothing in them is evaluated, and they name only allowed files."""

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
    usual: str = "urdf",
) -> str:
    """Spawn what a text describes, a robot of URDF or a model of SDF, and say so. What its first tag does
    not tell is taken for the `usual` one.

    Raises:
        DescriptionError, KbotError: it cannot be used, or cannot stand there.
    """
    if not xml.strip():
        raise KbotError(f"the text of the model is empty: {usual.upper()} is needed")
    first = _FIRST_TAG.match(xml)
    tag = first["tag"] if first is not None else ""
    kind = {"sdf": "sdf", "gazebo": "sdf", "robot": "urdf"}.get(tag, usual)
    if not xml.lstrip().startswith("<"):  # else it would be the name of a file
        raise KbotError(f"the text of the model is no {kind.upper()}: it does not begin with a tag")
    if kind == "sdf":
        return _spawn_sdf(simulation, name, xml, place)
    reach = Reach()
    # the name is not yet known to be one: it must not lead into a folder
    robot = read_urdf_text(xml, f"{name if is_model_name(name) else 'model'}.urdf", reach)
    _check_files(robot, reach)
    return _stand(simulation, robot, name, place, namespace)


def told_of(error: DescriptionError) -> str:
    """In a line: what is wrong with a description."""
    told = "; ".join(f"{d.origin}: {d.message}" for d in error.diagnostics if d.is_error)
    return told or str(error)


def _spawn_sdf(simulation: Simulation, name: str, sdf: str, place: Transform) -> str:
    if name and not is_model_name(name):
        raise KbotError(
            f"{reprlib.repr(name)} is no model's name: letters, digits and _ only, a letter first"
        )
    put = simulation.models.spawn_sdf(sdf, name or None, place, is_confined=True)[0].belongs_to
    x, y, z = place.translation.tolist()
    return f"{put} is put at {x:.3f}, {y:.3f}, {z:.3f}"


def _stand(
    simulation: Simulation, robot: RobotModel, name: str, place: Transform, namespace: str | None
) -> str:
    x, y, _ = place.translation.tolist()
    spawned = simulation.models.spawn_model(robot, name or None, x, y, place.yaw, namespace=namespace)
    where = f"/{spawned.naming.namespace}" if spawned.naming.namespace else "the root"
    return f"{spawned.name} stands on the ground at {x:.3f}, {y:.3f}; its topics are under {where}"


def _check_files(robot: RobotModel, reach: Reach) -> None:
    """Raises DescriptionError: a mesh, or a plugin's file of parameters, is not within reach, or a mesh is
    none."""
    wrong: dict[str, Origin] = {}
    for link in robot.links.values():
        for shape in (part.geometry for part in link.shapes):
            said = _wrong_with(shape) if isinstance(shape, Mesh) else ""
            if said:
                wrong.setdefault(said, shape.origin)
    for extension in robot.extensions:
        for plugin in extension.elements("plugin"):
            for element in plugin.elements("parameters"):
                file = element.text.strip()
                if not reach.holds(file):
                    wrong.setdefault(NOT_IN_REACH.format(f"the file {file}"), element.origin)
    if wrong:
        raise DescriptionError([Diagnostic("F008", Severity.ERROR, m, o) for m, o in wrong.items()])


def _wrong_with(mesh: Mesh) -> str:
    if mesh.path is None:
        return NOT_IN_REACH.format(f"the mesh {mesh.uri}")
    try:
        load_mesh(mesh.path)
    except KbotError as error:
        return str(error)
    return ""
