"""Rules about masses and inertia tensors that no rigid body can have, whatever its shape."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.inertia_fixes import remove_inertial, solid_fix, solid_hint
from kbot.kinematics.spatial import Vector, eigenvalues
from kbot.model import Inertial, Joint, Link, Mesh, RobotModel
from kbot.text import Related, Severity

_RATIO = 1000.0
_MARKER = 1e-7
"""m^3: a shape smaller than a cube of 5 mm marks a frame."""
_LIGHTEST = 0.02
"""kg. A lighter part is not reported, however heavy the robot is that carries it."""


def weights_below(context: Context, only_fixed: bool = True) -> dict[str, float]:
    """Mass in kg of each link and those that fixed joints connect below it, or of it and all links below
    it."""
    robot = context.robot
    masses: dict[str, float] = {}
    for link in reversed(_downwards(robot)):
        hanging = sum(masses[j.child] for j in robot.child_joints[link] if not (only_fixed and j.is_movable))
        masses[link] = _own_mass(context, link) + hanging
    return masses


def _downwards(robot: RobotModel) -> list[str]:
    """The links, parents before children."""
    links = [robot.root]
    for link in links:
        links += [j.child for j in robot.child_joints[link]]
    return links


def _own_mass(context: Context, link: str) -> float:
    inertial = context.robot.links[link].inertial
    return inertial.mass if inertial and math.isfinite(inertial.mass) else 0.0


def is_frame(context: Context, link: Link) -> bool:
    """Whether a link only marks a frame: a fixed joint connects it to a neighbour, and it has at most a tiny
    visual. Such a link needs no mass."""
    robot, solid = context.robot, context.bodies[link.name].solid
    if link.collisions or any(solid is None or solid.volume > _MARKER for _ in link.visuals):
        return False
    parent = robot.parent_joint.get(link.name)
    joints = (*robot.child_joints[link.name], *([parent] if parent else []))
    return any(not joint.is_movable for joint in joints)


@rule("I116", "mass-ratio", Severity.WARNING, "robot")
def mass_ratio(context: Context) -> Found:
    """The masses on the two sides of a movable joint differ by a factor of more than 1000.

    Why: The contact and joint solvers of Gazebo, Bullet and MuJoCo then converge slowly. The joint stretches,
    the light body jitters, and a heavy load on a light link bounces as if on a spring.

    Example: An arm of 2000 kg on a turntable of 1 kg.

    Fix: Check the units, and give the light link its real mass.

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
        elif above / below > _RATIO and below > _LIGHTEST:
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
        f"{joint.name}: {heavy:.4g} kg at '{heavy_link}' and {light:.4g} kg at '{light_link}', a ratio of "
        f"{heavy / light:.0f}: the joint will be soft and jitter",
        "check the units of the masses",
        related,
    )


def _tops(robot: RobotModel) -> dict[str, str]:
    """For each link the topmost link of its rigid body, which fixed joints connect."""
    tops: dict[str, str] = {}
    for link in _downwards(robot):
        joint = robot.parent_joint.get(link)
        tops[link] = link if joint is None or joint.is_movable else tops[joint.parent]
    return tops


def links_with_inertial(context: Context) -> Iterator[tuple[Link, Inertial]]:
    """Links that have an inertial and that no error touches."""
    for link in context.sure_links:
        if link.inertial is not None:
            yield link, link.inertial


def is_finite(inertial: Inertial) -> bool:
    i = inertial
    return all(map(math.isfinite, (i.mass, i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz, *i.pose.xyz)))


def is_valid(inertial: Inertial) -> bool:
    """Whether the mass is finite and positive, and the tensor positive definite."""
    return is_finite(inertial) and inertial.mass > 0.0 and eigenvalues(inertial.tensor)[0] > 0.0


def breaks_triangle(moments: Vector) -> bool:
    """Whether the largest of three principal moments is more than the other two together.

    1 % more is allowed: for a flat plate they are equal, and the numbers of a file are rounded.
    """
    low, middle, high = sorted(moments)
    return low > 1e-9 * high and high > (low + middle) * 1.01


@rule("I102", "mass-not-positive", Severity.ERROR, "robot")
def mass_not_positive(context: Context) -> Found:
    """The mass of a link is negative, or a movable link has a mass of zero.

    Why: A force on such a link causes an infinite acceleration, or one in the opposite direction. Gazebo
    silently drops the link, MuJoCo refuses the robot, and Bullet welds the link to the world.

    Example: `<mass value="0"/>`

    Fix: Set the part's real mass. A massless frame on a fixed joint needs no `<inertial>`.

    Autofix: none.
    """
    for link, inertial in links_with_inertial(context):
        if not math.isfinite(inertial.mass) or inertial.mass > 0.0:
            continue
        joint = context.robot.parent_joint.get(link.name)
        if inertial.mass == 0.0 and (joint is None or not joint.is_movable):
            continue
        yield Finding(
            inertial.mass_origin,
            f"{link.name}: the mass is {inertial.mass:g} kg: no simulator can accelerate it correctly",
            "set the part's real mass, or remove <inertial> from a massless frame on a fixed joint",
        )


@rule("I103", "zero-tensor", Severity.WARNING, "robot")
def zero_tensor(context: Context) -> Found:
    """All moments of a movable link are zero, although the link has a mass.

    Why: The link has no resistance to turning, and a motor spins it up infinitely fast. MuJoCo refuses the
    robot. ODE and Bullet become unstable at the first contact.

    Example: `<mass value="1"/> <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>`

    Fix: Use the tensor of a solid of the link's shape.

    Autofix: unsafe: KBot writes the tensor of a solid of the link's shape, as numbers or as a call of a macro
    that computes it.
    """
    for link, inertial in links_with_inertial(context):
        joint = context.robot.parent_joint.get(link.name)
        if joint is None or not joint.is_movable or not is_finite(inertial) or not inertial.mass > 0.0:
            continue
        if all(v == 0.0 for row in inertial.tensor for v in row):
            yield Finding(
                inertial.inertia_origin,
                f"{link.name}: {inertial.mass:g} kg with a tensor of zeros: it has no resistance to turning",
                solid_hint(context, link, inertial),
                fix=solid_fix(context, link, inertial),
            )


@rule("I104", "not-positive-definite", Severity.WARNING, "robot")
def not_positive_definite(context: Context) -> Found:
    """The inertia tensor is not positive definite: a principal moment is zero or negative.

    Why: A torque about that axis turns the link the wrong way, or infinitely fast, and its kinetic energy can
    be negative. MuJoCo and gz-sim refuse the robot, and other engines become unstable. `kbot sim` replaces
    the tensor by the nearest possible one and warns (W104), as for I105.

    Example: `ixx="0.001" iyy="0.001" izz="-0.001"`, or products of inertia that are larger than the moments.

    Fix: Take the tensor about the centre of mass from the part's CAD model, or use that of a solid of its
    shape.

    Autofix: unsafe: KBot writes the tensor of a solid of the link's shape, as numbers or as a call of a macro
    that computes it.
    """
    for link, inertial in links_with_inertial(context):
        if not is_finite(inertial) or not inertial.mass > 0.0:
            continue
        tensor = inertial.tensor
        low, _, high = eigenvalues(tensor)
        # a smaller share of the largest moment is zero but for rounding; a tensor of zeros is I103
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
    """One principal moment is larger than the other two together.

    Why: No distribution of mass has such moments. Each moment is the sum of mass times squared distance from
    an axis, so none can exceed the sum of the other two. MuJoCo refuses the robot, and in other engines the
    link tumbles in a physically impossible way. KBot does not report I107, I108 and I111 for the same moment.

    Example: `ixx="0.001" iyy="0.001" izz="0.01"`

    Fix: Take the tensor about the centre of mass from the part's CAD model, or use that of a solid of its
    shape.

    Autofix: unsafe: KBot writes the tensor of a solid of the link's shape, as numbers or as a call of a macro
    that computes it.
    """
    for link, inertial in links_with_inertial(context):
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
    """A link on a movable joint has no `<inertial>`, and no link that is fixed to it has one.

    Why: Gazebo and gz silently drop the link, its joint and all links below it. MuJoCo refuses a moving
    body without mass. rviz shows nothing unusual.

    Example: `<link name="left_wheel"> <visual>…</visual> <collision>…</collision> </link>`

    Fix: Add `<inertial>` with the mass, and the tensor of a solid of the link's shape.

    Autofix: none. Only the author knows the mass.
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
            f"{link.name}: {joint.type} joint '{joint.name}' moves it, but it has no <inertial>: "
            "simulators drop it and all links below it",
            "add <inertial> with a mass and a tensor",
            (Related(f"the joint '{joint.name}'", joint.origin),),
        )


@rule("I114", "placeholder-tensor", Severity.WARNING, "robot")
def placeholder_tensor(context: Context) -> Found:
    """Three or more links have the same inertia tensor, although their shapes or masses differ.

    Why: The tensor is a placeholder that was copied. Links of 1 cm and of 1 m then resist turning equally.
    The small ones hardly turn, and the large ones turn too easily.

    Example: `<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>` on every link.

    Fix: Give each link the tensor of its own shape.

    Autofix: none.
    """
    groups: dict[tuple[float, ...], list[tuple[Link, Inertial]]] = defaultdict(list)
    for link, inertial in links_with_inertial(context):
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
    """A key that differs for links of different size: extents to a millimetre, or the names of meshes."""
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
    """The root link has an `<inertial>`.

    Why: KDL does not support an inertia on the root link and ignores it with a warning. Programs that use
    KDL, such as robot_state_publisher and some controllers, then ignore the mass of the root link.

    Example: `<link name="base_link"> <inertial>…</inertial> … </link>` as the first link.

    Fix: Add an empty link above it: `<link name="base_footprint"/>` and a fixed joint. If the root is such a
    frame, remove its inertial.

    Autofix: unsafe: KBot removes it if the root is a frame and a link with a mass is fixed to it.
    """
    link = context.robot.links[context.robot.root]
    if link.name in context.unsure or link.inertial is None or not link.inertial.mass > 0.0:
        return
    if not context.robot.joints:
        return
    fixed = (j.child for j in context.robot.child_joints[link.name] if not j.is_movable)
    heavy = (child for child in fixed if _own_mass(context, child) > 0.0)
    carried = next(heavy, "") if is_frame(context, link) else ""
    yield Finding(
        link.inertial.origin,
        f"{link.name}: the root link has an inertial of {link.inertial.mass:g} kg, which KDL ignores "
        "with a warning",
        f"remove it: the mass is in '{carried}', which is fixed to this link"
        if carried
        else "put an empty link above it, joined by a fixed joint",
        fix=remove_inertial(context, link.inertial) if carried else None,
    )
