"""Rules that compare a mass and a tensor with the size of the link."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.facts.bodies import Solid
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.inertia import breaks_triangle, sound, weighed
from kbot.checks.rules.inertia_fixes import solid_fix, solid_hint
from kbot.checks.rules.tensors import about_axle, geometry_of
from kbot.kinematics.spatial import eigenvalues
from kbot.model import Inertial, Link
from kbot.text import Severity

_SMALL = 1e-3  # m: bodies smaller than this are markers, not parts
_FOAM, _HEAVIEST = 50.0, 20_000.0  # kg/m^3: of the lightest and the heaviest that robots are made of
_TOO_SMALL = 100.0


def _reach(context: Context, link: Link, inertial: Inertial) -> float:
    """How far the link's shapes reach from its centre of mass, m; 0 when a shape is not known."""
    body = context.bodies[link.name]
    return body.reach(inertial.pose.xyz) if body.parts and body.complete else 0.0


def _gyration(context: Context, link: Link, inertial: Inertial, reach: float) -> float:
    """Radius of gyration about the axis of the largest moment, m.

    Where that one moment alone is at odds with the others and with the shape, which I105 and I111 say, it
    is that of the second: what is found of it then is a fault of the whole tensor.
    """
    moments = eigenvalues(inertial.tensor)
    gyration = math.sqrt(moments[2] / inertial.mass)
    if gyration <= reach:
        return gyration
    place = inertial.inertia_origin
    is_said = (context.says("I105", place) and breaks_triangle(moments)) or (
        context.says("I111", place) and about_axle(context, link, inertial) is not None
    )
    return math.sqrt(moments[1] / inertial.mass) if is_said else gyration


def _times_too_small(solid: Solid, inertial: Inertial) -> float:
    """How many times smaller a tensor is than that of a solid of its mass."""
    own = sum(eigenvalues(inertial.tensor))
    return inertial.mass * _unit_trace(solid) / own


def _unit_trace(solid: Solid) -> float:
    return sum(solid.unit_tensor[i][i] for i in range(3))


def _is_solid(density: float) -> bool:
    return _FOAM * 0.99 <= density <= _HEAVIEST * 1.01


def _meant_mass(context: Context, link: Link, inertial: Inertial) -> float:
    """The mass in kg that a link's tensor belongs to, where it is the mass that is wrong (I117), and else 0:
    no material has its density, one has that of the tensor, and neither the one nor the other is near."""
    solid = context.bodies[link.name].solid
    if solid is None or not sound(inertial) or _is_solid(inertial.mass / solid.volume):
        return 0.0
    if not context.says("I117", inertial.mass_origin):
        return 0.0
    reach = _reach(context, link, inertial)
    small = _times_too_small(solid, inertial)
    is_large = 0.0 < 1.05 * reach < _gyration(context, link, inertial, reach)
    if not is_large and small <= _TOO_SMALL:
        return 0.0
    meant = inertial.mass / small
    return meant if _is_solid(meant / solid.volume) else 0.0


def _of_tensor(context: Context, link: Link, inertial: Inertial, message: str) -> Finding:
    return Finding(
        inertial.inertia_origin,
        message,
        solid_hint(context, link, inertial),
        geometry_of(context.bodies[link.name]),
        solid_fix(context, link, inertial),
    )


@rule("I107", "gyration-too-large", Severity.WARNING, "robot")
def gyration_too_large(context: Context) -> Found:
    """A radius of gyration that reaches beyond the link's own shape.

    Why: the root of moment over mass is how far out the mass sits on average; it cannot be farther out than
    the shape's farthest point. The link turns more sluggishly than the part would: a wheel
    spins up late, an arm needs torques that its motor lacks.

    Example: 0.1 kg, `ixx="0.01"` (316 mm) on a cube of 50 mm.

    Fix: use the tensor of a solid of the link's shape and mass.

    Autofix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        if not sound(inertial):
            continue
        reach = _reach(context, link, inertial)
        gyration = _gyration(context, link, inertial, reach)
        if 1.05 * reach < gyration <= 3.0 * reach and gyration - reach > _SMALL:
            if _meant_mass(context, link, inertial):
                continue
            yield _of_tensor(
                context,
                link,
                inertial,
                f"{link.name}: radius of gyration {gyration * 1e3:.4g} mm, yet its shape ends "
                f"{reach * 1e3:.4g} mm from the centre of mass: the tensor is at least "
                f"{(gyration / reach) ** 2:.2g} times too large",
            )


@rule("I108", "tensor-units", Severity.WARNING, "robot")
def tensor_units(context: Context) -> Found:
    """A radius of gyration more than three times as far out as the link's shape: other units, or a
    placeholder.

    Why: the tensor is at least nine times too large. In g mm^2 or with a mesh in millimetres it is a million
    times: the link does not turn at all.

    Example: `<mass value="0.1"/> <inertia ixx="1" iyy="1" izz="1" …/>` on a part of 5 cm: 3.2 m.

    Fix: write kg m^2: 1 g mm^2 is 1e-9 kg m^2, 1 kg mm^2 is 1e-6 kg m^2.

    Autofix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        if not sound(inertial):
            continue
        reach = _reach(context, link, inertial)
        gyration = _gyration(context, link, inertial, reach)
        if 0.0 < 3.0 * reach < gyration and gyration > 2.0 * _SMALL:
            if _meant_mass(context, link, inertial):
                continue
            yield _of_tensor(
                context,
                link,
                inertial,
                f"{link.name}: radius of gyration {gyration * 1e3:.4g} mm, {gyration / reach:.3g} times as "
                f"far as its shape reaches ({reach * 1e3:.4g} mm): is the tensor in kg m^2?",
            )


@rule("I109", "tensor-too-small", Severity.WARNING, "robot")
def tensor_too_small(context: Context) -> Found:
    """A tensor more than a hundred times smaller than that of a solid of the link's shape and mass.

    Why: the link turns a hundred times too easily; at the time steps of Gazebo and Bullet its contacts and
    motors then shake it to pieces.

    Example: 10 kg, `ixx="1e-6"` on a box of 30 cm, which has 0.15 kg m^2.

    Fix: use the tensor of a solid of the link's shape and mass.

    Autofix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        solid = context.bodies[link.name].solid
        if solid is None or not sound(inertial):
            continue
        small = _times_too_small(solid, inertial)
        if small > _TOO_SMALL and not _meant_mass(context, link, inertial):
            yield _of_tensor(
                context,
                link,
                inertial,
                f"{link.name}: the tensor is {small:.3g} times smaller than that of a solid of its shape "
                f"and {inertial.mass:g} kg",
            )


@rule("I117", "density", Severity.WARNING, "robot")
def density(context: Context) -> Found:
    """A mass that no material gives the link's shape: less than 50 or more than 20,000 kg/m^3.

    Why: foam has 50, water 1000, steel 7850, gold 19,300 kg/m^3. A wheel of 10 kg in 19 cm^3 makes the robot
    so heavy that its motors, its caster and its slopes behave as no real one. A tensor that is right for
    a mass that some material gives the shape is not found fault with beside it (I107 to I109).

    Example: `<mass value="20"/>` on a cube of 1 mm: 2e10 kg/m^3.

    Fix: weigh the real part, or compute its mass from volume and material.

    Autofix: none.
    """
    for link, inertial in weighed(context):
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
        meant = _meant_mass(context, link, inertial)
        if meant:
            like += f"; its tensor is that of {meant:.3g} kg"
        yield Finding(
            inertial.mass_origin,
            f"{link.name}: {inertial.mass:g} kg in {_volume(solid.volume)} is {found:.3g} kg/m^3, {like}",
            "compute the mass from volume and material",
            geometry_of(context.bodies[link.name]),
            # a collision that is a little roomy makes a light part lighter still
            severity=Severity.INFO if 5.0 <= found < _FOAM and not meant else None,
        )


def _volume(cubic_metres: float) -> str:
    if cubic_metres < 1e-7:
        return f"{cubic_metres * 1e9:.3g} mm^3"
    return f"{cubic_metres * 1e6:.3g} cm^3" if cubic_metres < 1e-2 else f"{cubic_metres:.3g} m^3"
