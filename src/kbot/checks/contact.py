"""Rules about how a wheeled robot stands: contact plane, casters, support, footprint."""

from __future__ import annotations

import math
from collections.abc import Sequence

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rig import Caster, is_caster, lowest, movable_above
from kbot.checks.spatial import Vector
from kbot.checks.wheels import at_both, pose_origin
from kbot.model import Cylinder, JointType, Mesh, Sphere
from kbot.text import Element, Origin, Related, Severity

_GRAVITY = 9.81
_SLIDES = 0.2
Point = tuple[float, float]


def _ground(context: Context) -> float | None:
    return context.wheels.ground


def _caster_place(caster: Caster) -> Origin:
    return caster.joint.pose.origin or caster.joint.origin


@rule("D112", "not-on-ground", Severity.WARNING, "drive")
def not_on_ground(context: Context) -> Found:
    """A caster or wheel whose lowest point is not in the plane that the drive wheels stand on.

    Why: 5 mm too high, it hangs: the robot tips onto it when it brakes, and its laser sweeps the floor. 5
    mm too low, it lifts the drive wheels, which spin in the air.

    Example: a caster of radius 0.015 on a mount made for 0.0175.

    Mend: compute the mount's height from both radii: `z = wheel_z - wheel_radius + caster_radius`.

    Fix: none.
    """
    ground = _ground(context)
    if ground is None:
        return
    size = max(w.radius or 0.0 for w in context.wheels.wheels)
    axle = context.wheels.pairs[0]
    for wheel in context.wheels.wheels:
        if wheel.bottom is None or wheel.link in context.unsure:
            continue
        off = wheel.bottom - ground
        if len(context.wheels.pairs) > 1 and abs(off) > max(1e-3, 0.02 * size):
            yield Finding(
                wheel.joint.pose.origin or wheel.joint.origin,
                f"{wheel.link}: its lowest point is {abs(off) * 1e3:.3g} mm "
                f"{'above' if off > 0 else 'below'} that of "
                "the other wheels",
                related=(Related("the wheel it is compared with", axle.left.joint.origin),),
            )
    touching = [c for c in context.wheels.casters if abs(c.bottom - ground) <= max(1e-3, 0.03 * size)]
    for caster in context.wheels.casters:
        if {caster.link, caster.joint.name} & context.unsure:
            continue
        off = caster.bottom - ground
        arm = max(abs(caster.center[0] - axle.left.center[0]), 1e-3)
        tilt = math.degrees(math.atan2(abs(off), arm))
        if off > max(1e-3, 0.03 * size) and not (touching and not isinstance(caster.part.geometry, Sphere)):
            yield Finding(
                _caster_place(caster),
                f"{caster.link}: it hangs {off * 1e3:.3g} mm above the ground that the wheels stand "
                "on: the robot tips "
                f"by {tilt:.2g} degrees until it touches",
                "compute its height from the radii",
                (Related("its shape", caster.part.origin), Related("a drive wheel", axle.left.joint.origin)),
            )
        elif off < -1e-3:
            yield Finding(
                _caster_place(caster),
                f"{caster.link}: it reaches {-off * 1e3:.3g} mm below the ground that the wheels stand "
                "on: it lifts them "
                f"or tilts the robot by {tilt:.2g} degrees",
                "compute its height from the radii",
                (Related("its shape", caster.part.origin), Related("a drive wheel", axle.left.joint.origin)),
            )


@rule("D113", "footprint-off-ground", Severity.WARNING, "drive")
def footprint_off_ground(context: Context) -> Found:
    """`base_footprint` that does not lie in the plane that the wheels touch.

    Why: REP 120 puts it on the ground. Navigation projects obstacles and poses onto it: the robot is
    drawn sunk in or floating, a height filter lets the floor through as an obstacle, and spawned at z = 0
    it falls or jumps.

    Example: a joint from `base_footprint` to `base_link` at z = 0 where the axle is 35 mm above the ground.

    Mend: put `base_link` above it by the wheels' radius and what the axle hangs below.

    Fix: none.
    """
    ground = _ground(context)
    frame = context.frames.get("base_footprint")
    if ground is None or frame is None or "base_footprint" in context.unsure:
        return
    off = frame.translation[2] - ground
    if abs(off) > 1.5e-3:
        joint = next(iter(context.robot.child_joints["base_footprint"]), None)
        place = joint.pose.origin or joint.origin if joint else context.robot.links["base_footprint"].origin
        wheel = context.wheels.pairs[0].left
        yield Finding(
            place,
            f"base_footprint lies {abs(off) * 1e3:.4g} mm {'above' if off > 0 else 'below'} the plane "
            "that the wheels "
            "touch",
            "put it on the ground (REP 120)",
            (Related("a drive wheel", wheel.joint.pose.origin or wheel.joint.origin),),
        )


@rule("D124", "base-off-axle", Severity.INFO, "drive")
def base_off_axle(context: Context) -> Found:
    """The base frame of a two-wheeled robot is not under the middle of its axle.

    Why: turning on the spot, the base goes round a circle instead of standing still. Differential drive
    odometry reckons with the axle's middle: unless it accounts for the offset, each turn adds an error of
    that size.

    Example: wheels 20 mm ahead of `base_footprint`.

    Mend: put `base_footprint` under the axle's middle, keeping the rest in its place.

    Fix: none.
    """
    if len(context.wheels.pairs) != 1 or context.unsure & {w.link for w in context.wheels.wheels}:
        return
    pair = context.wheels.pairs[0]
    name = "base_footprint" if "base_footprint" in context.frames else "base_link"
    frame = context.frames.get(name)
    if frame is None or name in context.unsure:
        return
    if abs(pair.left.center[1] - pair.right.center[1]) <= abs(pair.left.center[0] - pair.right.center[0]):
        return
    middle = [(a + b) / 2.0 for a, b in zip(pair.left.center, pair.right.center, strict=True)]
    x, y, _ = frame.local((middle[0], middle[1], middle[2]))
    away = math.hypot(x, y)
    if away > 1e-3:
        where = "behind" if x > 0 else "ahead of" if x < 0 else "beside"
        for _, origin in at_both(pair, pose_origin):
            yield Finding(
                origin,
                f"{name} is {away * 1e3:.4g} mm {where} the middle of the axle: turning on the spot it "
                "goes round a "
                f"circle of {away * 1e3:.4g} mm radius",
                f"put {name} under the middle of the axle, or let odometry account for it",
                (Related(name, context.robot.links[name].origin),),
            )


@rule("D128", "below-ground", Severity.INFO, "drive")
def below_ground(context: Context) -> Found:
    """A shape that reaches below the ground that the wheels stand on.

    Why: a collision there carries the robot in the wheels' place, or is thrown out of the ground at the
    first step; a visual is hidden in part.

    Example: a marker cube of `base_footprint`, half of it below.

    Mend: raise it by half its height.

    Fix: none.
    """
    ground = _ground(context)
    if ground is None:
        return
    standing = {w.link for w in context.wheels.wheels} | {c.link for c in context.wheels.casters}
    for link in context.sure_links:
        if link.name in standing or link.name not in context.frames:
            continue
        body, frame = context.bodies[link.name], context.frames[link.name]
        for parts, what, severity in (
            (body.collisions, "collision", Severity.WARNING),
            (body.visuals, "visual", Severity.INFO),
        ):
            deep = [(ground - lowest(p, frame), p) for p in parts if not isinstance(p.geometry, Mesh)]
            depth, part = max(deep, key=lambda d: d[0], default=(0.0, None))
            if part is not None and depth > (1e-3 if what == "collision" else 2e-4):
                yield Finding(
                    part.origin,
                    f"{link.name}: its {what} reaches {depth * 1e3:.3g} mm below the ground that the "
                    "wheels stand on",
                    severity=severity,
                )
                break


@rule("D115", "tips-over", Severity.WARNING, "drive")
def tips_over(context: Context) -> Found:
    """A centre of mass outside the polygon of the contacts, or so near its edge that driving tips the robot.

    Why: outside, the robot falls over standing still. Inside, it tips when it accelerates or brakes by
    more than g x (distance to the edge) / (height): a controller's default of 1 m/s^2 is enough for a
    tall robot.

    Example: two wheels, a caster behind them, and a battery in front of the axle.

    Mend: move the mass over the support, or add a caster on that side.

    Fix: none.
    """
    ground = _ground(context)
    if ground is None or context.unsure:
        return
    points: list[Point] = [(w.center[0], w.center[1]) for w in context.wheels.wheels]
    points += [(c.center[0], c.center[1]) for c in context.wheels.casters if abs(c.bottom - ground) < 0.01]
    hull = convex_hull(points)
    weighed = _center_of_mass(context)
    if len(hull) < 3 or weighed is None:
        return
    mass, center = weighed
    margin, (nx, ny) = _margin(hull, (center[0], center[1]))
    height = center[2] - ground
    if height <= 0.0:
        return
    direction = _direction(nx, ny)
    heavy = _heaviest(context)
    if margin < -1e-3:
        yield Finding(
            heavy or context.robot.origin,
            f"the centre of mass ({mass:.3g} kg) lies {-margin * 1e3:.3g} mm outside the contacts, "
            f"{direction}: the robot "
            "falls over standing still",
            "move the mass over the wheels and casters",
            tuple(Related(f"'{c.link}' bears it", _caster_place(c)) for c in context.wheels.casters[:2]),
        )
    elif _GRAVITY * margin / height < 0.5:
        yield Finding(
            heavy or context.robot.origin,
            f"the centre of mass lies {max(margin, 0.0) * 1e3:.3g} mm inside the contacts, "
            f"{direction}, at a height of "
            f"{height * 1e3:.3g} mm: the robot tips over at {_GRAVITY * max(margin, 0.0) / height:.2g} m/s^2",
            "move the mass, or add a caster on that side",
        )


def _direction(nx: float, ny: float) -> str:
    if abs(nx) >= abs(ny):
        return "at the front" if nx > 0 else "at the back"
    return "on the left" if ny > 0 else "on the right"


def _heaviest(context: Context) -> Origin | None:
    inertials = [link.inertial for link in context.robot.links.values() if link.inertial]
    heaviest = max(inertials, key=lambda i: i.mass, default=None)
    return heaviest.origin if heaviest else None


def _center_of_mass(context: Context) -> tuple[float, Vector] | None:
    """The robot's mass (kg) and centre of mass in the root's frame (m) with all joints at zero."""
    total, moment = 0.0, [0.0, 0.0, 0.0]
    for name, frame in context.frames.items():
        inertial = context.robot.links[name].inertial
        if inertial is None or not math.isfinite(inertial.mass) or inertial.mass <= 0.0:
            continue
        at = frame.point(inertial.pose.xyz)
        total += inertial.mass
        for i in range(3):
            moment[i] += inertial.mass * at[i]
    return (total, (moment[0] / total, moment[1] / total, moment[2] / total)) if total > 0.0 else None


def convex_hull(points: Sequence[Point]) -> list[Point]:
    """Corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    unique = sorted({(round(x, 9), round(y, 9)) for x, y in points})
    if len(unique) < 3:
        return unique

    def half(ordered: Sequence[Point]) -> list[Point]:
        chain: list[Point] = []
        for p in ordered:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 1e-12:
                chain.pop()
            chain.append(p)
        return chain[:-1]

    return half(unique) + half(unique[::-1])


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _margin(hull: Sequence[Point], p: Point) -> tuple[float, Point]:
    """Distance of a point from the nearest edge, positive within, and that edge's outward normal."""
    best, normal = math.inf, (1.0, 0.0)
    for a, b in zip(hull, [*hull[1:], hull[0]], strict=True):
        length = math.hypot(b[0] - a[0], b[1] - a[1])
        inside = _turn(a, b, p) / length
        if inside < best:
            best, normal = inside, ((b[1] - a[1]) / length, -(b[0] - a[0]) / length)
    return best, normal


@rule("D116", "two-contacts", Severity.WARNING, "drive")
def two_contacts(context: Context) -> Found:
    """A robot that stands on its two drive wheels alone.

    Why: it falls forwards or backwards until its chassis touches the ground, and drags it along: the
    drive wheels lose load, and the heading wanders. (A robot that balances by control ignores this.)

    Example: two wheels on a plate, and a caster without `<collision>`.

    Mend: add a caster that touches the ground, with a `<collision>`.

    Fix: none.
    """
    rig = context.wheels
    if len(rig.pairs) != 1 or rig.casters or rig.ground is None or context.unsure:
        return
    if not any(link.collisions for link in context.robot.links.values()):
        return
    driving = {w.link for w in rig.wheels}
    for name, link in context.robot.links.items():
        if name in driving or name not in context.frames:
            continue
        if any(isinstance(c.geometry, Mesh) for c in link.collisions):
            return  # what it touches the ground with is not known here
        for part in context.bodies[name].collisions:
            if lowest(part, context.frames[name]) < rig.ground + 0.25 * max(
                w.radius or 0.0 for w in rig.wheels
            ):
                return
    pair = rig.pairs[0]
    yield Finding(
        pair.left.joint.origin,
        f"the robot stands on '{pair.left.link}' and '{pair.right.link}' alone: it falls over",
        "add a caster that touches the ground, with a <collision>",
    )


@rule("D118", "caster-scrubs", Severity.WARNING, "drive")
def caster_scrubs(context: Context) -> Found:
    """A caster that cannot follow a turn: fixed, or rolling about one axis, with the default friction.

    Why: in a turn it must move sideways. It scrubs, and its friction works against the wheels: measured
    on KBot's size, ten turns on the spot end 218 degrees short.

    Example: `<joint name="caster_wheel_joint" type="continuous"> <axis xyz="0 1 0"/>` for a ball.

    Mend: a swivel joint about z above the roll joint; or a fixed ball without friction
    (`<gazebo reference="caster_wheel"> <mu1>0</mu1> <mu2>0</mu2> </gazebo>`).

    Fix: none.
    """
    speaks_of_friction = any(
        e.tag == "gazebo" and "reference" in e.attributes for e in context.robot.extensions
    )
    axle_x = sum(w.center[0] for w in context.wheels.wheels) / len(context.wheels.wheels)
    ground = _ground(context) or 0.0
    yield from _of_unknown_size(context)
    for caster in context.wheels.casters:
        joint = caster.joint
        if {caster.link, joint.name} & context.unsure or abs(caster.bottom - ground) > 0.02:
            continue
        if not isinstance(caster.part.geometry, Sphere | Cylinder) or joint.type in (
            JointType.FLOATING,
            JointType.PLANAR,
        ):
            continue
        if movable_above(context.robot, joint.parent) is not None or _slides(context, caster.link):
            continue
        if joint.type is JointType.FIXED and _below_swivel(context, joint.parent):
            continue
        arm = abs(caster.center[0] - axle_x)
        if arm < 1e-3:
            continue
        if joint.type is JointType.FIXED:
            severity = Severity.WARNING if speaks_of_friction else Severity.INFO
            text = f"{caster.link}: a fixed caster with the default friction scrubs over the ground"
        else:
            severity = Severity.WARNING
            axis = context.frames[caster.link].direction(joint.axis)
            if abs(axis[2]) > 0.9:
                continue
            text = f"{caster.link}: it rolls about one axis alone, and scrubs sideways in every turn"
        yield Finding(
            joint.axis_origin if joint.axis_origin and joint.is_movable else joint.origin,
            f"{text}, {arm * 1e3:.4g} mm from the axle",
            "let it swivel about z, or make it a fixed ball without friction",
            (Related("what touches the ground", caster.part.origin),),
            severity=severity,
        )


def _of_unknown_size(context: Context) -> Found:
    """Casters whose size or place could not be read: what their joint allows is known all the same."""
    seen = {c.link for c in context.wheels.casters}
    for joint in context.robot.joints.values():
        link = joint.child
        if link in seen or link not in context.unsure or not joint.axis_origin or not joint.has_position:
            continue
        axis = context.frames[link].direction(joint.axis)
        above, below = movable_above(context.robot, joint.parent), context.robot.child_joints[link]
        if (
            is_caster(joint)
            and above is None
            and not below
            and abs(axis[2]) < 0.5
            and not _slides(context, link)
        ):
            yield Finding(
                joint.axis_origin,
                f"{link}: it rolls about one axis alone, and scrubs sideways in every turn",
                "let it swivel about z, or make it a fixed ball without friction",
            )


def _below_swivel(context: Context, link: str) -> bool:
    return movable_above(context.robot, link) is not None


def _slides(context: Context, link: str) -> bool:
    """Whether a `<gazebo reference>` gives the link next to no friction, in Classic's or in SDF's words."""
    for extension in context.robot.extensions:
        if extension.tag == "gazebo" and extension.attributes.get("reference") == link:
            values = [_number(e) for e in extension.descendants() if e.tag in ("mu1", "mu2", "mu")]
            if values and max(values) <= _SLIDES:
                return True
    return False


def _number(element: Element) -> float:
    try:
        return float(element.text)
    except ValueError:
        return 1.0
