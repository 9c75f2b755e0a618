"""`<joint>` and what is in it, as urdfdom reads it."""

from __future__ import annotations

from kbot.model._links import read_pose
from kbot.model._values import Values, parts
from kbot.model.joint import Dynamics, Joint, JointType, Limit, Mimic, SafetyController
from kbot.text import Element, Origin
from kbot.text.suggest import did_you_mean

_TYPES = [str(t) for t in JointType]


def read_joint(element: Element, name: str, values: Values) -> Joint | None:
    """A joint; None and errors when its type or one of its links is missing or unknown."""
    kind = _read_type(element, name, values)
    inner = parts(element)
    parent, child = (_read_end(element, inner.get(tag), name, tag, values) for tag in ("parent", "child"))
    axis = inner.get("axis")
    limit, dynamics = inner.get("limit"), inner.get("dynamics")
    mimic, safety = inner.get("mimic"), inner.get("safety_controller")
    pose = read_pose(inner.get("origin"), values)
    x_axis = (1.0, 0.0, 0.0)
    direction = x_axis if axis is None else values.vector(axis, "xyz", x_axis)
    read_limit = _read_limit(limit, values) if limit is not None else None
    read_dynamics = _read_dynamics(dynamics, values) if dynamics is not None else None
    read_mimic = _read_mimic(mimic, values) if mimic is not None else None
    read_safety = _read_safety(safety, values) if safety is not None else None
    if kind is None or parent is None or child is None:
        return None
    return Joint(
        name=name,
        type=kind,
        parent=parent[0],
        child=child[0],
        pose=pose,
        axis=direction,
        axis_origin=None if axis is None else axis.attribute_origin("xyz"),
        limit=read_limit,
        dynamics=read_dynamics,
        mimic=read_mimic,
        safety=read_safety,
        origin=element.origin,
        parent_origin=parent[1],
        child_origin=child[1],
    )


def _read_type(element: Element, name: str, values: Values) -> JointType | None:
    text = values.required(element, "type")
    if text is None:
        return None
    try:
        return JointType(text)
    except ValueError:
        hint = did_you_mean(text, _TYPES) or "one of " + ", ".join(_TYPES)
        message = f"joint '{name}' has the unknown type '{text}'"
        values.error("U011", message, element.attribute_origin("type"), hint)
        return None


def _read_end(
    element: Element, end: Element | None, name: str, tag: str, values: Values
) -> tuple[str, Origin] | None:
    if end is None:
        values.error("U014", f"joint '{name}' lacks <{tag}>", element.origin)
        return None
    link = values.required(end, "link")
    return None if link is None else (link, end.attribute_origin("link"))


def _read_limit(element: Element, values: Values) -> Limit:
    lower, upper, effort, velocity = (
        values.optional_number(element, name) for name in ("lower", "upper", "effort", "velocity")
    )
    return Limit(lower, upper, effort, velocity, element.origin)


def _read_dynamics(element: Element, values: Values) -> Dynamics:
    damping, friction = (values.number(element, name, 0.0, 0.0) for name in ("damping", "friction"))
    return Dynamics(damping, friction, element.origin)


def _read_mimic(element: Element, values: Values) -> Mimic | None:
    joint = values.required(element, "joint")
    multiplier = values.number(element, "multiplier", 1.0, 1.0)
    offset = values.number(element, "offset", 0.0, 0.0)
    return None if joint is None else Mimic(joint, multiplier, offset, element.origin)


def _read_safety(element: Element, values: Values) -> SafetyController:
    names = ("soft_lower_limit", "soft_upper_limit", "k_position")
    lower, upper, k_position = (values.number(element, name, 0.0, 0.0) for name in names)
    k_velocity = values.number(element, "k_velocity", None, 0.0)
    return SafetyController(lower, upper, k_position, k_velocity, element.origin)
