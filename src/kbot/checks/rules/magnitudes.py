"""Rules that hold the size of a mass and a tensor against the link's own shape."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.facts.bodies import tensor_of
from kbot.checks.facts.spatial import eigenvalues
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.inertia import sound, weighed
from kbot.checks.rules.inertia_fixes import solid_fix, solid_hint
from kbot.checks.rules.tensors import geometry_of
from kbot.model import Inertial, Link
from kbot.text import Severity

_SMALL = 1e-3  # m: bodies smaller than this are markers, not parts
_AXES = "xyz"


def _reach(context: Context, link: Link, inertial: Inertial) -> float:
    """How far the link's shapes reach from its centre of mass, m; 0 when a shape is not known."""
    body = context.bodies[link.name]
    return body.reach(inertial.pose.xyz) if body.parts and body.complete else 0.0


@rule("I107", "gyration-too-large", Severity.WARNING, "robot")
def gyration_too_large(context: Context) -> Found:
    """A radius of gyration that reaches beyond the link's own shape.

    Why: the root of moment over mass is how far out the mass sits on average; it cannot be farther out than
    the shape's farthest point. The link turns more sluggishly than the part would: a wheel
    spins up late, an arm needs torques that its motor lacks.

    Example: 0.1 kg, `ixx="0.01"` (316 mm) on a cube of 50 mm.

    Mend: use the tensor of a solid of the link's shape and mass.

    Fix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        if not sound(inertial):
            continue
        reach = _reach(context, link, inertial)
        gyration = math.sqrt(eigenvalues(tensor_of(inertial))[2] / inertial.mass)
        if 1.05 * reach < gyration <= 3.0 * reach and gyration - reach > _SMALL:
            yield Finding(
                inertial.inertia_origin,
                f"{link.name}: radius of gyration {gyration * 1e3:.4g} mm, yet its shape ends "
                f"{reach * 1e3:.4g} mm "
                f"from the centre of mass: the tensor is at least {(gyration / reach) ** 2:.2g} times "
                "too large",
                solid_hint(context, link, inertial),
                geometry_of(context.bodies[link.name]),
                solid_fix(context, link, inertial),
            )


@rule("I108", "tensor-units", Severity.WARNING, "robot")
def tensor_units(context: Context) -> Found:
    """A radius of gyration more than three times as far out as the link's shape: other units, or a
    placeholder.

    Why: the tensor is at least nine times too large. In g mm^2 or with a mesh in millimetres it is a million
    times: the link does not turn at all.

    Example: `<mass value="0.1"/> <inertia ixx="1" iyy="1" izz="1" …/>` on a part of 5 cm: 3.2 m.

    Mend: write kg m^2: 1 g mm^2 is 1e-9 kg m^2, 1 kg mm^2 is 1e-6 kg m^2.

    Fix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        if not sound(inertial):
            continue
        reach = _reach(context, link, inertial)
        gyration = math.sqrt(eigenvalues(tensor_of(inertial))[2] / inertial.mass)
        if 0.0 < 3.0 * reach < gyration and gyration > 2.0 * _SMALL:
            yield Finding(
                inertial.inertia_origin,
                f"{link.name}: radius of gyration {gyration * 1e3:.4g} mm, {gyration / reach:.3g} "
                "times as far as "
                f"its shape reaches ({reach * 1e3:.4g} mm): is the tensor in kg m^2?",
                solid_hint(context, link, inertial),
                geometry_of(context.bodies[link.name]),
                solid_fix(context, link, inertial),
            )


@rule("I109", "tensor-too-small", Severity.WARNING, "robot")
def tensor_too_small(context: Context) -> Found:
    """A tensor more than a hundred times smaller than that of a solid of the link's shape and mass.

    Why: the link turns a hundred times too easily; at the time steps of Gazebo and Bullet its contacts and
    motors then shake it to pieces.

    Example: 10 kg, `ixx="1e-6"` on a box of 30 cm, which has 0.15 kg m^2.

    Mend: use the tensor of a solid of the link's shape and mass.

    Fix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        solid = context.bodies[link.name].solid
        if solid is None or not sound(inertial):
            continue
        own = sum(eigenvalues(tensor_of(inertial)))
        due = inertial.mass * sum(solid.unit_tensor[i][i] for i in range(3))
        if own < due / 100.0:
            yield Finding(
                inertial.inertia_origin,
                f"{link.name}: the tensor is {due / own:.3g} times smaller than that of a solid of its "
                "shape and "
                f"{inertial.mass:g} kg",
                solid_hint(context, link, inertial),
                geometry_of(context.bodies[link.name]),
                solid_fix(context, link, inertial),
            )


@rule("I117", "density", Severity.WARNING, "robot")
def density(context: Context) -> Found:
    """A mass that no material gives the link's shape: less than 50 or more than 20,000 kg/m^3.

    Why: foam has 50, water 1000, steel 7850, gold 19,300 kg/m^3. A wheel of 10 kg in 19 cm^3 makes the robot
    so heavy that its motors, its caster and its slopes behave as no real one.

    Example: `<mass value="20"/>` on a cube of 1 mm: 2e10 kg/m^3.

    Mend: weigh the part, or compute its mass from volume and material.

    Fix: none.
    """
    for link, inertial in weighed(context):
        solid = context.bodies[link.name].solid
        if solid is None or not math.isfinite(inertial.mass) or not inertial.mass > 0.0:
            continue
        found = inertial.mass / solid.volume
        if not 0.0 < found < math.inf:
            continue
        if 49.5 <= found <= 20_200.0:
            continue
        if found < 50.0:
            like = f"{50.0 / found:.3g} times lighter than foam"
        else:
            like = f"{found / 7850.0:.3g} times steel"
        yield Finding(
            inertial.mass_origin,
            f"{link.name}: {inertial.mass:g} kg in {_volume(solid.volume)} is {found:.3g} kg/m^3, {like}",
            "compute the mass from volume and material",
            geometry_of(context.bodies[link.name]),
            # a collision that is a little roomy makes a light part lighter still
            severity=Severity.INFO if 5.0 <= found < 50.0 else None,
        )


def _volume(cubic_metres: float) -> str:
    if cubic_metres < 1e-7:
        return f"{cubic_metres * 1e9:.3g} mm^3"
    return f"{cubic_metres * 1e6:.3g} cm^3" if cubic_metres < 1e-2 else f"{cubic_metres:.3g} m^3"
