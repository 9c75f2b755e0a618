"""Rules that compare a mass and a tensor with the size of the link."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.facts.bodies import Solid
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.inertia import breaks_triangle, is_frame, is_valid, links_with_inertial
from kbot.checks.rules.inertia_fixes import remove_inertial, solid_fix, solid_hint
from kbot.checks.rules.tensors import about_axle, geometry_of
from kbot.kinematics.spatial import eigenvalues
from kbot.model import Inertial, Link
from kbot.text import Severity

_SMALL = 1e-3  # m: smaller bodies are markers and not parts
_FOAM, _HEAVIEST = 50.0, 20_000.0
"""kg/m^3: foam, and a little more than gold (19,300)."""
_MATERIALS = {"plastic": 1200.0, "aluminium": 2700.0, "steel": 7850.0}  # kg/m^3
_ROUNDED = 1.05
"""A thin ring's radius of gyration is as large as its shape; 5 % more is allowed for rounded numbers."""
_OTHER_UNITS = 3.0
"""I108: with a radius of gyration this many times as large as the shape, the tensor is 9 times too large."""
_TOO_SMALL = 100.0
"""A tensor this many times too small has a tenth of the solid's radius of gyration."""


def _reach(context: Context, link: Link, inertial: Inertial) -> float:
    """Distance in m of the shapes' farthest point from the centre of mass; 0 if a shape is not known."""
    body = context.bodies[link.name]
    return body.reach(inertial.pose.xyz) if body.parts and body.complete else 0.0


def _gyration(context: Context, link: Link, inertial: Inertial, reach: float) -> float:
    """Radius of gyration in m about the axis of the largest moment.

    If I105 or I111 reports that only this moment is wrong, the second largest moment is used. A finding then
    means that the whole tensor is wrong.
    """
    moments = eigenvalues(inertial.tensor)
    gyration = math.sqrt(moments[2] / inertial.mass)
    if gyration <= reach:
        return gyration
    place = inertial.inertia_origin
    is_reported = (context.reports("I105", place) and breaks_triangle(moments)) or (
        context.reports("I111", place) and about_axle(context, link, inertial) is not None
    )
    return math.sqrt(moments[1] / inertial.mass) if is_reported else gyration


def _times_too_small(solid: Solid, inertial: Inertial) -> float:
    """By what factor a tensor is smaller than that of a solid of the same mass."""
    own = sum(eigenvalues(inertial.tensor))
    return inertial.mass * _unit_trace(solid) / own


def _unit_trace(solid: Solid) -> float:
    return sum(solid.unit_tensor[i][i] for i in range(3))


def _is_solid(density: float) -> bool:
    return _FOAM * 0.99 <= density <= _HEAVIEST * 1.01


def _mass_of_tensor(context: Context, link: Link, inertial: Inertial) -> float:
    """The mass in kg that fits the link's tensor, if the mass and not the tensor is wrong (I117); else 0.

    The mass is wrong if no material has the link's density, but one has the density that fits the tensor.
    """
    solid = context.bodies[link.name].solid
    if solid is None or not is_valid(inertial) or _is_solid(inertial.mass / solid.volume):
        return 0.0
    if not context.reports("I117", inertial.mass_origin):
        return 0.0
    reach = _reach(context, link, inertial)
    small = _times_too_small(solid, inertial)
    is_large = 0.0 < _ROUNDED * reach < _gyration(context, link, inertial, reach)
    if not is_large and small <= _TOO_SMALL:
        return 0.0
    mass = inertial.mass / small
    return mass if _is_solid(mass / solid.volume) else 0.0


def _tensor_finding(context: Context, link: Link, inertial: Inertial, message: str) -> Finding:
    return Finding(
        inertial.inertia_origin,
        message,
        solid_hint(context, link, inertial),
        geometry_of(context.bodies[link.name]),
        solid_fix(context, link, inertial),
    )


@rule("I107", "gyration-too-large", Severity.WARNING, "robot")
def gyration_too_large(context: Context) -> Found:
    """The radius of gyration reaches beyond the link's own shape.

    Why: The radius of gyration, the square root of moment over mass, is the root mean square distance of the
    mass from an axis. It cannot be larger than the distance of the shape's farthest point. The link resists
    turning more than the real part: a wheel spins up late, and an arm needs torques that its motor does not
    have.

    Example: 0.1 kg and `ixx="0.01"`, a radius of gyration of 316 mm, on a cube of 50 mm.

    Fix: Use the tensor of a solid of the link's shape and mass.

    Autofix: unsafe: KBot writes the tensor of a solid of the link's shape, as numbers or as a call of a macro
    that computes it.
    """
    for link, inertial in links_with_inertial(context):
        if not is_valid(inertial):
            continue
        reach = _reach(context, link, inertial)
        gyration = _gyration(context, link, inertial, reach)
        if _ROUNDED * reach < gyration <= _OTHER_UNITS * reach and gyration - reach > _SMALL:
            if _mass_of_tensor(context, link, inertial):
                continue
            yield _tensor_finding(
                context,
                link,
                inertial,
                f"{link.name}: the radius of gyration is {gyration * 1e3:.4g} mm, but its shape ends "
                f"{reach * 1e3:.4g} mm from the centre of mass: the tensor is at least "
                f"{(gyration / reach) ** 2:.2g} times too large",
            )


@rule("I108", "tensor-units", Severity.WARNING, "robot")
def tensor_units(context: Context) -> Found:
    """The radius of gyration is more than three times as large as the link's shape, probably because of wrong
    units or a placeholder.

    Why: The tensor is at least nine times too large. A tensor in g mm^2, or of a mesh in millimetres, is a
    million times too large or more, and the link does not turn.

    Example: `<mass value="0.1"/> <inertia ixx="1" iyy="1" izz="1" …/>`, a radius of gyration of 3.2 m, on a
    part of 5 cm.

    Fix: Write kg m^2: 1 g mm^2 is 1e-9 kg m^2, and 1 kg mm^2 is 1e-6 kg m^2.

    Autofix: unsafe: KBot writes the tensor of a solid of the link's shape, as numbers or as a call of a macro
    that computes it.
    """
    for link, inertial in links_with_inertial(context):
        if not is_valid(inertial):
            continue
        reach = _reach(context, link, inertial)
        gyration = _gyration(context, link, inertial, reach)
        if 0.0 < _OTHER_UNITS * reach < gyration and gyration > 2.0 * _SMALL:
            if _mass_of_tensor(context, link, inertial):
                continue
            yield _tensor_finding(
                context,
                link,
                inertial,
                f"{link.name}: the radius of gyration is {gyration * 1e3:.4g} mm, {gyration / reach:.3g} "
                f"times as far as its shape reaches ({reach * 1e3:.4g} mm): is the tensor in kg m^2?",
            )


@rule("I109", "tensor-too-small", Severity.WARNING, "robot")
def tensor_too_small(context: Context) -> Found:
    """The inertia tensor is more than a hundred times smaller than that of a solid of the link's shape and
    mass.

    Why: The link turns a hundred times too easily. With the time steps of Gazebo and Bullet its contacts and
    motors then make it vibrate and become unstable.

    Example: 10 kg and `ixx="1e-6"` on a box of 30 cm. A solid box has 0.15 kg m^2.

    Fix: Use the tensor of a solid of the link's shape and mass.

    Autofix: unsafe: KBot writes the tensor of a solid of the link's shape, as numbers or as a call of a macro
    that computes it.
    """
    for link, inertial in links_with_inertial(context):
        solid = context.bodies[link.name].solid
        if solid is None or not is_valid(inertial):
            continue
        small = _times_too_small(solid, inertial)
        if small > _TOO_SMALL and not _mass_of_tensor(context, link, inertial):
            yield _tensor_finding(
                context,
                link,
                inertial,
                f"{link.name}: the tensor is {small:.3g} times smaller than that of a solid of its shape "
                f"and {inertial.mass:g} kg",
            )


@rule("I117", "density", Severity.WARNING, "robot")
def density(context: Context) -> Found:
    """The density of a link, its mass over the volume of its shape, is below 50 or above 20,000 kg/m^3.

    Why: Foam has 50, water 1000, steel 7850 and gold 19,300 kg/m^3. A wheel of 10 kg in 19 cm^3 makes the
    robot so heavy that its motors and casters do not behave as on a real robot. If the tensor fits a mass
    that is plausible for the shape, the mass is at fault, and KBot does not report I107, I108 and I109 for
    the tensor.

    Example: `<mass value="20"/>` on a cube of 1 mm: 2e10 kg/m^3.

    Fix: Weigh the real part, or compute its mass from volume and material.

    Autofix: unsafe: KBot writes the mass that fits the tensor. It removes the inertial of a frame on a
    fixed joint: a link with at most a visual that is smaller than a cube of 5 mm.
    """
    for link, inertial in links_with_inertial(context):
        solid = context.bodies[link.name].solid
        if solid is None or not math.isfinite(inertial.mass) or not inertial.mass > 0.0:
            continue
        found = inertial.mass / solid.volume
        if not 0.0 < found < math.inf:
            continue
        if _is_solid(found):
            continue
        if found < _FOAM:
            like = f"{_FOAM / found:.3g} times lighter than foam"
        else:
            like = f"{found / 7850.0:.3g} times steel"
        is_marker = is_frame(context, link)
        fitting = _mass_of_tensor(context, link, inertial)
        fix = remove_inertial(context, inertial) if is_marker else None
        if fitting:
            like += f"; its tensor is that of {fitting:.3g} kg"
            mass = f"{fitting:.6g}"
            fix = fix or context.replace_plain(inertial.mass_origin, mass, f"write {mass} kg", safe=False)
        yield Finding(
            inertial.mass_origin,
            f"{link.name}: {inertial.mass:g} kg in {_volume(solid.volume)} is {found:.3g} kg/m^3, {like}",
            _mass_hint(solid.volume, is_marker),
            geometry_of(context.bodies[link.name]),
            fix,
            # a collision shape is often larger than its part, and makes a light part seem lighter
            severity=Severity.INFO if 5.0 <= found < _FOAM and not fitting else None,
        )


def _mass_hint(volume: float, is_marker: bool) -> str:
    if is_marker:
        return (
            "a frame needs no mass: remove its <inertial>, because a fixed joint connects it to another link"
        )
    by_material = (f"{volume * density:.2g} kg of {name}" for name, density in _MATERIALS.items())
    return f"compute the mass from volume and material: {', '.join(by_material)}"


def _volume(cubic_metres: float) -> str:
    if cubic_metres < 1e-7:
        return f"{cubic_metres * 1e9:.3g} mm^3"
    return f"{cubic_metres * 1e6:.3g} cm^3" if cubic_metres < 1e-2 else f"{cubic_metres:.3g} m^3"
