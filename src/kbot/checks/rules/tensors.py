"""Rules that compare a link's inertial with the link's shape."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.checks.context import Context
from kbot.checks.facts.bodies import LinkBody, LinkShape, Solid, axis_of, link_tensor
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.inertia import breaks_triangle, is_finite, is_valid, links_with_inertial
from kbot.checks.rules.inertia_fixes import exchanging_fix, turning_fix
from kbot.kinematics.spatial import (
    Matrix,
    SpatialFrame,
    Vector,
    dot,
    eigenvalues,
    norm,
    rotate,
    rotation,
    subtract,
    tensor_in,
    transpose,
)
from kbot.model import Collision, Inertial, Link, Sphere, Visual
from kbot.text import Related, Severity

_SMALL = 1e-3  # m: smaller bodies are markers and not parts
_AXES = "xyz"


def geometry_of(body: LinkBody, name: str = "") -> tuple[Related, ...]:
    parts = body.collisions or body.visuals
    what = f"the shape of '{name}'" if name else "the shape it is compared with"
    return (Related(what, parts[0].origin),) if parts else ()


@rule("I110", "mass-outside-shape", Severity.INFO, "robot")
def mass_outside_shape(context: Context) -> Found:
    """The centre of mass is outside the box around the link's own shapes.

    Why: This can be intended, for example if the shapes leave out a heavy part. Usually it is a wrong sign,
    unit or frame, and the link swings about a point in the air.

    Example: `<inertial> <origin xyz="0 0 0.5"/> …` on a box 0.1 m high.

    Fix: Give the centre of mass in the link's own frame.

    Autofix: none.
    """
    for link, inertial in links_with_inertial(context):
        if not is_finite(inertial) or not inertial.mass > 0.0 or _elsewhere(context, link, inertial):
            continue
        away = _outside(context.bodies[link.name], inertial.pose.xyz)
        if away > _SMALL:
            origin = inertial.pose.origin or inertial.origin
            yield Finding(
                origin,
                f"{link.name}: the centre of mass is {away * 1e3:.4g} mm outside the box around its shapes",
                related=geometry_of(context.bodies[link.name]),
            )


def _outside(body: LinkBody, point: Vector) -> float:
    """Distance in m by which a point of the link's frame is outside the box around its shapes; 0 inside.

    The box is grown by 5 % of its longest side.
    """
    bounds = body.ends
    if bounds is None or not body.complete:
        return 0.0
    low, high = bounds
    margin = 0.05 * max(end - start for start, end in zip(low, high, strict=True))
    return norm(
        (
            max(low[0] - margin - point[0], point[0] - high[0] - margin, 0.0),
            max(low[1] - margin - point[1], point[1] - high[1] - margin, 0.0),
            max(low[2] - margin - point[2], point[2] - high[2] - margin, 0.0),
        )
    )


def _elsewhere(context: Context, link: Link, inertial: Inertial) -> str:
    """The link in whose frame the centre of mass would be inside the shape; empty if there is none or if the
    centre of mass is inside anyway."""
    body = context.bodies[link.name]
    bounds = body.ends
    joint = context.robot.parent_joint.get(link.name)
    if bounds is None or joint is None or _outside(body, inertial.pose.xyz) <= _SMALL:
        return ""
    middle = tuple((start + end) / 2.0 for start, end in zip(*bounds, strict=True))
    size = norm(subtract(bounds[1], bounds[0]))
    own = SpatialFrame.of(joint.pose)
    for name, frame in ((joint.parent, own), (context.robot.root, context.frames[link.name])):
        local = frame.local(inertial.pose.xyz)
        away = norm(subtract(local, (middle[0], middle[1], middle[2])))
        if norm(frame.translation) > 0.25 * size and _outside(body, local) == 0.0 and away < 0.25 * size:
            return name
    return ""


@rule("I113", "mass-in-other-frame", Severity.WARNING, "robot")
def mass_in_other_frame(context: Context) -> Found:
    """The centre of mass is given in the frame of another link.

    Why: The `<origin>` of an inertial is in the link's own frame. If it is given in the parent's
    frame, it is off by the joint's offset, and the robot leans in the direction of the offset.

    Example: A wheel whose joint is at `0 0.2 0`, with `<inertial> <origin xyz="0 0.2 0"/>`.

    Fix: Subtract the joint's origin. For a symmetric part the result is `xyz="0 0 0"`.

    Autofix: none.
    """
    for link, inertial in links_with_inertial(context):
        if not is_finite(inertial) or not inertial.mass > 0.0:
            continue
        other = _elsewhere(context, link, inertial)
        if other:
            away = norm(inertial.pose.xyz) * 1e3
            joint = context.robot.parent_joint[link.name]
            yield Finding(
                inertial.pose.origin or inertial.origin,
                f"{link.name}: the centre of mass is {away:.4g} mm from the link's frame, outside its shape; "
                f"in the frame of '{other}' it would be inside",
                "give the origin of an inertial in the link's own frame",
                (Related(f"the joint '{joint.name}'", joint.origin), *geometry_of(context.bodies[link.name])),
            )


@rule("I111", "tensor-not-turned", Severity.WARNING, "robot")
def tensor_not_turned(context: Context) -> Found:
    """The inertia tensor of a cylinder is not aligned with the cylinder, because the inertial frame was not
    rotated together with the geometry.

    Why: A wheel's cylinder is rotated by `rpy="${pi/2} 0 0"` to lie along y, but its tensor is that of a
    cylinder along z. A thin disc then has half its moment about the axle, and it wobbles when the robot
    turns.

    Example: `<inertial> <mass …/> <inertia …/> </inertial>` beside
    `<visual> <origin rpy="1.5708 0 0"/> <geometry> <cylinder …/>`.

    Fix: Give the inertial the origin of the geometry: `<origin xyz="0 0 0" rpy="1.5708 0 0"/>`.

    Autofix: unsafe: KBot writes these angles into the inertial, or into the call of its macro.
    """
    for link, inertial in links_with_inertial(context):
        about = about_axle(context, link, inertial)
        if about is None:
            continue
        if about.breaks_triangle_across and context.reports("I105", inertial.inertia_origin):
            continue
        rpy = part_rpy(context, link) if about.is_cylinders else ""
        if about.is_cylinders:
            what = "the inertial frame is not rotated together with the geometry"
        else:
            low, high = about.across
            what = f"the moments across it, {low:.4g} and {high:.4g}, should be equal for a round body"
        yield Finding(
            inertial.inertia_origin,
            f"{link.name}: the moment of inertia about its {about.name} is {about.along:.4g} kg m^2, "
            f"but that of its cylinder is {about.due:.4g} "
            f"({(about.along / about.due - 1.0) * 100.0:+.0f} %): {what}",
            f'give the inertial the origin of its geometry: rpy="{rpy}"' if rpy else "",
            geometry_of(context.bodies[link.name]),
            fix=turning_fix(context, link, inertial) if rpy else None,
        )


@dataclass(frozen=True, slots=True)
class AboutAxle:
    """A tensor whose moments across the axis of its round body are unequal; moments in kg m^2.

    name          of the axis in messages
    along         the moment about the axis
    across        the moments across the axis
    due           the moment that the body has about its axis
    is_cylinders  whether the moments are those of the cylinder, but about another axis
    """

    name: str
    along: float
    across: tuple[float, float]
    due: float
    is_cylinders: bool

    @property
    def breaks_triangle_across(self) -> bool:
        """Whether the smaller moment across the axis alone makes the three impossible, which I105 reports.

        With the larger moment in its place a round body could have them.
        """
        low, high = sorted(self.across)
        return (
            not self.is_cylinders
            and breaks_triangle((low, high, self.along))
            and not breaks_triangle((high, high, self.along))
        )


def about_axle(context: Context, link: Link, inertial: Inertial) -> AboutAxle | None:
    """A link's tensor about the axis of its only round shape; None if the moments across the axis are equal,
    or the link has no such shape."""
    body = context.bodies[link.name]
    part = _only_round(body)
    axis = axis_of(part) if part else None
    if part is None or axis is None or body.solid is None or not is_valid(inertial):
        return None
    tensor = link_tensor(inertial)
    along = dot(axis, rotate(tensor, axis))
    low, middle, high = eigenvalues(tensor)
    across = _moments_across(tensor, axis, along)
    if max(across) - min(across) <= 0.1 * max(across):
        return None
    base = context.mobile_base
    wheel = base is not None and any(link.name == w.link for w in base.wheels)
    # the tensor of the cylinder's formula, but about another axis than the cylinder's
    fits = all(
        abs(a - b * inertial.mass) < 0.05 * high
        for a, b in zip((low, middle, high), sorted(part.solid_diagonal()), strict=True)
    )
    own_axis = fits and min(abs(middle - low), abs(high - middle)) < 0.01 * high
    if not (own_axis or wheel):
        return None
    moved = link.name in context.robot.parent_joint and context.robot.parent_joint[link.name].is_movable
    name = "axle" if wheel or moved else "cylinder's axis"
    return AboutAxle(name, along, across, inertial.mass * part.solid_diagonal()[2], own_axis)


def part_rpy(context: Context, link: Link) -> str:
    """The roll, pitch, yaw of the link's first shape as text; empty if they are zero."""
    shapes: tuple[Collision | Visual, ...] = (*link.collisions, *link.visuals)
    shape = shapes[0]
    return " ".join(f"{v:.10g}" for v in shape.pose.rpy) if any(shape.pose.rpy) else ""


def _only_round(body: LinkBody) -> LinkShape | None:
    """The link's only shape, in which its mass is taken to be; None if it has several."""
    parts = body.collisions or body.visuals
    if len(parts) == 1 and isinstance(parts[0].geometry, Sphere) and len(body.visuals) == 1:
        parts = body.visuals  # a ball is often the collision of a visible cylindrical wheel
    return parts[0] if len(parts) == 1 else None


def _moments_across(tensor: Matrix, axis: Vector, along: float) -> tuple[float, float]:
    """Principal moments of the tensor in the plane across an axis."""
    low, middle, high = eigenvalues(tensor)
    # leave out the moment about the axis; this is exact if the axis is a principal axis
    rest = sorted((low, middle, high), key=lambda v: abs(v - along))[1:]
    skew = norm(subtract(rotate(tensor, axis), (axis[0] * along, axis[1] * along, axis[2] * along)))
    return (rest[0], rest[1]) if skew < 0.02 * high else (low, high)


@rule("I112", "moments-swapped", Severity.WARNING, "robot")
def moments_swapped(context: Context) -> Found:
    """Two principal moments of a link are swapped: a solid of its shape has them the other way round.

    Why: A flat plate then turns about its upright axis as easily as about its edge. Yaw starts and stops too
    fast, and pitch changes too slowly.

    Example: `box_inertia` called with height and depth swapped: izz is 0.0214, but a plate of 16 x 16 x 1
    cm and 10 kg has 0.0427 kg m^2.

    Fix: Pass the sizes in the order that the macro expects.

    Autofix: unsafe: KBot swaps two moments that are plain numbers, or two sizes in the call of the macro
    that computes them.
    """
    for link, inertial in links_with_inertial(context):
        body = context.bodies[link.name]
        solid = body.solid
        if solid is None or not is_valid(inertial) or (len(solid.parts) == 1 and axis_of(solid.parts[0])):
            continue
        found = _swap(inertial, solid)
        if found is None:
            continue
        own, due, (a, b) = found
        yield Finding(
            inertial.inertia_origin,
            f"{link.name}: i{_AXES[a] * 2} {own[a]:.4g} and i{_AXES[b] * 2} {own[b]:.4g} kg m^2 are "
            f"swapped: a solid of its shape has i{_AXES[a] * 2} {due[a]:.4g} and "
            f"i{_AXES[b] * 2} {due[b]:.4g}",
            "pass the sizes in the order that the formula expects",
            geometry_of(body),
            fix=exchanging_fix(context, inertial, a, b),
        )


def _swap(inertial: Inertial, solid: Solid) -> tuple[Vector, Vector, tuple[int, int]] | None:
    """The moments as given and as they should be, and the two axes that are swapped; None if none are."""
    turn = transpose(rotation(inertial.pose.rpy))
    unit_tensor = tensor_in(turn, solid.unit_tensor)
    due = (
        unit_tensor[0][0] * inertial.mass,
        unit_tensor[1][1] * inertial.mass,
        unit_tensor[2][2] * inertial.mass,
    )
    own = (inertial.ixx, inertial.iyy, inertial.izz)
    if _agree(own, due, 0.04):
        return None
    for a, b in ((1, 2), (0, 2), (0, 1)):
        swapped = list(own)
        swapped[a], swapped[b] = own[b], own[a]
        if _agree((swapped[0], swapped[1], swapped[2]), due, 0.02):
            return own, due, (a, b)
    return None


def _agree(own: Vector, due: Vector, tolerance: float) -> bool:
    return all(abs(x - y) <= tolerance * max(due) for x, y in zip(own, due, strict=True))
