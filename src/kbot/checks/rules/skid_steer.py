"""The rule about robots that turn by skidding: skid steers with two or more axles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.bodies import center_of_mass
from kbot.kinematics.drive.wheels import Pair, movable_above
from kbot.model import RobotModel
from kbot.model.extensions import extensions
from kbot.text import Severity

_LEAST_SHORTFALL = 0.1
"""The share by which a turn falls short before it is reported. Of 28 public robots, 26 turn within 10 % of
Coulomb's law in simulation (benchmarks/README.md, section "skid")."""
_MOST = 5.0
"""Multiple of the distance between the wheels above which another wheel separation does not help: the wheels
of the heavier side then hold the robot."""
_LEVEL = 1e-4
"""m. Wheels whose lowest points differ by more do not bear loads that statics gives: one may hang."""
_SMOOTH = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
"""Slips in m/s, for a turn at 1 rad/s, below which friction is taken as proportional to the slip, one after
the other."""
_STEPS = 60
"""Steps for each of them. Closed forms and simulations then agree within 0.1 %
(tests/checks/test_skid_steer.py)."""


class WheelLoad(NamedTuple):
    """Where a wheel touches the ground, in m, x forwards and y to the left, its side (1 left, -1 right), and
    its load, in any unit."""

    x: float
    y: float
    side: int
    load: float


@rule("D126", "turns-short", Severity.INFO, "drive")
def turns_short(context: Context) -> Found:
    """The configured wheel separation of a skid-steer drive is less than its effective wheel separation.

    Why: Wheels in front of and behind the centre of the turn are dragged sideways, and their friction reduces
    the turn, while odometry reports the whole turn. With four equally loaded wheels, axles 2a apart and
    wheels 2b apart, the robot makes b^2 / (a^2 + b^2) of a turn. If one axle bears most of the weight, it
    holds, the other one slides, and the robot makes the whole turn. KBot computes the loads of the wheels
    from the masses, and the turn from Coulomb's law of friction. It reports nothing if the loads or frictions
    are not known: with casters, springs, wheels that are not driven or not in one plane, or unequal friction.
    Mecanum wheels that are simulated as ordinary wheels have the same drag.

    Example: `wheel_separation: 0.3756` for a robot with four wheels whose axles are 0.262 m apart.

    Fix: Set `wheel_separation_multiplier` (ros2_control) to the factor in the message, or a plugin's wheel
    separation to the value in the message. Then measure a turn and correct the value.

    Autofix: none.
    """
    for controller in context.declared_drives:
        named = {joint.text for joint in (*controller.left, *controller.right)}
        pairs = [p for p in context.base.pairs if {p.left.joint.name, p.right.joint.name} <= named]
        size = controller.separation
        if len(pairs) < 2 or size is None or size.value <= 0.0 or not size.given.number:
            continue
        contacts = _loads(context, pairs)
        if contacts is None:
            continue
        needed = turning_separation(contacts)
        made = size.value / needed
        if made < 1.0 - _LEAST_SHORTFALL:
            factor = f"wheel_separation_multiplier to {needed / size.given.number:.2f} or "
            hint = f"set {factor if controller.plugin is None else ''}the separation to {needed:.3g} m"
            if needed > _MOST * pairs[0].separation:
                hint = "load the wheels of both sides equally, or put the axles closer together"
            yield Finding(
                size.given.origin,
                f"{controller.name}: a turn drags the wheels of {len(pairs)} axles across the ground: the "
                f"robot turns about {(1.0 - made) * 100.0:.0f} % less than commanded",
                f"{hint}; then measure a turn",
            )


def _loads(context: Context, pairs: Sequence[Pair]) -> list[WheelLoad] | None:
    """The wheels with the loads that the robot's masses give. None if statics alone does not give them, or if
    the wheels' frictions differ."""
    base = context.base
    wheels = [wheel for pair in pairs for wheel in pair.wheels]
    if len(wheels) < len(base.wheels) or context.unsure or any(c.touches for c in base.casters):
        return None
    heights = [wheel.bottom for wheel in wheels]
    center = center_of_mass(context.tree)
    if center is None or max(heights) - min(heights) > _LEVEL:
        return None
    if any(movable_above(context.robot, wheel.joint.parent) is not None for wheel in wheels):
        return None  # a spring or a rocker distributes the load
    frictions = {_frictions(context.robot, wheel.link) for wheel in wheels}
    if len(frictions) > 1 or any(tag == "fdir1" for tags in frictions for tag, _ in tags):
        return None
    loads = wheel_loads([(float(w.center[0]), float(w.center[1])) for w in wheels], center[:2].tolist())
    if loads is None:
        return None
    sides = [side for _ in pairs for side in (1, -1)]
    return [
        WheelLoad(float(w.center[0]), float(w.center[1]), side, load)
        for w, side, load in zip(wheels, sides, loads, strict=True)
    ]


def _frictions(robot: RobotModel, link: str) -> frozenset[tuple[str, str]]:
    """The tags of a link's friction, with their values."""
    return frozenset(
        (tag.tag, tag.attributes.get("value", tag.text).strip())
        for extension in extensions(robot, "gazebo")
        if extension.attributes.get("reference") == link
        for tag in extension.descendants()
        if tag.tag in ("mu1", "mu2", "mu", "fdir1")
    )


def wheel_loads(places: Sequence[tuple[float, float]], center: Sequence[float]) -> list[float] | None:
    """The shares of a robot's weight that its wheels bear, if all are equally soft.

    `places` are the contact points and `center` is the centre of mass, x and y in m. Equally soft wheels
    yield in proportion to their loads, and a rigid robot stays plane, so the load is a linear function of the
    place. None if the robot would tip, or its wheels are on one line.
    """
    rows = np.array([(1.0, x, y) for x, y in places])
    if np.linalg.matrix_rank(rows) < 3:
        return None
    weights = np.linalg.solve(rows.T @ rows, np.array([1.0, center[0], center[1]]))
    loads: list[float] = (rows @ weights).tolist()
    return loads if min(loads) > 0.0 else None


def turning_separation(wheels: Sequence[WheelLoad]) -> float:
    """The wheel separation in m with which a skid steer must compute to turn on the spot as commanded.

    The wheels roll at y = 0.5 of the separation times the commanded rate, forwards on the right and backwards
    on the left. Each is braked against its slip with a friction proportional to its load, whatever the slip
    (Coulomb), and in a steady turn these frictions are in balance. There the sum of the loads times the slips
    is least over all motions of the robot in the plane, and it is convex, so reweighted least squares find it
    (Weiszfeld's method), with slips that are smoothed less and less. All motions are proportional to the
    wheels' speeds, so one motion gives the separation.
    """
    jacobian = np.array([[(1.0, 0.0, -w.y), (0.0, 1.0, w.x)] for w in wheels])
    rims = np.array([(-0.5 * w.side, 0.0) for w in wheels])
    loads = np.array([w.load for w in wheels])
    motion = np.zeros(3)
    for smooth in np.repeat(_SMOOTH, _STEPS):
        slip = jacobian @ motion - rims
        weights = loads / np.sqrt((slip**2).sum(axis=1) + smooth**2)
        normal = np.einsum("i,ijk,ijl->kl", weights, jacobian, jacobian)
        motion = np.linalg.solve(normal, np.einsum("i,ijk,ij->k", weights, jacobian, rims))
    return float(1.0 / max(motion[2], 1e-9))
