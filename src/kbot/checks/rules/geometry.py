"""Rules about shapes and materials."""

from __future__ import annotations

from kbot.checks.context import Context
from kbot.checks.facts.bodies import LinkShape, bounds
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.spatial import Vector, dot, norm, subtract
from kbot.model import Box, Capsule, Collision, Cylinder, Geometry, Mesh, Sphere, Visual
from kbot.text import Related, Severity
from kbot.text.suggest import did_you_mean

_DEEP = 2e-3  # m: shapes drawn a little into each other are common and harmless


@rule("G106", "no-collision", Severity.WARNING, "robot")
def no_collision(context: Context) -> Found:
    """A link that a movable joint carries, with a visual and no collision, on it or on what is fixed to it.

    Why: it is seen and touches nothing: a wheel sinks into the ground until the chassis lies on it, an arm
    reaches through the table.

    Example: `<link name="left_wheel"> <visual>…</visual> <inertial>…</inertial> </link>`

    Fix: add a `<collision>`, of a simple shape.

    Autofix: unsafe: the visual's origin and geometry are copied into a `<collision>` when they are a simple
    shape.
    """
    robot = context.robot
    if not any(link.collisions for link in robot.links.values()):
        return
    for joint in context.sure_joints:
        link = robot.links[joint.child]
        if not joint.is_movable or not link.visuals or link.name in context.unsure:
            continue
        if any(robot.links[name].collisions for name in rigid_links(robot, link.name)):
            continue
        yield Finding(
            link.origin,
            f"{link.name}: joint '{joint.name}' moves it, and it has a visual and no collision: it "
            "touches nothing",
            "add a <collision> of a simple shape",
            (Related("what is seen of it", link.visuals[0].origin),),
            fix=context.copy_visual(link.visuals[0].origin),
        )


@rule("G107", "size-not-positive", Severity.ERROR, "robot")
def size_not_positive(context: Context) -> Found:
    """A shape with a size that is zero or negative, or a mesh with a scale of zero.

    Why: physics engines refuse it or divide by it; rviz shows nothing. A negative mesh scale mirrors the
    mesh and turns its surface inside out, which is left alone here.

    Example: `<cylinder radius="0" length="0.1"/>`

    Fix: write the size in metres.

    Autofix: none.
    """
    for link in context.sure_links:
        for shape in link.shapes:
            bad = _bad_size(shape.geometry)
            if bad:
                yield Finding(shape.geometry.origin, f"{link.name}: {bad}: the shape has no volume")


def _bad_size(geometry: Geometry) -> str:
    match geometry:
        case Box(size=size) if min(size) <= 0.0:
            return "box of size " + " ".join(f"{v:g}" for v in size)
        case Sphere(radius=r) if r <= 0.0:
            return f"sphere of radius {r:g}"
        case Cylinder(radius=r, length=length) if r <= 0.0 or length <= 0.0:
            return f"cylinder of radius {r:g} and length {length:g}"
        case Capsule(radius=r, length=length) if r <= 0.0 or length < 0.0:
            return f"capsule of radius {r:g} and length {length:g}"
        case Mesh(scale=factors) if 0.0 in factors:
            return "mesh scaled by " + " ".join(f"{v:g}" for v in factors)
    return ""


@rule("G108", "undefined-material", Severity.WARNING, "robot")
def undefined_material(context: Context) -> Found:
    """A material used by name that is defined nowhere.

    Why: rviz and Gazebo paint the part in their default (red, white or grey), and urdfdom prints
    "material 'x' undefined" or refuses the visual, as its version may be.

    Example: `<material name="bleu"/>` where `blue` is defined.

    Fix: define it at the root: `<material name="blue"> <color rgba="0 0 0.8 1"/> </material>`.

    Autofix: safe, where the name is a slip of one known name: it is written.
    """
    robot = context.robot
    defined = set(robot.materials)
    defined |= {
        v.material.name
        for link in robot.links.values()
        for v in link.visuals
        if v.material and (v.material.rgba or v.material.texture)
    }
    said: set[str] = set()
    for link in context.sure_links:
        for visual in link.visuals:
            material = visual.material
            if material is None or material.rgba or material.texture or not material.name:
                continue
            if material.name not in defined and material.name not in said:
                said.add(material.name)
                yield Finding(
                    material.origin,
                    f"{link.name}: the material '{material.name}' is defined nowhere",
                    did_you_mean(material.name, defined)
                    or f'add <material name="{material.name}"> with a <color>',
                )


@rule("G112", "color-out-of-range", Severity.WARNING, "robot")
def color_out_of_range(context: Context) -> Found:
    """A colour with a number outside 0..1.

    Why: red, green, blue and alpha run from 0 to 1 in URDF. `255` is cut to 1, so that every such colour
    comes out white or one of eight; an alpha of 0 hides the part.

    Example: `<color rgba="255 128 0 1"/>`

    Fix: divide by 255: `<color rgba="1 0.5 0 1"/>`.

    Autofix: unsafe: plain numbers of 0..255 are divided by 255.
    """
    for element in context.tagged("color"):
        if "rgba" not in element.attributes:
            continue
        words = element.attributes["rgba"].split()
        try:
            values = [float(word) for word in words]
        except ValueError:
            continue
        if not values or (min(values) >= 0.0 and max(values) <= 1.0):
            continue
        origin = element.attribute_origin("rgba")
        fix = None
        if min(values) >= 0.0 and max(values) <= 255.0 and len(values) == 4:
            alpha = values[3] if values[3] <= 1.0 else values[3] / 255.0
            text = " ".join(f"{v:.4g}" for v in (*(v / 255.0 for v in values[:3]), alpha))
            fix = context.replace_plain(origin, text, "divide by 255", safe=False)
        yield Finding(
            origin,
            f"rgba {element.attributes['rgba']}: colours run from 0 to 1, what is above is cut to 1",
            "divide by 255",
            fix=fix,
        )


@rule("G109", "shapes-differ", Severity.WARNING, "robot")
def shapes_differ(context: Context) -> Found:
    """A collision that differs from what is seen by more than a fifth: the extents of the two, both plain
    shapes.

    Why: the robot is stopped by what is not seen, or goes through what is. For a wheel, the radius seen
    is not the radius it rolls on: odometry is wrong by the ratio.

    Example: visual `<cylinder radius="0.035" …/>`, collision `<cylinder radius="0.35" …/>`.

    Fix: give both the same size, best by one property.

    Autofix: none.
    """
    for link in context.sure_links:
        body = context.bodies[link.name]
        if len(link.visuals) != 1 or len(link.collisions) != 1 or not body.complete:
            continue
        if isinstance(link.visuals[0].geometry, Mesh) or isinstance(link.collisions[0].geometry, Mesh):
            continue
        if type(link.visuals[0].geometry) is not type(link.collisions[0].geometry):
            continue
        seen, touched = bounds(body.visuals), bounds(body.collisions)
        if seen is None or touched is None:
            continue
        for axis in range(3):
            a, b = seen[1][axis] - seen[0][axis], touched[1][axis] - touched[0][axis]
            if abs(a - b) > 0.2 * max(a, b) and abs(a - b) > 2e-3:
                yield Finding(
                    body.collisions[0].origin,
                    f"{link.name}: the collision measures {b * 1e3:.4g} mm along {'xyz'[axis]}, the visual "
                    f"{a * 1e3:.4g} mm ({(b / a - 1.0) * 100.0:+.0f} %)",
                    related=(Related("what is seen", body.visuals[0].origin),),
                )
                break
        else:
            apart = norm(subtract(_middle(seen), _middle(touched)))
            size = norm(subtract(seen[1], seen[0]))
            if apart > 0.2 * size and apart > 2e-3:
                yield Finding(
                    body.collisions[0].origin,
                    f"{link.name}: the collision's middle lies {apart * 1e3:.4g} mm from the visual's",
                    related=(Related("what is seen", body.visuals[0].origin),),
                )


def _middle(ends: tuple[Vector, Vector]) -> Vector:
    low, high = ends
    return ((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, (low[2] + high[2]) / 2.0)


@rule("G111", "collides-at-rest", Severity.INFO, "robot")
def collides_at_rest(context: Context) -> Found:
    """Two links of plain shapes that lie in each other with all joints at zero, joined by no joint.

    Why: simulators that check self-collision push them apart at the first step: the robot jumps, or its
    wheels rub. MoveIt calls the start state in collision.

    Example: a caster's ball that reaches into the battery box.

    Fix: move or shrink one of the collisions. Links are not compared if one joint or
    only fixed joints connect them.

    Autofix: none.
    """
    robot = context.robot
    plain = [
        (link.name, part)
        for link in context.sure_links
        for part in context.bodies[link.name].collisions
        if isinstance(part.geometry, Box | Sphere | Cylinder | Capsule)
    ]
    if len(plain) > 60:
        return
    groups = {name: _group(context, name) for name, _ in plain}
    joined = {frozenset((j.parent, j.child)) for j in robot.joints.values()}
    said: set[frozenset[str]] = set()
    for i, (name, part) in enumerate(plain):
        for other_name, other in plain[i + 1 :]:
            pair = frozenset((name, other_name))
            if groups[name] == groups[other_name] or pair in joined or pair in said:
                continue
            depth = overlap(context, name, part, other_name, other)
            if depth > _DEEP:
                said.add(pair)
                yield Finding(
                    part.origin,
                    f"{name}: it lies in '{other_name}' by {depth * 1e3:.3g} mm with all joints at zero",
                    related=(Related(f"the collision of '{other_name}'", other.origin),),
                )


def _group(context: Context, link: str) -> str:
    """The topmost link that fixed joints hold a link to."""
    robot = context.robot
    while link in robot.parent_joint and not robot.parent_joint[link].is_movable:
        link = robot.parent_joint[link].parent
    return link


def overlap(context: Context, a: str, one: LinkShape, b: str, other: LinkShape) -> float:
    """A lower bound of how deep two shapes lie in each other, along the best of a few directions, m.

    Separating axes: each shape's own three axes and the line between the centres. Where none separates
    them, boxes and spheres do touch; round bodies may be missed or a little overstated at rims.
    """
    frame_a, frame_b = context.frames[a], context.frames[b]
    away = subtract(frame_b.point(other.frame.translation), frame_a.point(one.frame.translation))
    if norm(away) >= norm(one.half) + norm(other.half):
        return 0.0
    whole_a, whole_b = frame_a.then(one.frame), frame_b.then(other.frame)
    columns = [whole.direction(e) for whole in (whole_a, whole_b) for e in _BASE]
    length = norm(away)
    if length > 1e-9:
        columns.append((away[0] / length, away[1] / length, away[2] / length))
    best = float("inf")
    for d in columns:
        reach = one.support(frame_a.local_direction(d)) + other.support(frame_b.local_direction(d))
        best = min(best, reach - abs(dot(away, d)))
        if best <= 0.0:
            return 0.0
    return best


_BASE: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def shape_name(shape: Visual | Collision) -> str:
    return "collision" if isinstance(shape, Collision) else "visual"
