"""Rules about lengths in a wrong unit."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.model import Box, Capsule, Cylinder, Geometry, Joint, JointType, Sphere
from kbot.text import Element, Origin, Severity
from kbot.xacro.binding import READY, Binding
from kbot.xacro.not_a_number import TOKEN

_LONG = 10.0
"""m: parts of robots are shorter. 10 mm is the thickness of a plate."""
_LARGE_WHEEL = 2.0
"""m: radius and width of a cylinder or sphere that turns. The largest truck tyres have a radius of 2 m."""
_FAR_WHEEL = 5.0
"""m: distance of an axle from its parent link. That of a long car is 3.5 m."""
_LEAST = 2.0
"""m: a smaller number in an expression may be a count or a sign."""
_MILLIMETRE = 1e-3


@rule("G113", "length-in-millimetres", Severity.WARNING, "robot")
def length_in_millimetres(context: Context) -> Found:
    """A length is so large that it is probably in millimetres: a size or position of more than 10 m, a wheel
    with a radius of more than 2 m, or an axle more than 5 m away from its link.

    Why: URDF lengths are in metres. A plate of 160 is 160 m long, and no tool reports it. While a length is
    in millimetres, KBot does not report findings that depend on sizes.

    Example: `<xacro:property name="base_width" value="160"/>`

    Fix: Divide by 1000: `value="0.16"`. If the robot really is so large, suppress the finding.

    Autofix: unsafe: KBot divides the number by 1000, at the property that has it.
    """
    seen = set[Origin]()
    long_ones = list(_long_ones(context))
    elements = {e.origin: e for e in context.elements} if long_ones else {}
    for place, attribute, length in long_ones:
        element = elements.get(place)
        if element is None or attribute not in element.attributes:
            continue
        for origin, name, written in _numbers(element, attribute, length):
            if origin in seen:
                continue
            seen.add(origin)
            if not written:  # it is computed, so no number of the file is known to be wrong
                yield Finding(origin, f"{name}: {length:g} m looks like millimetres", "lengths are in metres")
                continue
            metres = f"{float(written) * _MILLIMETRE:.10g}"
            yield Finding(
                origin,
                f"{name}: {float(written):g} m looks like millimetres",
                f"lengths are in metres: write {metres}",
                fix=context.replace_plain(origin, metres, f"write {metres}", safe=False)
                if origin.span.text == written
                else None,
            )


def _long_ones(context: Context) -> Iterator[tuple[Origin, str, float]]:
    """The elements and attributes that have a length that is too large, with this length in m."""
    robot = context.robot
    turning = {j.child for j in context.sure_joints if j.type is JointType.CONTINUOUS}
    for link in context.sure_links:
        for shape in link.shapes:
            is_wheel = link.name in turning and isinstance(shape.geometry, Cylinder | Sphere)
            longest = _LARGE_WHEEL if is_wheel else _LONG
            for attribute, size in _sizes(shape.geometry):
                if size > longest:
                    yield shape.geometry.origin, attribute, size
            if shape.pose.origin is not None and max(map(abs, shape.pose.xyz)) > _LONG:
                yield shape.pose.origin, "xyz", max(map(abs, shape.pose.xyz))
    for joint in context.sure_joints:
        if joint.pose.origin is None or (joint.parent == robot.root and _is_placed(joint)):
            continue
        farthest = max(map(abs, joint.pose.xyz))
        if farthest > (_FAR_WHEEL if joint.type is JointType.CONTINUOUS else _LONG):
            yield joint.pose.origin, "xyz", farthest


def _is_placed(joint: Joint) -> bool:
    """Whether a joint only places the robot in a world."""
    return joint.parent in ("world", "map", "odom")


def _sizes(geometry: Geometry) -> Iterator[tuple[str, float]]:
    match geometry:
        case Box(size=size):
            yield "size", max(size)
        case Sphere(radius=radius):
            yield "radius", radius
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length):
            yield from (("radius", radius), ("length", length))


def _numbers(element: Element, attribute: str, length: float) -> Iterator[tuple[Origin, str, str]]:
    """The numbers that make a length too large, each with its place, name and text: arguments, properties and
    parameters that are written as numbers, or else the number of the attribute. The text of a computed one is
    empty."""
    found = list(_inputs((element.inputs or {}).get(attribute, ())))
    large = [b for b in found if abs(b.value) >= min(_LONG, length)] or found
    for binding in large:
        if binding.origin is not None:
            given = "the given " if binding.is_given else ""
            yield binding.origin, f"{given}{binding.name}", _written(binding)
    if not large:
        origin = element.attribute_origin(attribute)
        words, tokens = element.attributes[attribute].split(), TOKEN.findall(origin.span.text)
        index = max(range(len(words)), key=lambda index: abs(float(words[index])))
        written = words[index] if tokens[index : index + 1] == [words[index]] else ""
        yield origin, f"'{attribute}' of <{element.tag}>", written


def _written(binding: Binding) -> str:
    """How a value is written, in the file or by the caller."""
    if binding.is_given:
        return str(binding.value)
    return binding.node.attributes.get(binding.attribute, "$") if binding.node is not None else "$"


def _inputs(bindings: tuple[Binding, ...]) -> Iterator[Binding]:
    """The bindings that are written as numbers of at least 2, among these and what they were computed
    from."""
    waiting, seen = list(bindings), set[int]()
    while waiting:
        binding = waiting.pop()
        if id(binding) in seen or binding.state != READY:
            continue
        seen.add(id(binding))
        waiting += binding.inputs
        if "$" not in _written(binding) and _is_number(binding.value) and abs(binding.value) >= _LEAST:
            yield binding


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
