"""Spawns descriptions that peers send. Nothing in them is evaluated, and they can name only allowed files."""

from __future__ import annotations

import re
import reprlib
from dataclasses import dataclass

from kbot.kinematics.transform import Transform
from kbot.model import Mesh, RobotModel
from kbot.model.load import read_urdf_text
from kbot.model.meshes import ReadMesh, keep_mesh, read_mesh
from kbot.sim import Simulation
from kbot.sim.naming import is_model_name
from kbot.text import DescriptionError, Diagnostic, KbotError, Origin, Severity
from kbot.worker import PEER_READING, LimitExceeded
from kbot.world.sdf.reach import Reach
from kbot.world.sdf.resources import NOT_IN_REACH
from kbot.world.things import SdfModel, read_sdf_model

_FIRST_TAG = re.compile(r"(?>\s|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>)*+<(?P<tag>[\w:.-]+)", re.DOTALL)

MOST_LINKS = 250
"""Links of a model that a peer spawns, several times those of a humanoid with hands.

The simulation stands still while the physics engine adds a model: a third of a second for 250 links, and
twelve seconds for 1000."""


@dataclass(frozen=True, slots=True)
class PeerModel:
    """A model that a peer sent: a robot with its mesh files, or an SDF model."""

    model: RobotModel | SdfModel
    meshes: tuple[ReadMesh, ...] = ()


def read_in_worker(name: str, xml: str, default_format: str) -> PeerModel:
    """Read a model without delaying the simulation.

    Raises:
        DescriptionError, KbotError: the text cannot be used.
    """
    try:
        found = PEER_READING.call(read_peer_model, name, xml, default_format)
    except LimitExceeded as error:
        raise KbotError(f"reading the model {error}") from None
    for mesh in found.meshes:
        keep_mesh(mesh)
    return found


def read_peer_model(name: str, xml: str, default_format: str) -> PeerModel:
    """Read a robot from URDF or a model from SDF. The first tag gives the format; for any other tag it is
    `default_format`.

    Raises:
        DescriptionError, KbotError: the text cannot be used.
    """
    if not xml.strip():
        raise KbotError(f"the model text is empty: send {default_format.upper()}")
    first = _FIRST_TAG.match(xml)
    tag = first["tag"] if first is not None else ""
    kind = {"sdf": "sdf", "gazebo": "sdf", "robot": "urdf"}.get(tag, default_format)
    if not xml.lstrip().startswith("<"):  # the readers take other texts for the name of a file
        raise KbotError(f"the model text is not {kind.upper()}: it does not begin with a tag")
    if kind == "sdf":
        if name and not is_model_name(name):
            raise KbotError(
                f"{reprlib.repr(name)} is not a model name: use letters, digits and _, and begin with"
                " a letter"
            )
        model = read_sdf_model(xml, name or None, is_confined=True)
        _require_few(len(model.bodies))
        return PeerModel(model)
    reach = Reach()
    # an unchecked name could have a path in it
    robot = read_urdf_text(xml, f"{name if is_model_name(name) else 'model'}.urdf", reach)
    _require_few(len(robot.links))
    return PeerModel(robot, _read_files(robot, reach))


def _require_few(links: int) -> None:
    if links > MOST_LINKS:
        raise KbotError(f"the model has {links} links: a peer may spawn {MOST_LINKS} at most")


def spawn(
    simulation: Simulation, found: PeerModel, name: str, place: Transform, namespace: str | None = None
) -> str:
    """Spawn a model that was read, and return a sentence that reports it.

    Raises:
        DescriptionError, KbotError: it cannot be simulated, or another object is in its place.
    """
    x, y, z = place.translation.tolist()
    if isinstance(found.model, SdfModel):
        body = simulation.models.spawn_sdf(found.model, name or None, place)[0]
        return f"spawned {body.belongs_to} at {x:.3f}, {y:.3f}, {z:.3f}"
    robot = simulation.models.spawn_model(found.model, name or None, x, y, place.yaw, namespace=namespace)
    where = f"/{robot.naming.namespace}" if robot.naming.namespace else "the root"
    return f"spawned {robot.name} on the ground at {x:.3f}, {y:.3f}; its topics are under {where}"


def summary_of(error: DescriptionError) -> str:
    """The errors of a description in one line."""
    errors = "; ".join(f"{d.origin}: {d.message}" for d in error.diagnostics if d.is_error)
    return errors or str(error)


def _read_files(robot: RobotModel, reach: Reach) -> tuple[ReadMesh, ...]:
    """Return the robot's mesh files.

    Raises:
        DescriptionError: the robot names a mesh or a parameter file that peers may not use, or a broken mesh.
    """
    wrong: dict[str, Origin] = {}
    meshes: dict[str, ReadMesh] = {}
    for link in robot.links.values():
        for shape in (part.geometry for part in link.shapes):
            if not isinstance(shape, Mesh):
                continue
            if shape.path is None:
                wrong.setdefault(NOT_IN_REACH.format(f"the mesh {shape.uri}"), shape.origin)
                continue
            mesh = meshes[shape.path] = read_mesh(shape.path)
            if mesh.error:
                wrong.setdefault(mesh.error, shape.origin)
    for extension in robot.extensions:
        for plugin in extension.elements("plugin"):
            for element in plugin.elements("parameters"):
                file = element.text.strip()
                if not reach.holds(file):
                    wrong.setdefault(NOT_IN_REACH.format(f"the file {file}"), element.origin)
    if wrong:
        raise DescriptionError([Diagnostic("F008", Severity.ERROR, m, o) for m, o in wrong.items()])
    return tuple(meshes.values())
