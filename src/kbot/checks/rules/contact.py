"""Rules about the ground contact of a wheeled robot: contact plane, casters, support, footprint."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.edits import remove_element, set_attribute
from kbot.checks.facts.bodies import lowest
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.wheels import at_both, pose_origin
from kbot.kinematics.drive.drive import HolonomicDrive, SteeredDrive
from kbot.kinematics.drive.wheels import Caster, is_caster, movable_above
from kbot.model import Cylinder, Joint, JointType, Mesh, Sphere
from kbot.text import Edit, Element, Fix, Origin, Related, Severity, Span
from kbot.xacro.location import within
from kbot.xacro.not_a_number import TOKEN as _WORDS

_SLIDES = 0.2
"""A caster with at most this friction coefficient slides in a turn. Gazebo's default is 1."""
_UP = (0.0, 0.0, 1.0)
_LEVEL = 1.0 - 1e-6
"""The cosine of a tilt that changes no height by a tenth of a millimetre."""
_BESIDE = 45.0
"""Degrees of tilt from which a caster is beside the axle, and not before or behind it."""
_LEAST_OFF = 1e-3
"""m. Wheels, casters and frames that are off by less than this are not reported."""


def _ground(context: Context) -> float | None:
    """The height of the ground below the wheels, m. None if it is unknown.

    Wheels with rollers stand on these, and not on their hubs."""
    has_treads = isinstance(context.drive, HolonomicDrive) and bool(context.drive.treads)
    return None if has_treads else context.base.ground


def caster_place(context: Context, caster: Caster) -> Origin:
    return pose_origin(context.robot.parent_joint[caster.link])


@rule("D112", "not-on-ground", Severity.WARNING, "drive")
def not_on_ground(context: Context) -> Found:
    """The lowest point of a caster or wheel is not at the height of the ground under the drive wheels.

    Why: A caster that is 5 mm too high hangs in the air. The robot tips onto it when it brakes, and its lidar
    then scans the floor. A caster that is 5 mm too low lifts the drive wheels, which spin in the air.

    Example: A caster of radius 0.015 on a mount that was made for radius 0.0175.

    Fix: Compute the mount's height from both radii: `z = wheel_z - wheel_radius + caster_radius`.

    Autofix: unsafe: KBot writes the height with which the caster touches the ground as the z of its joint.
    """
    ground = _ground(context)
    if ground is None:
        return
    size = max(w.radius for w in context.base.wheels)
    axle = context.base.pairs[0]
    for wheel in context.base.wheels:
        if not wheel.radius or wheel.link in context.unsure:
            continue
        off = wheel.bottom - ground
        if len(context.base.pairs) > 1 and abs(off) > max(_LEAST_OFF, 0.02 * size):
            yield Finding(
                wheel.joint.pose.origin or wheel.joint.origin,
                f"{wheel.link}: its lowest point is {abs(off) * 1e3:.3g} mm "
                f"{'above' if off > 0 else 'below'} that of the other wheels",
                related=(Related("the wheel it is compared with", axle.left.joint.origin),),
            )
    touching = [c for c in context.base.casters if abs(c.bottom - ground) <= max(_LEAST_OFF, 0.03 * size)]
    for caster in context.base.casters:
        if {caster.link, context.robot.parent_joint[caster.link].name} & context.unsure:
            continue
        off = caster.bottom - ground
        arm = max(abs(caster.center[0] - axle.left.center[0]), 1e-3)
        tilt = math.degrees(math.atan2(abs(off), arm))
        # if a caster touches the ground, only a ball that hangs is reported; beside the axle or between two
        # axles the robot does not tip onto it
        hangs = off > max(_LEAST_OFF, 0.03 * size) and (not touching or isinstance(caster.shape, Sphere))
        if hangs and len(context.base.pairs) == 1 and tilt < _BESIDE:
            yield Finding(
                caster_place(context, caster),
                f"{caster.link} hangs {off * 1e3:.3g} mm above the ground on which the wheels stand: "
                f"the robot tips by {tilt:.2g} degrees until this caster touches the ground",
                *_height(context, caster, off),
            )
        elif off < -_LEAST_OFF:
            yield Finding(
                caster_place(context, caster),
                f"{caster.link} reaches {-off * 1e3:.3g} mm below the ground on which the wheels stand: "
                f"it lifts them or tilts the robot by {tilt:.2g} degrees",
                *_height(context, caster, off),
            )


def _height(context: Context, caster: Caster, off: float) -> tuple[str, tuple[Related, ...], Fix | None]:
    """The hint, related places and fix of a caster whose lowest point is `off` m above the ground.

    The height is given for the caster's joint, if its parent link is not tilted.
    """
    axle = context.base.pairs[0].left
    related = (Related("its shape", caster.shape.origin), Related("a drive wheel", axle.joint.origin))
    joint = context.robot.parent_joint[caster.link]
    origin = joint.pose.origin
    if context.frames[joint.parent].direction(_UP)[2] < _LEVEL or origin is None:
        return "compute its height from the radii", related, None
    height = f"{joint.pose.xyz[2] - off:.6g}"
    hint = f"set the z of its joint to {height} (axle z - wheel radius + caster radius)"
    return hint, related, _with_z(context, origin, height)


def _with_z(context: Context, origin: Origin, height: str) -> Fix | None:
    """The fix that writes the z of an `<origin>`."""
    element = context.element_at(origin)
    span = element.attribute_spans().get("xyz") if element is not None else None
    words = list(_WORDS.finditer(span[1].text)) if span is not None else []
    if span is None or len(words) != 3:
        return None
    place = within(span[1], span[1].text, *words[2].span())
    return Fix(f"write z = {height}", (Edit(place, height),), safe=False)


@rule("D113", "footprint-off-ground", Severity.WARNING, "drive")
def footprint_off_ground(context: Context) -> Found:
    """`base_footprint` does not lie in the plane in which the wheels touch the ground.

    Why: REP 120 puts `base_footprint` on the ground. Navigation projects obstacles and poses onto it. At
    another height rviz draws the robot below or above the floor, and a height filter takes the floor for an
    obstacle. A robot that is spawned at z = 0 falls or jumps.

    Example: A joint from `base_footprint` to `base_link` at z = 0, although the axle is 35 mm above the
    ground.

    Fix: For the joint from `base_footprint` to `base_link`, set z to the wheel radius plus the height of
    `base_link` above the axle.

    Autofix: none.
    """
    ground = _ground(context)
    frame = context.frames.get("base_footprint")
    if ground is None or frame is None or "base_footprint" in context.unsure:
        return
    off = frame.translation[2] - ground
    if abs(off) > 1.5e-3:
        joint = next(iter(context.robot.child_joints["base_footprint"]), None)
        place = joint.pose.origin or joint.origin if joint else context.robot.links["base_footprint"].origin
        wheel = context.base.pairs[0].left
        yield Finding(
            place,
            f"base_footprint is {abs(off) * 1e3:.4g} mm {'above' if off > 0 else 'below'} the ground "
            "under the wheels",
            "put it on the ground (REP 120)",
            (Related("a drive wheel", wheel.joint.pose.origin or wheel.joint.origin),),
        )


@rule("D124", "base-off-axle", Severity.INFO, "drive")
def base_off_axle(context: Context) -> Found:
    """The base frame of a two-wheeled robot is not under the middle of its axle.

    Why: When the robot turns on the spot, its base moves on a circle. Differential drive odometry computes
    the motion of the axle's middle. If it does not account for the offset, each turn adds an error of that
    size.

    Example: Wheels 20 mm ahead of `base_footprint`.

    Fix: Put `base_footprint` under the middle of the axle, and keep all other parts where they are.

    Autofix: none.
    """
    is_two_wheeled = len(context.base.pairs) == 1 and not context.is_holonomic
    if (
        not is_two_wheeled
        or isinstance(context.drive, SteeredDrive)
        or context.unsure & {w.link for w in context.base.wheels}
    ):
        return
    pair = context.base.pairs[0]
    name = "base_footprint" if "base_footprint" in context.frames else "base_link"
    frame = context.frames.get(name)
    if frame is None or name in context.unsure:
        return
    if abs(pair.left.center[1] - pair.right.center[1]) <= abs(pair.left.center[0] - pair.right.center[0]):
        return
    middle = [(a + b) / 2.0 for a, b in zip(pair.left.center, pair.right.center, strict=True)]
    x, y, _ = frame.local((middle[0], middle[1], middle[2]))
    away = math.hypot(x, y)
    if away > _LEAST_OFF:
        where = "behind" if x > 0 else "ahead of" if x < 0 else "beside"
        for _, origin in at_both(pair, pose_origin):
            yield Finding(
                origin,
                f"{name} is {away * 1e3:.4g} mm {where} the middle of the axle: when the robot turns on the "
                f"spot, {name} moves on a circle of {away * 1e3:.4g} mm radius",
                f"put {name} under the middle of the axle, or account for the offset in odometry",
                (Related(name, context.robot.links[name].origin),),
            )


@rule("D128", "below-ground", Severity.INFO, "drive")
def below_ground(context: Context) -> Found:
    """A shape reaches below the ground on which the wheels stand.

    Why: A collision below the ground supports the robot in place of the wheels, or the simulator pushes the
    robot out of the ground in the first step. The part of a visual below the ground is hidden.

    Example: A marker cube on `base_footprint`, half of which is below the ground.

    Fix: Raise the shape. For a cube that is half below the ground, raise it by half its height.

    Autofix: none.
    """
    ground = _ground(context)
    if ground is None:
        return
    standing = {w.link for w in context.base.wheels} | {c.link for c in context.base.casters}
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
            if part is not None and depth > (_LEAST_OFF if what == "collision" else 2e-4):
                yield Finding(
                    part.origin,
                    f"{link.name}: its {what} reaches {depth * 1e3:.3g} mm below the ground under the wheels",
                    f"raise it by {depth * 1e3:.3g} mm",
                    severity=severity,
                )
                break


@rule("D118", "caster-scrubs", Severity.WARNING, "drive")
def caster_scrubs(context: Context) -> Found:
    """A caster cannot follow a turn: it is fixed or rolls about one axis, and has the default friction.

    Why: In a turn a caster must move sideways. It scrubs over the ground, and its friction works against the
    wheels. In a simulation of KBot with a single-axis caster and default contacts, ten turns on the spot
    ended 218 degrees short.

    Example: `<joint name="caster_wheel_joint" type="continuous"> <axis xyz="0 1 0"/>` for a ball.

    Fix: Put a swivel joint about z above the roll joint, or use a fixed ball without friction:
    `<gazebo reference="caster_wheel"> <mu1>0</mu1> <mu2>0</mu2> </gazebo>`.

    Autofix: unsafe: KBot makes a ball fixed and frictionless. It does not change a ball that a macro creates.
    """
    if context.is_holonomic:
        return  # its wheels slide sideways
    # without settings for Gazebo a description cannot set friction, so a fixed caster is only a note
    is_for_gazebo = any(e.tag == "gazebo" and "reference" in e.attributes for e in context.robot.extensions)
    axle_x = sum(w.center[0] for w in context.base.wheels) / len(context.base.wheels)
    ground = _ground(context) or 0.0
    yield from _of_unknown_size(context)
    for caster in context.base.casters:
        joint = context.robot.parent_joint[caster.link]
        if {caster.link, joint.name} & context.unsure or abs(caster.bottom - ground) > 0.02:
            continue
        if not isinstance(caster.shape, Sphere | Cylinder) or joint.type in (
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
            continue  # beside the axle a turn on the spot does not move it sideways
        if joint.type is JointType.FIXED:
            severity = Severity.WARNING if is_for_gazebo else Severity.INFO
            friction = _friction(context, caster.link)
            has = "the default friction" if friction is None else f"a friction of {friction:g}"
            text = f"{caster.link}: a fixed caster with {has} scrubs over the ground"
        else:
            severity = Severity.WARNING
            axis = context.frames[caster.link].direction(joint.axis)
            if abs(axis[2]) > 0.9:
                continue  # an upright axis is a swivel
            text = f"{caster.link}: {_ONE_AXIS}"
        is_ball = isinstance(caster.shape, Sphere)
        slides = f'<gazebo reference="{caster.link}"> <mu1>0</mu1> <mu2>0</mu2> </gazebo>'
        yield Finding(
            joint.axis_origin if joint.axis_origin and joint.is_movable else joint.origin,
            f"{text}, {arm * 1e3:.4g} mm from the axle",
            f'make it a fixed ball without friction: type="fixed" without <axis>, and {slides}'
            if is_ball
            else _SWIVEL,
            (Related("its shape on the ground", caster.shape.origin),),
            _as_sliding_ball(context, joint, slides) if is_ball else None,
            severity,
        )


def _as_sliding_ball(context: Context, joint: Joint, slides: str) -> Fix | None:
    """The fix that makes a ball caster fixed and frictionless. None in a macro."""
    element = context.element_at(joint.origin)
    if element is None or joint.origin.call is not None:
        return None
    edits = set_attribute(element, "type", "fixed")
    for part in element.elements():
        if part.tag in ("axis", "limit", "dynamics", "mimic"):  # without effect on a fixed joint
            edits += remove_element(part, safe=False).edits
    line = element.source.line(element.source.line_column(element.start)[0])
    indent = line[: len(line) - len(line.lstrip())]
    at = Span(element.source, element.end, element.end)
    edits += (Edit(at, f"{element.source.line_end}{indent}{slides}"),)
    return Fix("make it a fixed ball without friction", edits, safe=False)


_ONE_AXIS = "it rolls about one axis only and scrubs sideways in every turn"
_SWIVEL = "let it swivel about z, or make it a fixed ball without friction"


def _of_unknown_size(context: Context) -> Found:
    """D118 for casters whose size or place could not be read: their joint alone shows the fault."""
    seen = {c.link for c in context.base.casters}
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
                f"{link}: {_ONE_AXIS}",
                _SWIVEL,
            )


def _below_swivel(context: Context, link: str) -> bool:
    return movable_above(context.robot, link) is not None


def _slides(context: Context, link: str) -> bool:
    """Whether a link has next to no friction."""
    friction = _friction(context, link)
    return friction is not None and friction <= _SLIDES


def _friction(context: Context, link: str) -> float | None:
    """The coefficient of friction that a `<gazebo reference>` gives a link, with tags of Classic or of SDF:
    the larger of both directions, and the smaller of two references. None if it gives none."""
    found = []
    for extension in context.robot.extensions:
        if extension.tag == "gazebo" and extension.attributes.get("reference") == link:
            values = [_number(e) for e in extension.descendants() if e.tag in ("mu1", "mu2", "mu")]
            found += [max(values)] if values else []
    return min(found, default=None)


def _number(element: Element) -> float:
    """The number in an element's text or, as Gazebo also accepts, in its `value`; 1 if it is not a number."""
    try:
        return float(element.attributes.get("value", element.text))
    except ValueError:
        return 1.0
