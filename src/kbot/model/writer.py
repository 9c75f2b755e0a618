"""Writes a robot as URDF text. Reading the text gives the same robot with exactly the same numbers."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.model.geometry import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from kbot.model.robot import Collision, Inertial, Joint, Link, Material, Pose, RobotModel, Visual
from kbot.text import Element, Source
from kbot.xacro.serialise import serialise

_WRITTEN = Source("", "")


def to_urdf(robot: RobotModel) -> str:
    """The robot as a URDF document. Extensions such as `<gazebo>` are written unchanged."""
    root = _element("robot", name=robot.name)
    root.children.extend(_material(material) for material in robot.materials.values())
    root.children.extend(_link(link) for link in robot.links.values())
    root.children.extend(_joint(joint) for joint in robot.joints.values())
    root.children.extend(robot.extensions)
    return serialise([root])


def _element(tag: str, *children: Element | None, **attributes: str) -> Element:
    element = Element(tag, attributes, _WRITTEN, 0, 0)
    element.children.extend(child for child in children if child is not None)
    return element


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Sequence[float]) -> str:
    return " ".join(_number(value) for value in values)


def _material(material: Material) -> Element:
    color = _element("color", rgba=_numbers(material.rgba)) if material.rgba else None
    texture = _element("texture", filename=material.texture) if material.texture is not None else None
    return _element("material", color, texture, name=material.name)


def _link(link: Link) -> Element:
    inertial = _inertial(link.inertial) if link.inertial else None
    shapes = [_shape("visual", v) for v in link.visuals] + [_shape("collision", c) for c in link.collisions]
    return _element("link", inertial, *shapes, name=link.name)


def _pose(pose: Pose) -> Element:
    return _element("origin", xyz=_numbers(pose.xyz), rpy=_numbers(pose.rpy))


def _inertial(inertial: Inertial) -> Element:
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    return _element(
        "inertial",
        _pose(inertial.pose),
        _element("mass", value=_number(inertial.mass)),
        _element("inertia", **{name: _number(getattr(inertial, name)) for name in names}),
    )


def _shape(tag: str, part: Visual | Collision) -> Element:
    material = _material(part.material) if isinstance(part, Visual) and part.material else None
    name = {"name": part.name} if part.name else {}
    geometry = _element("geometry", _geometry(part.geometry))
    return _element(tag, _pose(part.pose), geometry, material, **name)


def _geometry(shape: Geometry) -> Element:
    match shape:
        case Box(size=size):
            return _element("box", size=_numbers(size))
        case Sphere(radius=radius):
            return _element("sphere", radius=_number(radius))
        case Cylinder(radius=radius, length=length):
            return _element("cylinder", radius=_number(radius), length=_number(length))
        case Capsule(radius=radius, length=length):
            return _element("capsule", radius=_number(radius), length=_number(length))
        case Mesh(uri=uri, scale=scale):
            return _element("mesh", filename=uri, scale=_numbers(scale))


def _joint(joint: Joint) -> Element:
    axis = _element("axis", xyz=_numbers(joint.axis)) if joint.axis_origin is not None else None
    return _element(
        "joint",
        _pose(joint.pose),
        _element("parent", link=joint.parent),
        _element("child", link=joint.child),
        axis,
        _fields("limit", joint.limit, "lower", "upper", "effort", "velocity"),
        _fields("dynamics", joint.dynamics, "damping", "friction"),
        _mimic(joint),
        _fields(
            "safety_controller",
            joint.safety,
            "soft_lower_limit",
            "soft_upper_limit",
            "k_position",
            "k_velocity",
        ),
        name=joint.name,
        type=str(joint.type),
    )


def _fields(tag: str, part: object, *names: str) -> Element | None:
    """An element with the numbers of `part` that are not None. None without a part."""
    if part is None:
        return None
    values = {name: getattr(part, name) for name in names}
    return _element(tag, **{name: _number(v) for name, v in values.items() if v is not None})


def _mimic(joint: Joint) -> Element | None:
    mimic = joint.mimic
    if mimic is None:
        return None
    return _element(
        "mimic", joint=mimic.joint, multiplier=_number(mimic.multiplier), offset=_number(mimic.offset)
    )
