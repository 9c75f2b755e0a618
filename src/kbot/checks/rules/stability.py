"""Rules about the support of a wheeled robot and about tipping over."""

from __future__ import annotations

import math
from collections.abc import Sequence

from kbot.checks.context import Context
from kbot.checks.facts.bodies import lowest
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.contact import caster_place
from kbot.kinematics.bodies import center_of_mass, total_mass
from kbot.kinematics.planar import Point, convex_hull, twice_area
from kbot.kinematics.spatial import GRAVITY
from kbot.model import Mesh
from kbot.text import Origin, Related, Severity

_LEAST_ACCELERATION = 0.5
"""m/s^2. A robot that tips at less is reported; it is half of a controller's usual limit of 1 m/s^2."""

_NEAR = 0.01
"""Metres above or below the ground at which a part carries a robot that leans a little."""


@rule("D115", "tips-over", Severity.WARNING, "drive")
def tips_over(context: Context) -> Found:
    """The centre of mass is outside the polygon of the contact points, or so near its edge that driving tips
    the robot.

    Why: A robot whose centre of mass is outside falls over at rest. If it is inside, the robot tips when it
    accelerates or brakes by more than g x (distance to the edge) / (height). A controller's default of 1
    m/s^2 is enough to tip a tall robot.

    Example: Two wheels, a caster behind them, and a battery in front of the axle.

    Fix: Move the mass over the wheels and casters, or add a caster on that side.

    Autofix: none.
    """
    ground = context.base.ground
    if ground is None or context.unsure:
        return
    points: list[Point] = [(w.center[0], w.center[1]) for w in context.base.wheels]
    points += [
        (c.center[0], c.center[1])
        for c in context.base.casters
        if c.touches and abs(c.bottom - ground) < _NEAR
    ]
    points += _feet(context, ground)
    hull = convex_hull([(round(x, 9), round(y, 9)) for x, y in points], tolerance=1e-12)
    if len(hull) < 3:
        return
    center = center_of_mass(context.tree)
    if center is None:
        return
    x, y, z = center.tolist()
    margin, (nx, ny) = _margin(hull, (x, y))
    height = z - ground
    if height <= 0.0:
        return
    direction = _direction(nx, ny)
    heavy = _heaviest(context)
    if margin < -1e-3:
        yield Finding(
            heavy or context.robot.origin,
            f"the centre of mass ({total_mass(context.robot):.3g} kg) is {-margin * 1e3:.3g} mm outside "
            f"the support polygon ({direction}): the robot falls over at rest",
            "move the mass over the wheels and casters",
            tuple(
                Related(f"'{c.link}' carries the robot", caster_place(context, c))
                for c in context.base.casters[:2]
            ),
        )
    elif GRAVITY * margin / height < _LEAST_ACCELERATION:
        yield Finding(
            heavy or context.robot.origin,
            f"the centre of mass is only {max(margin, 0.0) * 1e3:.3g} mm inside the support polygon "
            f"({direction}) and {height * 1e3:.3g} mm above the ground: the robot tips over at an "
            f"acceleration of {GRAVITY * max(margin, 0.0) / height:.2g} m/s^2",
            "move the mass, or add a caster on that side",
        )


def _feet(context: Context, ground: float) -> list[Point]:
    """The middles of the shapes near the ground. One link may have several casters."""
    driving, found = {wheel.link for wheel in context.base.wheels}, []
    for name, frame in context.frames.items():
        for part in context.bodies[name].collisions if name not in driving else ():
            if not isinstance(part.geometry, Mesh) and abs(lowest(part, frame) - ground) < _NEAR:
                x, y, _ = frame.point(part.frame.translation)
                found.append((x, y))
    return found


def _direction(nx: float, ny: float) -> str:
    if abs(nx) >= abs(ny):
        return "at the front" if nx > 0 else "at the back"
    return "on the left" if ny > 0 else "on the right"


def _heaviest(context: Context) -> Origin | None:
    inertials = [link.inertial for link in context.robot.links.values() if link.inertial]
    heaviest = max(inertials, key=lambda i: i.mass, default=None)
    return heaviest.origin if heaviest else None


def _margin(hull: Sequence[Point], p: Point) -> tuple[float, Point]:
    """Distance of a point from the nearest edge, positive within, and that edge's outward normal."""
    best, normal = math.inf, (1.0, 0.0)
    for a, b in zip(hull, [*hull[1:], hull[0]], strict=True):
        length = math.hypot(b[0] - a[0], b[1] - a[1])
        inside = twice_area(a, b, p) / length
        if inside < best:
            best, normal = inside, ((b[1] - a[1]) / length, -(b[0] - a[0]) / length)
    return best, normal


@rule("D116", "two-contacts", Severity.WARNING, "drive")
def two_contacts(context: Context) -> Found:
    """The robot stands on its two drive wheels only.

    Why: It falls forwards or backwards until its chassis touches the ground, and then drags it along. The
    drive wheels lose load, and the heading drifts. Ignore this finding for a robot that balances by control.

    Example: Two wheels on a plate, and a caster without `<collision>`.

    Fix: Add a caster that touches the ground, with a `<collision>`.

    Autofix: none.
    """
    base = context.base
    if len(base.pairs) != 1 or any(c.touches for c in base.casters) or base.ground is None or context.unsure:
        return
    if not any(link.collisions for link in context.robot.links.values()):
        return
    driving = {w.link for w in base.wheels}
    for name, link in context.robot.links.items():
        if name in driving or name not in context.frames:
            continue
        if any(isinstance(c.geometry, Mesh) for c in link.collisions):
            return  # the lowest point of a mesh is not computed here
        for part in context.bodies[name].collisions:
            if lowest(part, context.frames[name]) < base.ground + 0.25 * max(w.radius for w in base.wheels):
                return
    pair = base.pairs[0]
    yield Finding(
        pair.left.joint.origin,
        f"the robot stands on '{pair.left.link}' and '{pair.right.link}' alone: it falls over",
        "add a caster that touches the ground, with a <collision>",
    )
