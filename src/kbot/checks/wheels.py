"""Rules about drive wheels: their sides, axes, sizes, joints and motors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from kbot.checks.bodies import axis_of
from kbot.checks.context import Context
from kbot.checks.geometry import overlap
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rig import Pair, Wheel, side_of
from kbot.checks.spatial import dot, unit
from kbot.model import Joint, JointType, Mesh
from kbot.text import Origin, Related, Severity

_GRAVITY = 9.81
_SLOPE = math.radians(5.0)


def _pairs(context: Context) -> Iterator[Pair]:
    """Pairs of drive wheels with a left and a right that stand across from each other."""
    for pair in context.wheels.pairs:
        if {pair.left.joint.name, pair.right.joint.name, pair.left.link, pair.right.link} & context.unsure:
            continue
        between = [abs(a - b) for a, b in zip(pair.left.center, pair.right.center, strict=True)]
        if between[1] > max(between[0], between[2]):
            yield pair


def _axis_origin(joint: Joint) -> Origin:
    return joint.axis_origin or joint.origin


def at_both(pair: Pair, place: Callable[[Joint], Origin]) -> Iterator[tuple[Wheel, Origin]]:
    """Where to say what both wheels have in common: at the left one's place, and at the right one's where
    one macro made both, so that it is known for the macro's own."""
    left, right = place(pair.left.joint), place(pair.right.joint)
    yield pair.left, left
    if left.span == right.span:
        yield pair.right, right


def pose_origin(joint: Joint) -> Origin:
    return joint.pose.origin or joint.origin


@rule("D107", "wheels-exchanged", Severity.WARNING, "drive")
def wheels_exchanged(context: Context) -> Found:
    """A wheel called left that stands on the right, or the other way round.

    Why: y points left (REP 103). A controller that is told to turn left speeds up the wheel called
    right, and the robot turns right; odometry turns against the robot, and navigation spins it round.

    Example: `<xacro:wheel prefix="left" reflect="-1"/>`

    Mend: exchange the signs of the wheels' y.

    Fix: none.
    """
    for pair in _pairs(context):
        left, right = pair.left, pair.right
        told = side_of(left.joint.name) == "left" and side_of(right.joint.name) == "right"
        if not told and not _named_sides(context, pair):
            continue
        if left.center[1] < right.center[1]:
            yield Finding(
                left.joint.pose.origin or left.joint.origin,
                f"{left.joint.name}: its wheel stands at y = {left.center[1] * 1e3:.4g} mm, on the right of "
                f"'{right.joint.name}' at {right.center[1] * 1e3:.4g} mm: turns come out reversed",
                "y points left",
                (Related(f"'{right.joint.name}'", right.joint.pose.origin or right.joint.origin),),
            )


def _named_sides(context: Context, pair: Pair) -> bool:
    for driver in context.drivers:
        lefts = {w.text for w in driver.sides.get("left", ())}
        rights = {w.text for w in driver.sides.get("right", ())}
        if pair.left.joint.name in lefts and pair.right.joint.name in rights:
            return True
    return False


@rule("D108", "wheel-axes-opposed", Severity.WARNING, "drive")
def wheel_axes_opposed(context: Context) -> Found:
    """Two wheels of a pair whose axes point in opposite directions.

    Why: equal speeds then turn them against each other: told to go straight, the robot spins on the spot, for
    every controller that knows nothing of it.

    Example: `<axis xyz="0 ${reflect} 0"/>` in a macro called with 1 and -1.

    Mend: let both axes point along +y in the base's frame.

    Fix: none.
    """
    for pair in _pairs(context):
        if dot(pair.left.axis, pair.right.axis) < -0.5:
            wrong, other = (pair.left, pair.right) if pair.left.axis[1] < 0.0 else (pair.right, pair.left)
            yield Finding(
                _axis_origin(wrong.joint),
                f"{wrong.joint.name}: its axis points along {_words(wrong)} of the base, that of "
                f"'{other.joint.name}' along {_words(other)}: equal speeds turn the robot on the spot",
                "let both axes point along +y",
                (Related(f"the axis of '{other.joint.name}'", _axis_origin(other.joint)),),
            )


def _words(wheel: Wheel) -> str:
    """A direction as an axis's name where it is near one."""
    for i, name in enumerate("xyz"):
        if abs(wheel.axis[i]) > 0.98:
            return ("-" if wheel.axis[i] < 0.0 else "+") + name
    return "(" + ", ".join(f"{v:.2g}" for v in wheel.axis) + ")"


@rule("D109", "wheels-drive-backwards", Severity.WARNING, "drive")
def wheels_drive_backwards(context: Context) -> Found:
    """Both wheels' axes point along -y.

    Why: a positive speed then drives the robot backwards. diff_drive controllers take positive for
    forwards: the robot runs from its goal, while its odometry says that it comes nearer.

    Example: `<axis xyz="0 -1 0"/>`

    Mend: `<axis xyz="0 1 0"/>`.

    Fix: none.
    """
    for pair in _pairs(context):
        if pair.left.axis[1] < -0.5 and pair.right.axis[1] < -0.5:
            for wheel, origin in at_both(pair, _axis_origin):
                yield Finding(
                    origin,
                    f"{wheel.joint.name}: its axis, as its partner's, points along -y of the base: a "
                    "positive speed "
                    "drives backwards",
                    "let both axes point along +y",
                )


@rule("D110", "wheel-axis-askew", Severity.WARNING, "drive")
def wheel_axis_askew(context: Context) -> Found:
    """A drive wheel whose joint axis is not level along y, or is not its own cylinder's axis.

    Why: a wheel that turns about another axis than its own tumbles like a coin; one whose axle is askew drags
    sideways on each turn of the wheel.

    Example: a cylinder turned to lie along y on a joint with `<axis xyz="1 0 0"/>`.

    Mend: make axis and cylinder agree: axis `0 1 0` and a geometry with `rpy="${pi/2} 0 0"`.

    Fix: none.
    """
    for pair in _pairs(context):
        for wheel in (pair.left, pair.right):
            if not any(wheel.axis) or wheel.joint.type is JointType.FIXED:
                continue
            own = axis_of(wheel.part) if wheel.part else None
            if own is not None:
                link = context.robot.parent_joint[wheel.link].child
                round_ = unit(_part_direction(context, wheel, own, link))
                if round_ and abs(dot(round_, wheel.axis)) < 0.985:
                    angle = math.degrees(math.acos(min(1.0, abs(dot(round_, wheel.axis)))))
                    yield Finding(
                        _axis_origin(wheel.joint),
                        f"{wheel.joint.name}: it turns about an axis {angle:.3g} degrees from that of "
                        "its own "
                        "cylinder: the wheel tumbles",
                        related=(Related("the cylinder", wheel.part.origin),) if wheel.part else (),
                    )
                    continue
            if abs(wheel.axis[1]) < 0.985:
                angle = math.degrees(math.acos(min(1.0, abs(wheel.axis[1]))))
                yield Finding(
                    _axis_origin(wheel.joint),
                    f"{wheel.joint.name}: its axis lies {angle:.3g} degrees from the base's y axis: "
                    "the wheel drags "
                    "sideways",
                )


def _part_direction(
    context: Context, wheel: Wheel, own: tuple[float, float, float], link: str
) -> tuple[float, float, float]:
    """A direction of the wheel's part in the root's frame; the part may be on a link fixed to the wheel's."""
    for name, body in context.bodies.items():
        if wheel.part in body.parts:
            return context.frames[name].direction(own)
    return context.frames[link].direction(own)


@rule("D111", "wheels-not-mirrored", Severity.WARNING, "drive")
def wheels_not_mirrored(context: Context) -> Found:
    """Two wheels of a pair that are not each other's mirror image in place, size or mass.

    Why: with radii that differ by 1 % a robot with a track of 17 cm that is told to go straight goes round a
    circle of 17 m; axles that do not line up scrub; a heavier side brakes later.

    Example: left wheel at `x="0.02"`, right wheel at `x="0.025"`.

    Mend: make both by one macro with a sign.

    Fix: none.
    """
    links = context.robot.links
    for pair in _pairs(context):
        left, right = pair.left, pair.right
        size = max(left.radius or 0.0, right.radius or 0.0) or 0.05
        differences: list[str] = []
        for what, a, b, tolerance in (
            ("x", left.center[0], right.center[0], max(5e-4, 0.01 * size)),
            ("z", left.center[2], right.center[2], max(5e-4, 0.01 * size)),
            ("y (from the middle)", abs(left.center[1]), abs(right.center[1]), max(1e-3, 0.02 * size)),
            ("radius", left.radius, right.radius, 0.002 * size),
            ("width", left.width, right.width, 0.02 * size),
        ):
            if a is not None and b is not None and abs(a - b) > tolerance:
                differences.append(f"{what} {a * 1e3:.4g} and {b * 1e3:.4g} mm")
        first, second = links[left.link].inertial, links[right.link].inertial
        if first and second and abs(first.mass - second.mass) > 0.02 * max(first.mass, second.mass):
            differences.append(f"mass {first.mass:.4g} and {second.mass:.4g} kg")
        if differences:
            yield Finding(
                right.joint.pose.origin or right.joint.origin,
                f"{left.joint.name} and {right.joint.name} are not mirror images: " + "; ".join(differences),
                "make both by one macro",
                (Related(f"'{left.joint.name}'", left.joint.pose.origin or left.joint.origin),),
            )


@rule("D114", "wheel-in-chassis", Severity.INFO, "drive")
def wheel_in_chassis(context: Context) -> Found:
    """A drive wheel that lies within a shape of the link that carries it.

    Why: simulators leave out contacts between a link and its child, so that it goes unnoticed there;
    seen, the wheel is hidden; once the wheel's joint is two links away, both push each other apart.

    Example: a chassis box 20 cm wide with wheels 15 cm apart and no wheel wells.

    Mend: move the wheels out, or make the collision of several boxes.

    Fix: none.
    """
    for pair in _pairs(context):
        for wheel in (pair.left, pair.right):
            joint = wheel.joint
            if wheel.part is None or wheel.width is None or joint.parent in context.unsure:
                continue
            for part in context.bodies[joint.parent].collisions or context.bodies[joint.parent].visuals:
                if isinstance(part.geometry, Mesh):
                    continue
                depth = overlap(context, wheel.link, wheel.part, joint.parent, part)
                if depth > 0.5 * wheel.width or depth > 0.25 * (wheel.radius or 0.0):
                    yield Finding(
                        joint.pose.origin or joint.origin,
                        f"{wheel.link}: the wheel lies {depth * 1e3:.3g} mm deep in '{joint.parent}'",
                        related=(Related(f"the shape of '{joint.parent}'", part.origin),),
                    )
                    break


@rule("D117", "wheel-cannot-turn", Severity.WARNING, "drive")
def wheel_cannot_turn(context: Context) -> Found:
    """A drive wheel on a fixed joint or on one with limits.

    Why: the robot drives until the wheel meets its stop, after a third of a metre for a wheel of 5 cm and a
    full turn, or not at all.

    Example: `<joint name="left_wheel_joint" type="revolute"> … <limit lower="-3.14" upper="3.14" …/>`

    Mend: `type="continuous"`.

    Fix: none.
    """
    for pair in _pairs(context):
        driven = any(w.joint.name in names for w in (pair.left, pair.right) for names in [_driven(context)])
        turning = [w for w in (pair.left, pair.right) if w.joint.type is JointType.CONTINUOUS]
        for wheel in (pair.left, pair.right):
            joint = wheel.joint
            if joint.type is JointType.FIXED and (driven or turning):
                yield Finding(
                    joint.origin, f"{joint.name}: a drive wheel on a fixed joint does not turn", _MEND
                )
            elif joint.type is JointType.REVOLUTE and joint.limit:
                low, high = joint.limit.lower or 0.0, joint.limit.upper or 0.0
                if high - low < 1e4:
                    way = (high - low) * (wheel.radius or 0.0)
                    yield Finding(
                        joint.origin,
                        f"{joint.name}: a drive wheel with limits {low:.4g}..{high:.4g} rad stops "
                        f"after {way:.3g} m",
                        _MEND,
                        (Related("the limits", joint.limit.origin),),
                    )


_MEND = 'type="continuous"'


def _driven(context: Context) -> set[str]:
    return {w.text for d in context.drivers for names in d.sides.values() for w in names}


@rule("D119", "wheel-effort-small", Severity.WARNING, "drive")
def wheel_effort_small(context: Context) -> Found:
    """Wheel joints whose effort limits together cannot hold the robot on a slope of 5 degrees.

    Why: the torque needed is mass x g x sin(slope) x radius. With less the robot does not climb a
    ramp or a door sill, and on the flat it follows its commands late.

    Example: 20 kg on wheels of 5 cm needs 0.85 N m; two wheels with `effort="0.1"` give 0.2.

    Mend: write the motors' torque, or the robot's true mass.

    Fix: none.
    """
    wheels = [w for pair in _pairs(context) for w in (pair.left, pair.right)]
    efforts = [w.joint.limit.effort for w in wheels if w.joint.limit and w.joint.limit.effort]
    radii = [w.radius for w in wheels if w.radius]
    mass = sum(
        link.inertial.mass
        for link in context.robot.links.values()
        if link.inertial and math.isfinite(link.inertial.mass)
    )
    if not wheels or len(efforts) < len(wheels) or not radii:
        return
    needed = mass * _GRAVITY * math.sin(_SLOPE) * max(radii)
    if sum(efforts) < needed:
        limit = wheels[0].joint.limit
        slope = math.degrees(math.asin(min(1.0, sum(efforts) / (mass * _GRAVITY * max(radii)))))
        yield Finding(
            limit.origin if limit else wheels[0].joint.origin,
            f"{len(wheels)} wheels with {sum(efforts):.3g} N m together carry {mass:.4g} kg up "
            f"{slope:.2g} degrees at "
            f"most; 5 degrees need {needed:.3g} N m",
            "write the motors' torque",
        )


@rule("D120", "wheel-mesh-collision", Severity.INFO, "drive")
def wheel_mesh_collision(context: Context) -> Found:
    """A drive wheel that touches the ground with a mesh.

    Why: a mesh is a polygon: the wheel rumbles from edge to edge, its rolling radius changes with its
    angle, and each contact costs as much as a hundred plain ones.

    Example: `<collision> <geometry> <mesh filename="…/wheel.stl"/>`

    Mend: a cylinder (or a sphere) of the wheel's radius; the visual may stay a mesh.

    Fix: none.
    """
    for pair in _pairs(context):
        for wheel in (pair.left, pair.right):
            for collision in context.robot.links[wheel.link].collisions:
                if isinstance(collision.geometry, Mesh):
                    yield Finding(
                        collision.geometry.origin,
                        f"{wheel.link}: the wheel touches the ground with a mesh, which rumbles",
                        "use a cylinder of the wheel's radius",
                    )
                    break


@rule("D125", "wheel-undriven", Severity.INFO, "drive")
def wheel_undriven(context: Context) -> Found:
    """A drive wheel that nothing drives: no plugin, controller, transmission, nor limit of effort or speed.

    Why: on the screen the robot moves; in a simulator nothing ever turns the wheel, or what does turns it
    with unbounded torque: it reaches any speed within one step, and slips or tips.

    Example: `<joint name="left_wheel_joint" type="continuous">` without `<limit>` in a description
    without plugins.

    Mend: add `<limit effort="…" velocity="…"/>` and `<dynamics damping="…"/>`, and a drive plugin or
    ros2_control.

    Fix: none.
    """
    driven = _driven(context)
    for extension in context.robot.extensions:
        for element in (extension, *extension.descendants()):
            if element.tag == "joint" and "name" in element.attributes:
                driven.add(element.attributes["name"])
            if "oint" in element.tag and element.text.strip():
                driven.add(element.text.strip())
    for pair in _pairs(context):
        for wheel in (pair.left, pair.right):
            joint = wheel.joint
            if joint.name in driven or joint.limit is not None or joint.type is not JointType.CONTINUOUS:
                continue
            lacks = "no effort or velocity limit" + (
                ", no damping or friction" if joint.dynamics is None else ""
            )
            yield Finding(
                joint.origin,
                f"{joint.name}: no plugin, controller or transmission drives it, and it has {lacks}",
                'add <limit effort="…" velocity="…"/> and what drives the wheel',
            )
