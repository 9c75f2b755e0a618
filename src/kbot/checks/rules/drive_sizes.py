"""Rules that compare the wheel sizes of plugins, controllers and properties with the robot's wheels."""

from __future__ import annotations

import re
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.edits import replace_value
from kbot.checks.registry import Finding, Found, reported, rule
from kbot.kinematics.drive.findings import joint_places, separation_is_off
from kbot.kinematics.drive.wheels import Pair
from kbot.text import Element, Related, Severity
from kbot.text.numbers import NUMBER

_SEPARATION = re.compile(r"(wheels?_?(separation|track|distance|spacing)|track_?width)", re.IGNORECASE)
_RADIUS = re.compile(r"(drive_?)?wheel_?(radius|diameter)", re.IGNORECASE)


def _conventions(pair: Pair) -> list[float]:
    """The distances that authors call wheel separation: between middles, inner faces and outer faces."""
    width = max(pair.left.width, pair.right.width)
    return [pair.separation, pair.separation - width, pair.separation + width]


@rule("D105", "separation-differs", Severity.WARNING, "robot")
def separation_differs(context: Context) -> Found:
    """The wheel separation in a plugin, controller or property differs from the distance between the wheels.

    Why: Odometry computes yaw as (right - left) / separation. With 0.15 m for wheels that are 0.174 m apart,
    it reports every turn 16 % too large. After one turn it is 58 degrees off.

    Example: `<wheelSeparation>0.15</wheelSeparation>` on wheels 0.174 m apart.

    Fix: Compute the separation once, and use it for the joints and for the plugin:
    `${base_width + 2*base_wheel_gap}`. If the size is right and its multiplier makes it wrong, write 1 for
    the multiplier, unless it was measured on the real robot.

    Autofix: unsafe: KBot writes the distance between the wheels, or 1 for a multiplier, in place of a number,
    not of an expression.
    """
    yield from reported(context.drive_findings, "D105")
    pairs = context.level_pairs
    if not pairs or context.unsure & {w.link for w in context.base.wheels}:
        return
    true, related = context.wheel_pairs[0].separation, joint_places(context.wheel_pairs[0])
    for name, value, element in _properties(context, _SEPARATION):
        if (
            all(abs(value - d) > 0.01 * true for d in _conventions(pairs[0]))
            and abs(value - true / 2) > 0.01 * true  # half the separation places one wheel
        ):
            if any(_conventions(p)[0] and abs(value - p.separation) < 0.01 * value for p in pairs):
                continue
            yield Finding(
                element.origin,
                f"property '{name}': " + separation_is_off(value, true),
                f"write {true:.4g}, or compute it from the properties that place the joints",
                related,
                replace_value(element, "value", f"{true:.6g}", f"write {true:.6g}", safe=False),
            )


def _properties(context: Context, name: re.Pattern[str]) -> Iterator[tuple[str, float, Element]]:
    """Top-level properties of this name whose value is a plain positive number: name, value and element."""
    for file in context.sources:
        for element in file.root.elements():
            if element.tag != "xacro:property":
                continue
            own, value = element.attributes.get("name", ""), context.value_in_use(element) or ""
            if name.fullmatch(own) and NUMBER.fullmatch(value.strip()) and float(value) > 0.0:
                yield own, float(value), element


@rule("D106", "radius-differs", Severity.WARNING, "robot")
def radius_differs(context: Context) -> Found:
    """The wheel radius or diameter in a plugin, controller or property differs from that of the wheels.

    Why: Every distance is wrong by the ratio of the two. With 0.04 m for wheels of 0.035 m, odometry reports
    1.14 m after 1 m.

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
    for name, value, element in _properties(context, _RADIUS):
        given = value / 2.0 if "diameter" in name.lower() else value
        if all(abs(given - r) > 0.01 * r for r in radii):
            yield Finding(
                element.origin,
                f"property '{name}': the wheels have a radius of {radii[0]:.4g} m, not {given:.4g}",
                "make the wheels with this property",
                related,
            )
