"""Rules about mass and tensors on their own: numbers that no rigid body can have."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.inertia_fixes import solid_fix, solid_hint
from kbot.kinematics.spatial import Vector, eigenvalues
from kbot.model import Inertial, Joint, Link, Mesh, RobotModel
from kbot.text import Related, Severity

_RATIO = 1000.0


def weights_below(context: Context, only_fixed: bool = True) -> dict[str, float]:
    """Mass of each link and of what fixed joints hold to it, or of all that hangs on it, kg."""
    robot = context.robot
    masses: dict[str, float] = {}
    for link in reversed(_downwards(robot)):
        hanging = sum(masses[j.child] for j in robot.child_joints[link] if not (only_fixed and j.is_movable))
        masses[link] = _own_mass(context, link) + hanging
    return masses


def _downwards(robot: RobotModel) -> list[str]:
    """The links, each behind its parent."""
    links = [robot.root]
    for link in links:
        links += [j.child for j in robot.child_joints[link]]
    return links


def _own_mass(context: Context, link: str) -> float:
    inertial = context.robot.links[link].inertial
    return inertial.mass if inertial and math.isfinite(inertial.mass) else 0.0


@rule("I116", "mass-ratio", Severity.WARNING, "robot")
def mass_ratio(context: Context) -> Found:
    """Bodies on both sides of a movable joint whose masses differ by more than 1000 times.

    Why: the contact and joint solvers of Gazebo, Bullet and MuJoCo converge slowly then: joints
    stretch, the light body trembles, a heavy load hangs on a light link as on a spring.

    Example: an arm of 2000 kg on a turntable of 1 kg.

    Fix: check the units, and give the light link its real mass.

    Autofix: none.
    """
    all_below, fixed_below = weights_below(context, only_fixed=False), weights_below(context)
    top = _tops(context.robot)
    for joint in context.sure_joints:
        if not joint.is_movable or {joint.parent, joint.child} & context.unsure:
            continue
        above, below = fixed_below[top[joint.parent]], fixed_below[joint.child]
        hanging = all_below[joint.child]
        if below <= 0.0 or above <= 0.0:
            continue
        if hanging / above > _RATIO:
            yield _ratio_finding(context, joint, hanging, above, joint.child, joint.parent)
        elif above / below > _RATIO and below > 0.02:
            yield _ratio_finding(context, joint, above, below, joint.parent, joint.child)


def _ratio_finding(
    context: Context, joint: Joint, heavy: float, light: float, heavy_link: str, light_link: str
) -> Finding:
    links = context.robot.links
    related = tuple(
        Related(f"the {word} side", inertial.mass_origin)
        for word, name in (("heavy", heavy_link), ("light", light_link))
        if (inertial := links[name].inertial)
    )
    return Finding(
        joint.origin,
        f"{joint.name}: {heavy:.4g} kg at '{heavy_link}' against {light:.4g} kg at '{light_link}', "
        f"{heavy / light:.0f} times: the joint will be soft and tremble",
        "check the masses' units",
        related,
    )


def _tops(robot: RobotModel) -> dict[str, str]:
    """For each link the topmost one that fixed joints hold it to: together they are one rigid body."""
    tops: dict[str, str] = {}
    for link in _downwards(robot):
        joint = robot.parent_joint.get(link)
        tops[link] = link if joint is None or joint.is_movable else tops[joint.parent]
    return tops


def weighed(context: Context) -> Iterator[tuple[Link, Inertial]]:
    """Links with an inertial, those left out that an error touches."""
    for link in context.sure_links:
        if link.inertial is not None:
            yield link, link.inertial


def is_finite(inertial: Inertial) -> bool:
    i = inertial
    return all(map(math.isfinite, (i.mass, i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz, *i.pose.xyz)))


def sound(inertial: Inertial) -> bool:
    """A finite positive mass and a positive definite tensor."""
    return is_finite(inertial) and inertial.mass > 0.0 and eigenvalues(inertial.tensor)[0] > 0.0


def breaks_triangle(moments: Vector) -> bool:
    """Whether the largest of three principal moments is more than the others together."""
    low, middle, high = sorted(moments)
    return low > 1e-9 * high and high > (low + middle) * 1.01


@rule("I102", "mass-not-positive", Severity.ERROR, "robot")
def mass_not_positive(context: Context) -> Found:
    """A movable link whose mass is zero or negative.

    Why: a force on it gives an infinite acceleration, or one the wrong way. Gazebo drops the link
    without a word, MuJoCo refuses the robot, Bullet welds it to the world.

    Example: `<mass value="0"/>`

    Fix: set the part's real mass. A massless frame on a fixed joint needs no `<inertial>`.

    Autofix: none.
    """
    for link, inertial in weighed(context):
        if not math.isfinite(inertial.mass) or inertial.mass > 0.0:
            continue
        joint = context.robot.parent_joint.get(link.name)
        if inertial.mass == 0.0 and (joint is None or not joint.is_movable):
            continue
        yield Finding(
            inertial.mass_origin,
            f"{link.name}: the mass is {inertial.mass:g} kg: no simulator can accelerate it as meant",
            "set the part's real mass, or leave <inertial> out of a massless frame on a fixed joint",
        )


@rule("I103", "zero-tensor", Severity.WARNING, "robot")
def zero_tensor(context: Context) -> Found:
    """A movable link with mass and a tensor of zeros.

    Why: the link turns without resistance: a motor spins it up infinitely fast. MuJoCo refuses it, ODE
    and Bullet become unstable at the first contact.

    Example: `<mass value="1"/> <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>`

    Fix: use the tensor of a solid of the link's shape.

    Autofix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        joint = context.robot.parent_joint.get(link.name)
        if joint is None or not joint.is_movable or not is_finite(inertial) or not inertial.mass > 0.0:
            continue
        if all(v == 0.0 for row in inertial.tensor for v in row):
            yield Finding(
                inertial.inertia_origin,
                f"{link.name}: {inertial.mass:g} kg with a tensor of zeros: nothing resists its turning",
                solid_hint(context, link, inertial),
                fix=solid_fix(context, link, inertial),
            )


@rule("I104", "not-positive-definite", Severity.ERROR, "robot")
def not_positive_definite(context: Context) -> Found:
    """A tensor with a moment that is zero or negative.

    Why: about that axis a torque turns the link the wrong way, or infinitely fast; kinetic energy can
    be negative. MuJoCo refuses it; other engines explode.

    Example: `ixx="0.001" iyy="0.001" izz="-0.001"`, or products larger than the moments.

    Fix: take the tensor from the part's CAD model about its centre of mass, or from a solid of its shape.

    Autofix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        if not is_finite(inertial) or not inertial.mass > 0.0:
            continue
        tensor = inertial.tensor
        low, _, high = eigenvalues(tensor)
        if all(v == 0.0 for row in tensor for v in row) or low > 1e-9 * abs(high):
            continue
        if low >= 0.0 and not _moves(context, link):
            continue
        yield Finding(
            inertial.inertia_origin,
            f"{link.name}: the tensor is not positive definite: its smallest principal moment is "
            f"{low:.4g} kg m^2",
            solid_hint(context, link, inertial),
            fix=solid_fix(context, link, inertial),
        )


def _moves(context: Context, link: Link) -> bool:
    joint = context.robot.parent_joint.get(link.name)
    return joint is not None and joint.is_movable


@rule("I105", "triangle-inequality", Severity.WARNING, "robot")
def triangle_inequality(context: Context) -> Found:
    """Principal moments of which one is larger than the other two together.

    Why: no distribution of mass has them: a moment is made of the same squared distances as the
    other two. MuJoCo refuses the robot; elsewhere it tumbles as no body can. What follows from
    that one moment (I107, I108, I111) is not said again.

    Example: `ixx="0.001" iyy="0.001" izz="0.01"`

    Fix: take the tensor from the part's CAD model about its centre of mass, or from a solid of its shape.

    Autofix: unsafe: the tensor of a solid of the link's shape, in numbers or by the macro that computes it.
    """
    for link, inertial in weighed(context):
        if not is_finite(inertial):
            continue
        low, middle, high = moments = eigenvalues(inertial.tensor)
        if breaks_triangle(moments):
            yield Finding(
                inertial.inertia_origin,
                f"{link.name}: principal moments {low:.4g}, {middle:.4g}, {high:.4g} kg m^2: the largest is "
                f"{high / (low + middle):.3g} times the other two together; no body has such a tensor",
                solid_hint(context, link, inertial),
                fix=solid_fix(context, link, inertial),
            )


@rule("I106", "no-inertial", Severity.WARNING, "robot")
def no_inertial(context: Context) -> Found:
    """A link that a movable joint carries, without `<inertial>` on it or on what is fixed to it.

    Why: Gazebo and gz drop such a link with its joint and everything behind it, without a word;
    MuJoCo refuses a moving body without mass. In rviz all looks well.

    Example: `<link name="left_wheel"> <visual>…</visual> <collision>…</collision> </link>`

    Fix: add `<inertial>` with a mass and the tensor of a solid of the link's shape.

    Autofix: none; nobody but the author knows the mass.
    """
    robot = context.robot
    if not any(link.inertial for link in robot.links.values()):
        return
    weights = weights_below(context)
    for joint in context.sure_joints:
        if not joint.is_movable or joint.child in context.unsure or joint.child not in robot.links:
            continue
        link = robot.links[joint.child]
        if link.inertial is not None or weights[joint.child]:
            continue
        yield Finding(
            link.origin,
            f"{link.name}: {joint.type} joint '{joint.name}' moves it, and it has no <inertial>: "
            "simulators drop it, and all that hangs on it",
            "add <inertial> with a mass and a tensor",
            (Related(f"the joint '{joint.name}'", joint.origin),),
        )


@rule("I114", "placeholder-tensor", Severity.WARNING, "robot")
def placeholder_tensor(context: Context) -> Found:
    """The same tensor on three links or more whose shapes or masses differ.

    Why: it is a placeholder that was copied along. Links of 1 cm and of 1 m then turn equally hard:
    the small ones hardly move, the large ones are thrown about.

    Example: `<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>` on every link.

    Fix: give each link the tensor of its own shape.

    Autofix: none.
    """
    groups: dict[tuple[float, ...], list[tuple[Link, Inertial]]] = defaultdict(list)
    for link, inertial in weighed(context):
        i = inertial
        groups[i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz].append((link, inertial))
    for key, group in groups.items():
        if len(group) < 3 or not all(map(math.isfinite, key)) or not any(key):
            continue
        alike = key[0] == key[3] == key[5]
        bodies = {(_outline(context, link, alike), i.mass) for link, i in group}
        sized = {body for body in bodies if isinstance(body[0], tuple)}
        if len(sized) < 2 and len({outline for outline, _ in bodies if outline}) < 3:
            continue
        (link, inertial), *others = group
        names = ", ".join(other.name for other, _ in others[:6]) + (" …" if len(others) > 6 else "")
        yield Finding(
            inertial.inertia_origin,
            f"{link.name}: the same tensor (ixx {key[0]:g} kg m^2) as on {names}, whose shapes or masses "
            "differ: a placeholder?",
            solid_hint(context, link, inertial),
            tuple(Related(other.name, its.inertia_origin) for other, its in others[:6]),
        )


def _outline(context: Context, link: Link, by_name: bool) -> tuple[float, ...] | str | None:
    """What tells one link's size from another's: extents to a millimetre, or the meshes' names."""
    body = context.bodies[link.name]
    bounds = body.ends
    if bounds is not None and body.complete:
        return tuple(round(end - start, 3) for start, end in zip(*bounds, strict=True))
    if not by_name:
        return None
    meshes = sorted({s.geometry.uri for s in link.shapes if isinstance(s.geometry, Mesh)})
    return ";".join(meshes) or None


@rule("I115", "root-inertia", Severity.INFO, "robot")
def root_inertia(context: Context) -> Found:
    """The root link has an inertial.

    Why: KDL, and robot_state_publisher, MoveIt's dynamics and controllers built on it, cannot have it there
    and ignore it with a warning: the robot is lighter by that mass.

    Example: `<link name="base_link"> <inertial>…</inertial> … </link>` as the first link.

    Fix: add an empty link above it: `<link name="base_footprint"/>` and a fixed joint.

    Autofix: none.
    """
    link = context.robot.links[context.robot.root]
    if link.name in context.unsure or link.inertial is None or not link.inertial.mass > 0.0:
        return
    if not context.robot.joints:
        return
    yield Finding(
        link.inertial.origin,
        f"{link.name}: the root link has an inertial of {link.inertial.mass:g} kg, which KDL ignores "
        "with a warning",
        "put an empty link above it, joined by a fixed joint",
    )
