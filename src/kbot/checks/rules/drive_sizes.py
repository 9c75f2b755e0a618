"""Rules that compare the wheel sizes of plugins, controllers and properties with the robot's wheels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from kbot.checks.context import Context
from kbot.checks.edits import replace_value
from kbot.checks.registry import Finding, Found, reported, rule
from kbot.kinematics.drive.declared import DIAMETER
from kbot.kinematics.drive.findings import joint_places, separation_is_off
from kbot.kinematics.drive.wheels import Pair
from kbot.text import Element, Origin, Related, Severity
from kbot.text.numbers import NUMBER
from kbot.text.xml import Text
from kbot.xacro.binding import Binding

_SEPARATION = ("wheel_separation", "wheelSeparation")
_RADIUS = ("wheel_radius", *DIAMETER)
"""The names under which plugins and controllers read these sizes. Other names, such as `wheel_spacing`, are
also given to gaps and widths."""
_NEAR = 2.0
"""Largest ratio between a property and the size that it gives. A name alone does not prove what it gives."""


def _conventions(pair: Pair) -> list[float]:
    """The distances that authors call wheel separation: between middles, inner faces and outer faces."""
    width = max(pair.left.width, pair.right.width)
    return [pair.separation, pair.separation - width, pair.separation + width]


@rule("D105", "separation-differs", Severity.WARNING, "robot")
def separation_differs(context: Context) -> Found:
    """The wheel separation in a plugin, controller or property differs from the distance between the wheels.

    Why: Odometry computes yaw as (right - left) / separation. With 0.15 m for wheels that are 0.174 m apart,
    it reports every turn 16 % too large. After one turn it is 58 degrees off. A property counts if a plugin
    reads it as the separation, or if nothing reads it and it has the name and nearly the value of one. A
    property from which the wheels' positions are computed, such as a gap, is not a separation.

    Example: `<wheelSeparation>0.15</wheelSeparation>` on wheels 0.174 m apart.

    Fix: Compute the separation once, and use it for the joints and for the plugin:
    `${base_width + 2*base_wheel_gap}`. If the size is right and its multiplier makes it wrong, write 1 for
    the multiplier, unless it was measured on the real robot.

    Autofix: unsafe: KBot writes the distance between the wheels, or 1 for a multiplier, in place of a number,
    not of an expression.
    """
    for finding in reported(context.drive_findings, "D105"):
        yield _at_property(context, finding)
    pairs = context.level_pairs
    if not pairs or context.unsure & {w.link for w in context.base.wheels}:
        return
    true, related = context.wheel_pairs[0].separation, joint_places(context.wheel_pairs[0])
    for name, value, element in _unused(context, _SEPARATION):
        if (
            true / _NEAR <= value <= true * _NEAR
            and all(abs(value - d) > 0.01 * true for d in _conventions(pairs[0]))
            and abs(value - true / 2) > 0.01 * true  # half the separation places one wheel
        ):
            if any(_conventions(p)[0] and abs(value - p.separation) < 0.01 * value for p in pairs):
                continue
            yield Finding(
                element.origin,
                f"unused property '{name}': " + separation_is_off(value, true),
                f"write {true:.4g}, or compute it from the properties that place the joints",
                related,
                replace_value(element, "value", f"{true:.6g}", f"write {true:.6g}", safe=False),
            )


def _at_property(context: Context, finding: Finding) -> Finding:
    """The finding at the property that a plugin reads as the separation of two wheels, if the property is a
    number that does not place the wheels. Otherwise the finding itself."""
    pairs = context.wheel_pairs
    sizes = [controller.separation for controller in context.declared_drives]
    given = next((size.given for size in sizes if size and size.given.origin == finding.origin), None)
    binding = _read_as(context, finding.origin) if given is not None and len(pairs) == 1 else None
    if given is None or binding is None or binding.node is None or binding.value != given.number:
        return finding
    if any(binding.node is placing.node for placing in _placing(context, pairs)):
        return finding  # another value would move the wheels
    right = f"{pairs[0].separation:.6g}"
    fix = replace_value(binding.node, "value", right, f"write {right}", safe=False)
    if fix is None:
        return finding
    related = (Related("it is read here", finding.origin), *finding.related)
    hint = f"write {right}, or compute it from the properties that place the joints"
    return replace(finding, origin=binding.node.origin, hint=hint, related=related, fix=fix)


def _read_as(context: Context, origin: Origin) -> Binding | None:
    """The property whose value is the whole text of a tag. None if the text was computed otherwise."""
    for element in context.elements:
        if element.text_origin == origin:
            inputs = [child.inputs or () for child in element.children if isinstance(child, Text)]
            return _source(inputs[0]) if len(inputs) == 1 else None
    return None


def _source(inputs: Sequence[Binding]) -> Binding | None:
    """The property that gives a value which was computed from these alone, through properties that pass it
    on."""
    while len(inputs) == 1 and inputs[0].inputs and inputs[0].value == inputs[0].inputs[0].value:
        inputs = inputs[0].inputs
    is_property = len(inputs) == 1 and inputs[0].node is not None and inputs[0].node.tag == "xacro:property"
    return inputs[0] if is_property else None


def _placing(context: Context, pairs: Sequence[Pair]) -> Iterator[Binding]:
    """Every property and parameter from which the positions of the wheels' joints are computed."""
    names = {wheel.joint.name for pair in pairs for wheel in pair.wheels}
    waiting = [
        binding
        for joint in context.tagged("joint")
        if joint.attributes.get("name") in names
        for origin in joint.elements("origin")
        for binding in (origin.inputs or {}).get("xyz", ())
    ]
    known = set[int]()
    while waiting:
        binding = waiting.pop()
        if id(binding) not in known:
            known.add(id(binding))
            waiting += binding.inputs
            yield binding


def _unused(context: Context, names: Sequence[str]) -> Iterator[tuple[str, float, Element]]:
    """Top-level properties of these names that nothing reads and that are plain positive numbers: name, value
    and element. What other properties mean follows from what reads them, which other findings compare."""
    for file in context.sources:
        for element in file.root.elements("xacro:property"):
            name, value = element.attributes.get("name", ""), context.value_in_use(element) or ""
            if name not in names or name in context.words:
                continue
            if NUMBER.fullmatch(value.strip()) and float(value) > 0.0:
                yield name, float(value), element


@rule("D106", "radius-differs", Severity.WARNING, "robot")
def radius_differs(context: Context) -> Found:
    """The wheel radius or diameter in a plugin, controller or property differs from that of the wheels.

    Why: Every distance is wrong by the ratio of the two. With 0.04 m for wheels of 0.035 m, odometry reports
    1.14 m after 1 m. A property counts if nothing reads it and it has the name and nearly the value of the
    radius or diameter.

    Example: `<wheelDiameter>0.08</wheelDiameter>` on wheels of radius 0.035 m.

    Fix: Use the property from which the wheels are made: `${wheel_radius}` as a radius, `${2*wheel_radius}`
    as a diameter. If the size is right and its multiplier makes it wrong, write 1 for the multiplier, unless
    it was measured on the real robot.

    Autofix: none.
    """
    yield from reported(context.drive_findings, "D106")
    wheels = [w for w in context.mobile_base.wheels if w.radius] if context.mobile_base is not None else []
    if not wheels or context.unsure & {w.link for w in wheels}:
        return
    radii = [w.radius for w in wheels]
    related = tuple(Related(f"the shape of '{w.link}'", w.shape.origin) for w in wheels[:1] if w.shape)
    for name, value, element in _unused(context, _RADIUS):
        given = value / 2.0 if name in DIAMETER else value
        if all(0.01 * r < abs(given - r) and r / _NEAR <= given <= r * _NEAR for r in radii):
            yield Finding(
                element.origin,
                f"unused property '{name}': the wheels have a radius of {radii[0]:.4g} m, not {given:.4g}",
                "make the wheels with this property",
                related,
            )
