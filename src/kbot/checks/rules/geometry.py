"""Rules about shapes and materials."""

from __future__ import annotations

from kbot.checks.context import Context
from kbot.checks.facts.bodies import LinkShape, bounds
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.drive.wheels import rigid_links
from kbot.kinematics.spatial import Vector, dot, norm, subtract
from kbot.model import Box, Capsule, Collision, Cylinder, Geometry, Mesh, Sphere, Visual
from kbot.text import Related, Severity
from kbot.text.suggest import Candidates, did_you_mean

_DEEP = 2e-3  # m: shapes that overlap by less are common and harmless
_MOST_SHAPES = 60
"""G111 compares every two collision shapes of a robot with at most this many: pairs grow with the square."""


@rule("G106", "no-collision", Severity.WARNING, "robot")
def no_collision(context: Context) -> Found:
    """A link on a movable joint has a visual but no collision, and no link that is fixed to it has one.

    Why: The link is visible but touches nothing. A wheel sinks into the ground until the chassis lies on it,
    and an arm passes through the table.

    Example: `<link name="left_wheel"> <visual>…</visual> <inertial>…</inertial> </link>`

    Fix: Add a `<collision>` with a simple shape.

    Autofix: unsafe: KBot copies the visual's origin and geometry into a `<collision>` if they are a simple
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
            f"{link.name}: joint '{joint.name}' moves it, but it has a visual and no collision: it "
            "touches nothing",
            "add a <collision> with a simple shape",
            (Related("its visual", link.visuals[0].origin),),
            fix=context.copy_visual(link.visuals[0].origin),
        )


@rule("G107", "size-not-positive", Severity.ERROR, "robot")
def size_not_positive(context: Context) -> Found:
    """A size of a shape is zero or negative, or a mesh has a scale of zero.

    Why: Physics engines refuse the shape or divide by its size, and rviz shows nothing. A negative mesh scale
    mirrors the mesh and turns its surface inside out. This rule does not report it.

    Example: `<cylinder radius="0" length="0.1"/>`

    Fix: Write the size in metres.

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
    """A visual uses a material that is not defined.

    Why: rviz and Gazebo draw the part in their default colour (red, white or grey). Depending on its version,
    urdfdom prints "material 'x' undefined" or refuses the visual.

    Example: `<material name="bleu"/>`, although only `blue` is defined.

    Fix: Define it at the root: `<material name="blue"> <color rgba="0 0 0.8 1"/> </material>`.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    robot = context.robot
    defined = set(robot.materials)
    defined |= {
        v.material.name
        for link in robot.links.values()
        for v in link.visuals
        if v.material and (v.material.rgba or v.material.texture)
    }
    names = Candidates(defined)
    reported: set[str] = set()
    for link in context.sure_links:
        for visual in link.visuals:
            material = visual.material
            if material is None or material.rgba or material.texture or not material.name:
                continue
            if material.name not in defined and material.name not in reported:
                reported.add(material.name)
                yield Finding(
                    material.origin,
                    f"{link.name}: the material '{material.name}' is not defined",
                    did_you_mean(material.name, names)
                    or f'add <material name="{material.name}"> with a <color>',
                )


@rule("G112", "color-out-of-range", Severity.WARNING, "robot")
def color_out_of_range(context: Context) -> Found:
    """A colour has a number outside 0..1.

    Why: In URDF red, green, blue and alpha run from 0 to 1. Values above 1 are clamped to 1. With numbers of
    0..255 a part is therefore black, white or one of six other colours. An alpha of 0 hides the part.

    Example: `<color rgba="255 128 0 1"/>`

    Fix: Divide by 255: `<color rgba="1 0.5 0 1"/>`.

    Autofix: unsafe: KBot divides plain numbers of 0..255 by 255.
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
            f"rgba {element.attributes['rgba']}: colours range from 0 to 1, larger numbers are clamped to 1",
            "divide by 255",
            fix=fix,
        )


@rule("G109", "shapes-differ", Severity.WARNING, "robot")
def shapes_differ(context: Context) -> Found:
    """A link's collision and visual are the same primitive shape, but their extents or centres differ by more
    than a fifth.

    Why: An invisible part of the collision stops the robot, or a visible part of the robot passes through
    obstacles. A wheel rolls on the collision's radius and not on the visible one, so odometry is wrong by
    their ratio.

    Example: A visual `<cylinder radius="0.035" …/>` with a collision `<cylinder radius="0.35" …/>`.

    Fix: Give both the same size, preferably from one property.

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
                    f"{link.name}: the collision is {b * 1e3:.4g} mm long along {'xyz'[axis]}, the visual "
                    f"{a * 1e3:.4g} mm ({(b / a - 1.0) * 100.0:+.0f} %)",
                    related=(Related("the visual", body.visuals[0].origin),),
                )
                break
        else:
            apart = norm(subtract(_middle(seen), _middle(touched)))
            size = norm(subtract(seen[1], seen[0]))
            if apart > 0.2 * size and apart > 2e-3:
                yield Finding(
                    body.collisions[0].origin,
                    f"{link.name}: the collision's centre is {apart * 1e3:.4g} mm from that of the visual",
                    related=(Related("the visual", body.visuals[0].origin),),
                )


def _middle(ends: tuple[Vector, Vector]) -> Vector:
    low, high = ends
    return ((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, (low[2] + high[2]) / 2.0)


@rule("G111", "collides-at-rest", Severity.INFO, "robot")
def collides_at_rest(context: Context) -> Found:
    """The primitive collision shapes of two links overlap when all joints are at zero, and no joint connects
    the links.

    Why: Simulators that check self-collision push the links apart in the first step. The robot jumps, or its
    wheels rub. MoveIt reports that the start state is in collision.

    Example: The ball of a caster that reaches into the battery box.

    Fix: Move or shrink one of the collisions. KBot does not compare links that are connected by one joint or
    only by fixed joints.

    Autofix: none.
    """
    robot = context.robot
    plain = [
        (link.name, part)
        for link in context.sure_links
        for part in context.bodies[link.name].collisions
        if isinstance(part.geometry, Box | Sphere | Cylinder | Capsule)
    ]
    if len(plain) > _MOST_SHAPES:
        return
    groups = {name: _group(context, name) for name, _ in plain}
    joined = {frozenset((j.parent, j.child)) for j in robot.joints.values()}
    reported: set[frozenset[str]] = set()
    for i, (name, part) in enumerate(plain):
        for other_name, other in plain[i + 1 :]:
            pair = frozenset((name, other_name))
            if groups[name] == groups[other_name] or pair in joined or pair in reported:
                continue
            depth = overlap(context, name, part, other_name, other)
            if depth > _DEEP:
                reported.add(pair)
                yield Finding(
                    part.origin,
                    f"{name}: it overlaps '{other_name}' by {depth * 1e3:.3g} mm with all joints at zero",
                    related=(Related(f"the collision of '{other_name}'", other.origin),),
                )


def _group(context: Context, link: str) -> str:
    """The topmost link to which fixed joints connect a link."""
    robot = context.robot
    while link in robot.parent_joint and not robot.parent_joint[link].is_movable:
        link = robot.parent_joint[link].parent
    return link


def overlap(context: Context, a: str, shape_a: LinkShape, b: str, shape_b: LinkShape) -> float:
    """The depth in m to which two shapes overlap, estimated from a few directions; 0 if they do not overlap.

    It is the smallest overlap along the three axes of each shape and the line between the centres. Shapes
    that only another direction separates are taken to overlap.
    """
    frame_a, frame_b = context.frames[a], context.frames[b]
    away = subtract(frame_b.point(shape_b.frame.translation), frame_a.point(shape_a.frame.translation))
    if norm(away) >= norm(shape_a.half) + norm(shape_b.half):
        return 0.0
    whole_a, whole_b = frame_a.then(shape_a.frame), frame_b.then(shape_b.frame)
    columns = [whole.direction(e) for whole in (whole_a, whole_b) for e in _BASE]
    length = norm(away)
    if length > 1e-9:
        columns.append((away[0] / length, away[1] / length, away[2] / length))
    best = float("inf")
    for d in columns:
        reach = shape_a.support(frame_a.local_direction(d)) + shape_b.support(frame_b.local_direction(d))
        best = min(best, reach - abs(dot(away, d)))
        if best <= 0.0:
            return 0.0
    return best


_BASE: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def shape_name(shape: Visual | Collision) -> str:
    return "collision" if isinstance(shape, Collision) else "visual"
