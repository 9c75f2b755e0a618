"""Whether two robots behave the same: a comparison of everything in their models that a simulation reads.

Comments, the order of elements, white space, colours, materials and most visuals do not matter, nor does how
a value is written or where a file is. When in doubt, two models are different, and a simulation decides.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TypeAlias

from kbot.kinematics.drive.declared import declared_drives
from kbot.kinematics.drive.nearby import with_nearby_drive
from kbot.kinematics.drive.wheels import is_caster, rigid_links
from kbot.model import Capsule, Collision, Cylinder, Geometry, Joint, Link, Mesh, RobotModel, Sphere, Visual
from kbot.text import DescriptionError, DiagnosticCollector, Element, read_source
from kbot.text.files import from_file_uri, read_bytes
from kbot.text.numbers import NUMBER
from kbot.text.yaml import YamlError, read_yaml

Value: TypeAlias = "str | bool | float | tuple[Value, ...] | Mapping[str, Value] | None"
"""What behaviour depends on, as plain values."""

RELATIVE = 1e-9
"""Relative difference of equal numbers: `0.1` and `0.10`, `1.57079632679` and pi/2."""
ABSOLUTE = 1e-15
"""Difference of numbers that are 0 except for rounding, such as the cosine of pi/2, which is 6e-17. The
smallest moment of inertia that the physics engine uses is 1e-14."""
YAML_SUFFIXES = (".yaml", ".yml")
_LOOKS = "material"
"""The child of `<gazebo>` that only sets colours."""
_PLACE = re.compile(r"[A-Za-z]:[\\/]|/|file://")
"""The start of a word that names a file."""


def is_same(one: Value, other: Value) -> bool:
    """Whether two values are equal, numbers with a tolerance."""
    if isinstance(one, bool) or isinstance(other, bool):
        return one is other
    if isinstance(one, float) and isinstance(other, float):
        both_nan = math.isnan(one) and math.isnan(other)
        return both_nan or math.isclose(one, other, rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(is_same(one[key], other[key]) for key in one)
    return one == other


def behaviour(robot: RobotModel) -> Value:
    """Everything in a robot's model on which its motion and sensors depend.

    The files that the model names are read: controller parameters, and the meshes that matter.
    """
    robot = with_nearby_drive(robot, DiagnosticCollector())
    moved = _moved(robot)
    return {
        "name": robot.name,
        "links": {name: _link(robot, link, name in moved) for name, link in robot.links.items()},
        "joints": {name: _joint(joint) for name, joint in robot.joints.items()},
        "extensions": _extensions(robot),
    }


def relevant_meshes(robot: RobotModel) -> Iterator[Mesh]:
    """The meshes on which behaviour depends."""
    moved = _moved(robot)
    for name, link in robot.links.items():
        for shape in _shapes_that_matter(robot, link, name in moved):
            if isinstance(shape.geometry, Mesh):
                yield shape.geometry


def parameter_files(robot: RobotModel) -> Iterator[str]:
    """The paths of the parameter files that the robot's extensions name."""
    for extension in robot.extensions:
        for element in (extension, *extension.descendants()):
            for word in " ".join((element.text, *element.attributes.values())).split():
                path = _path(word)
                if path is not None and path.endswith(YAML_SUFFIXES):
                    yield path


def _moved(robot: RobotModel) -> set[str]:
    """The links that joints move against the robot's body."""
    movable = (joint for joint in robot.joints.values() if joint.is_movable)
    return {link for joint in movable for link in rigid_links(robot, joint.child)}


def _link(robot: RobotModel, link: Link, is_moved: bool) -> Value:
    inertial = link.inertial
    return (
        None if inertial is None else (inertial.mass, inertial.tensor, inertial.pose.xyz, inertial.pose.rpy),
        # the friction by direction is that of the first collision, so their order may matter
        tuple(
            (isinstance(shape, Collision), shape.pose.xyz, shape.pose.rpy, _geometry(shape.geometry))
            for shape in _shapes_that_matter(robot, link, is_moved)
        ),
    )


def _shapes_that_matter(robot: RobotModel, link: Link, is_moved: bool) -> tuple[Visual | Collision, ...]:
    """The collisions of a link, and its visuals if they replace collisions.

    A wheel or caster takes its size from visuals if no collision is round, and an impossible inertia becomes
    that of the visuals if there are no collisions (`kinematics/drive/wheels.py`, `sim/engine/inertia.py`).
    """
    if any(isinstance(shape.geometry, Cylinder | Sphere | Capsule) for shape in link.collisions):
        return link.collisions
    above = robot.parent_joint.get(link.name)
    may_roll = is_moved or (above is not None and is_caster(above))
    may_weigh = link.inertial is not None and not link.collisions
    return (*link.collisions, *link.visuals) if may_roll or may_weigh else link.collisions


def _geometry(geometry: Geometry) -> Value:
    if isinstance(geometry, Mesh):
        return ("Mesh", content(geometry.path), geometry.scale)
    sizes = (getattr(geometry, name, None) for name in ("size", "radius", "length"))
    return (type(geometry).__name__, *sizes)


def _joint(joint: Joint) -> Value:
    dynamics, mimic, safety = joint.dynamics, joint.mimic, joint.safety
    return (
        str(joint.type),
        joint.parent,
        joint.child,
        joint.pose.xyz,
        joint.pose.rpy,
        joint.axis,
        joint.limit is not None,
        joint.range,
        joint.effort_limit,
        joint.speed_limit,
        (0.0, 0.0) if dynamics is None else (dynamics.damping, dynamics.friction),
        None if mimic is None else (mimic.joint, mimic.multiplier, mimic.offset),
        None
        if safety is None
        else (safety.soft_lower_limit, safety.soft_upper_limit, safety.k_position, safety.k_velocity),
    )


def _extensions(robot: RobotModel) -> Value:
    """`<gazebo>`, `<transmission>`, `<ros2_control>` and other elements, by tag and by the link or name that
    they are about."""
    about: dict[str, list[Element]] = defaultdict(list)
    for extension in robot.extensions:
        given = extension.attributes
        about[f"{extension.tag} {given.get('reference', '')} {given.get('name', '')}"].append(extension)
    # with several drives, the first one drives the robot
    by_name = len(declared_drives(robot)) < 2
    found: dict[str, Value] = {}
    for key, elements in about.items():
        if elements[0].tag == "gazebo":
            tags = _gazebo(elements, by_name=by_name)
            if tags:
                found[key] = tags
        else:
            found[key] = tuple(_element(element) for element in elements)
    return found


def _gazebo(elements: list[Element], *, by_name: bool) -> Mapping[str, Value]:
    """The children of the `<gazebo>` elements about one link, by tag. One may be split into several."""
    children: dict[str, list[tuple[int, Element]]] = defaultdict(list)
    for index, element in enumerate(elements):
        for child in element.elements():
            if child.tag == "visual":
                children["visual plugin"] += [(index, plugin) for plugin in child.elements("plugin")]
            elif child.tag != _LOOKS:
                children[child.tag].append((index, child))
    found: dict[str, Value] = {}
    for tag, tagged in children.items():
        if tag == "sensor" or (tag == "plugin" and by_name):
            tagged.sort(key=lambda item: _name(item[1]))
        if tag in ("sensor", "plugin"):
            found[tag] = tuple(_element(child) for _, child in tagged)
        else:
            # the first of an element counts, but the last of several elements
            ranks = {index: float(rank) for rank, index in enumerate(dict.fromkeys(i for i, _ in tagged))}
            found[tag] = tuple((ranks[index], _element(child)) for index, child in tagged)
    return found


def _name(element: Element) -> tuple[str, str]:
    return element.attributes.get("name", ""), element.attributes.get("filename", "")


def _element(element: Element) -> Value:
    """An element as written, without the order of different children, comments and white space."""
    children: dict[str, list[Element]] = defaultdict(list)
    for child in element.elements():
        children[child.tag].append(child)
    for tag in ("joint", "sensor"):
        children.get(tag, []).sort(key=_name)
    return (
        {name: _words(value) for name, value in element.attributes.items()},
        _words(element.text),
        {tag: tuple(_element(child) for child in tagged) for tag, tagged in children.items()},
    )


def _words(text: str) -> Value:
    return tuple(_word(word) for word in text.split())


def _word(word: str) -> Value:
    if NUMBER.fullmatch(word):
        return float(word)
    path = _path(word)
    if path is None:
        return word
    if path.endswith(YAML_SUFFIXES):
        return _parameters(path)
    # where a file is does not matter
    return content(path) if Path(path).is_file() else Path(path).name


def _path(word: str) -> str | None:
    """The absolute path that a word of a description names."""
    if not _PLACE.match(word):
        return None
    return from_file_uri(word.removeprefix("file://")) if word.startswith("file://") else word


def _parameters(path: str) -> Value:
    """The content of a file of parameters. If it cannot be read, None: KBot then ignores it."""
    try:
        return _plain(read_yaml(read_source(path)).data)
    except (DescriptionError, YamlError):
        return None


def _plain(data: object) -> Value:
    if isinstance(data, dict):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return tuple(_plain(value) for value in data)
    if isinstance(data, bool) or data is None:
        return data
    if isinstance(data, int | float):
        return float(data)
    return str(data)


def content(path: str | None) -> Value:
    """A text that differs for files with different content. None for a file that cannot be read."""
    try:
        return None if path is None else hashlib.sha256(read_bytes(path, from_pipe=False)).hexdigest()
    except OSError:
        return None
