"""Finds the wheels of a robot, their pairs, and its casters, from its joints and shapes.

`find_drive` uses the wheels without a flaw. `kbot check` uses all wheels that are meant to drive, also fixed
or misaligned wheels and those that are smaller than their partner. A wheel is meant to drive if a controller
names it, if its name suggests it, or by its shape and position."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.kinematics.drive.part_names import CASTER, WHEEL, mirrored_name, side_of
from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.transform import Transform
from kbot.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Joint,
    JointType,
    Link,
    Mesh,
    Pose,
    RobotModel,
    Sphere,
    Visual,
)
from kbot.model.shapes import bounds, span_along, vertices
from kbot.text import KbotError

Array = NDArray[np.float64]

MOST_JOINTS = 1_000
"""`kbot check` looks for wheels in robots with at most this many joints, because it compares every two wheels
and follows each up to the root. A robot with more joints gets the finding K003."""
EQUAL = 0.1
"""Share of a wheel's radius by which two wheels of a pair may differ in size, and be apart in x and z."""
LEVEL = 0.01
"""Metres by which the links may differ in height on which a base stands: wheels on springs, and casters."""
_PARALLEL = math.cos(math.radians(5.0))
"""Cosine of the angle by which a cylinder may be off its axis."""
_ROUND = 0.03
"""Share of its radius by which the outline of a round mesh may differ between directions."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Wheel(Brief):
    """The wheel on a joint.

    center  (3,) in m in the frame of the base, for `kbot check` in that of the root
    axis    unit axis (3,) of the joint in the same frame
    radius  in m, 0 without a known round shape
    width   in m, 0 without a known round shape
    shape   the shape that gives the radius
    flaw    why the wheel cannot drive, empty if it can
    """

    joint: Joint
    center: Array
    axis: Array
    radius: float = 0.0
    width: float = 0.0
    shape: Geometry | None = None
    flaw: str = "it has no shape"

    @property
    def link(self) -> str:
        return self.joint.child

    @property
    def bottom(self) -> float:
        """Height of the lowest point, m."""
        return float(self.center[2]) - self.radius

    def _shown(self) -> Iterator[str]:
        yield f"joint={self.joint.name!r}"
        yield f"radius={self.radius:g}"
        yield f"width={self.width:g}"


@dataclass(frozen=True, slots=True)
class Pair:
    """Two wheels on opposite sides."""

    left: Wheel
    right: Wheel

    @property
    def wheels(self) -> tuple[Wheel, Wheel]:
        return self.left, self.right

    @property
    def separation(self) -> float:
        """Distance between the wheels' middles along y, m."""
        return abs(float(self.left.center[1] - self.right.center[1]))

    @property
    def is_level(self) -> bool:
        """Whether the wheels are on opposite sides along y."""
        x, y, z = abs(self.left.center - self.right.center).tolist()
        return bool(y > max(x, z))

    @property
    def names(self) -> frozenset[str]:
        """The names of the wheels' joints and links."""
        return frozenset(name for wheel in self.wheels for name in (wheel.joint.name, wheel.link))


@dataclass(frozen=True, slots=True, eq=False)
class Caster:
    """A link that carries the robot without driving it, with its lowest shape.

    bottom         height of the lowest point in m
    center         middle of the shape (3,) in m
    touches        False without a known collision shape
    is_off_ground  True for a link that is a caster only by its name
    """

    link: str
    shape: Geometry
    bottom: float
    center: Array
    touches: bool
    is_off_ground: bool


@dataclass(frozen=True, slots=True)
class MobileBase:
    """The wheels that are meant to drive, in pairs front to rear, the casters, and the height of the ground
    in m, all in the root's frame."""

    pairs: tuple[Pair, ...]
    casters: tuple[Caster, ...]
    ground: float | None

    @property
    def wheels(self) -> tuple[Wheel, ...]:
        return tuple(wheel for pair in self.pairs for wheel in pair.wheels)


def rigid_links(robot: RobotModel, link: str) -> Iterator[str]:
    """`link` and the links below it that only fixed joints connect."""
    waiting = [link]
    while waiting:
        name = waiting.pop()
        yield name
        waiting.extend(j.child for j in robot.child_joints[name] if j.type is JointType.FIXED)


def movable_above(robot: RobotModel, link: str) -> Joint | None:
    """The nearest joint above a link that has a position; None if the link is rigidly connected to the root
    or to a floating body."""
    while link != robot.root:
        above = robot.parent_joint[link]
        if above.is_movable:
            return above if above.has_position else None
        link = above.parent
    return None


def carrier(robot: RobotModel, link: str) -> str:
    """The topmost link of the vehicle that `link` belongs to: the root, or a floating body."""
    while link != robot.root:
        above = robot.parent_joint[link]
        if above.is_movable and not above.has_position:
            return link
        link = above.parent
    return link


def find_wheel(tree: FrameTree, joint: Joint, base: str) -> Wheel:
    """The wheel on a joint. Its size is that of the largest shape that is round about the axle, or else of
    the largest round shape."""
    robot = tree.robot
    base_from_wheel = tree.pose(joint.child, in_frame=base)
    axis = base_from_wheel.rotation @ unit_axis(joint)
    best, first_flaw = Wheel(joint, base_from_wheel.translation, axis), ""
    for link in rigid_links(robot, joint.child):
        base_from_link = tree.pose(link, in_frame=base)
        for pose, shape in _shapes(robot.links[link]):
            base_from_shape = base_from_link @ Transform.of(pose)
            radius, width, middle, flaw = _round_about(shape, base_from_shape.rotation.T @ axis)
            center = base_from_shape.apply(middle)
            away = center - base_from_wheel.translation
            off_axle = float(np.linalg.norm(away - axis * (away @ axis)))
            if not flaw and off_axle > 0.05 * radius:
                flaw = "its shape is not centred on its axis"
            first_flaw = first_flaw or flaw
            if (not flaw, radius) > (not best.flaw, best.radius):
                best = Wheel(joint, center, axis, radius, width, shape, flaw)
    flaw = (best.flaw and first_flaw) or best.flaw
    if abs(axis[2]) > 0.2:
        flaw = "its axis is not horizontal"
    elif flaw and joint.axis_origin is None:
        flaw += ", which is x because it has no <axis>" if flaw.endswith(" axis") else ""
    return replace(best, flaw=flaw) if flaw != best.flaw else best


def meant_wheels(tree: FrameTree, named: Collection[str]) -> list[Wheel]:
    """The wheels that are meant to drive, in the root's frame.

    These are the wheels on joints that a controller names, wheels that are named so, and cylinders and
    spheres on level continuous joints."""
    robot, found = tree.robot, []
    for joint in robot.joints.values():
        is_named, turns = joint.name in named, joint.type is JointType.CONTINUOUS
        is_called = bool(WHEEL.search(joint.name) or WHEEL.search(joint.child))
        if not (is_named or ((is_called or turns) and not is_caster(joint))):
            continue
        above = movable_above(robot, joint.parent)
        if above is not None and above.type is not JointType.PRISMATIC:
            continue  # its axle turns, as with a car's steering or a caster's swivel
        wheel = find_wheel(tree, joint, robot.root)
        upright = abs(wheel.axis[2])
        steers = joint.type is JointType.REVOLUTE and upright > 0.7
        suspends = joint.type is JointType.PRISMATIC and not is_named and upright > 0.5
        if steers or suspends:
            continue
        if is_called:
            has_shape = any(_shapes(robot.links[link]) for link in rigid_links(robot, joint.child))
            is_meant = wheel.radius > 0.0 or (turns and has_shape)
        else:
            is_meant = upright <= 0.5 and isinstance(wheel.shape, Cylinder | Sphere)
        if is_named or is_meant:
            found.append(wheel)
    return found


def is_caster(joint: Joint) -> bool:
    """Whether a joint or its child has the name of a caster."""
    return bool(CASTER.search(joint.child) or CASTER.search(joint.name))


def _shapes(link: Link) -> list[tuple[Pose, Geometry]]:
    """The shapes with which a link touches the ground: plain collisions, or else plain visuals, or else
    all."""
    collisions: list[tuple[Pose, Geometry]] = [(c.pose, c.geometry) for c in link.collisions]
    visuals: list[tuple[Pose, Geometry]] = [(v.pose, v.geometry) for v in link.visuals]
    for shapes in (collisions, visuals):
        plain = [item for item in shapes if isinstance(item[1], Cylinder | Sphere | Capsule)]
        if plain:
            return plain
    return collisions or visuals


def _round_about(shape: Geometry, axis: Array) -> tuple[float, float, Array, str]:
    """Radius, width and middle (3,) of a round shape, and why it is not round about `axis`.

    The radius is 0 for a shape that is not round. `axis` (3,) and the middle are in the shape's frame.
    """
    match shape:
        case Sphere(radius=radius) if radius > 0.0:
            return radius, 2.0 * radius, np.zeros(3), ""
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length) if radius > 0.0:
            name, ends = ("capsule", 2.0 * radius) if isinstance(shape, Capsule) else ("cylinder", 0.0)
            flaw = f"its {name} does not lie along its axis" if abs(axis[2]) < _PARALLEL else ""
            return radius, length + ends, np.zeros(3), flaw
        case Mesh(path=None):
            flaw = f"its size is unknown, because its mesh is not found: {shape.uri}"
        case Mesh():
            try:
                return _round_mesh(shape, axis)
            except KbotError as error:
                flaw = str(error)
        case _:
            flaw = "its shape is not round"
    return 0.0, 0.0, np.zeros(3), flaw


def _round_mesh(mesh: Mesh, axis: Array) -> tuple[float, float, Array, str]:
    """As `_round_about`, from the mesh's outline about `axis`, or else about one of the mesh's own axes."""
    points, flaw = vertices(mesh), ""
    for about in (axis, *np.eye(3)):
        across = np.cross(about, np.eye(3)[int(np.argmin(np.abs(about)))])
        across /= np.linalg.norm(across) or 1.0  # zero for an axis that was written as zero
        up = np.cross(about, across)
        directions = (about, across, up, (across + up) / math.sqrt(2))
        (low, high), *outline = [(float(p.min()), float(p.max())) for d in directions for p in [points @ d]]
        diameters = [b - a for a, b in outline]
        radius = max(diameters) / 2.0
        if radius > 0.0 and max(diameters) - min(diameters) <= _ROUND * 2.0 * radius:
            middle = about * (low + high) / 2.0
            for direction, (a, b) in zip((across, up), outline[:2], strict=True):
                middle = middle + direction * (a + b) / 2.0
            return radius, high - low, middle, flaw
        flaw = "its mesh is not round"
    return 0.0, 0.0, np.zeros(3), flaw


def pairs_of(wheels: Sequence[Wheel], sides: Mapping[str, str] | None = None) -> list[Pair]:
    """Pairs of wheels of equal size on opposite sides, front to rear, left and right by their position.

    `sides` is the side ("left", "right" or "") of each joint that a controller names. If it is given, names
    pair wheels first and decide which is left and right, because the position or size of a wheel may be
    wrong."""
    pairs = [] if sides is None else _pairs_by_names(wheels, sides)
    paired = {wheel for pair in pairs for wheel in pair.wheels}
    left_over = [wheel for wheel in wheels if wheel not in paired]
    while left_over:
        first = left_over.pop(0)
        partner = next((w for w in left_over if _is_pair(first, w)), None)
        if partner is not None:
            left_over.remove(partner)
            is_left = (first.center - partner.center) @ leftward(first) >= 0.0
            pairs.append(Pair(first, partner) if is_left else Pair(partner, first))
    return sorted(pairs, key=lambda pair: -_ahead(pair.left))


def leftward(wheel: Wheel) -> Array:
    """The level unit vector along the axle that points left, so that forward points along x, or else along y.

    It is y for a wheel with a flaw, whose axis may be wrong.
    """
    if wheel.flaw:
        return np.array([0.0, 1.0, 0.0])
    x, y, _ = wheel.axis
    level = np.array([x, y, 0.0]) / math.hypot(x, y)
    forward_x, forward_y = level[1], -level[0]
    ahead = forward_x if abs(forward_x) > 1e-3 else forward_y
    return level if ahead > 0.0 else -level


def _ahead(wheel: Wheel) -> float:
    """How far ahead a wheel is in the direction of driving, m."""
    left_x, left_y, _ = leftward(wheel).tolist()
    x, y, _ = wheel.center.tolist()
    return float(x * left_y - y * left_x)


def _pairs_by_names(wheels: Sequence[Wheel], sides: Mapping[str, str]) -> list[Pair]:
    """Pairs of wheels with mirrored joint names, and then those that a controller names on its two sides."""
    rest = {wheel.joint.name: wheel for wheel in wheels}
    pairs = []
    for name in [name for name in rest if side_of(name) == "left"]:
        partner = rest.pop(mirrored_name(name) or "", None)
        if partner is not None:
            pairs.append(Pair(rest.pop(name), partner))
    lefts, rights = ([w for n, w in rest.items() if sides.get(n) == side] for side in ("left", "right"))
    if len(lefts) == len(rights):
        pairs += [Pair(left, right) for left, right in zip(lefts, rights, strict=True)]
    return pairs


def _is_pair(a: Wheel, b: Wheel) -> bool:
    near = EQUAL * max(a.radius, b.radius)
    # wheels may have camber, so that only their level axles are parallel
    left_a, left_b = (wheel.axis if wheel.flaw else leftward(wheel) for wheel in (a, b))
    if not abs(a.radius - b.radius) < near or abs(left_a @ left_b) < 0.99:
        return False
    axle = leftward(a)
    between = b.center - a.center
    along = float(between @ axle)
    off_line = float(np.linalg.norm(between - along * axle))
    return off_line <= near and abs(along) > max(a.width, b.width) / 2.0


def meant_base(tree: FrameTree, sides: Mapping[str, str]) -> MobileBase | None:
    """The base of a robot with at least one pair of wheels that are meant to drive; `sides` as for
    `pairs_of`."""
    pairs = pairs_of(meant_wheels(tree, sides), sides)
    # 0.7: a wheel that is too small by mistake is still meant to drive
    driven = [p for p in pairs if any(w.joint.name in sides for w in p.wheels)] or largest(pairs, 0.7)
    if not driven:
        return None
    wheels = [wheel for pair in driven for wheel in pair.wheels]
    bottoms = sorted(wheel.bottom for wheel in wheels if wheel.radius)
    if not bottoms:
        return MobileBase(tuple(driven), (), None)
    ground = bottoms[len(bottoms) // 2]
    casters = casters_of(tree, tree.root, ground, max(wheel.radius for wheel in wheels), wheels)
    # the root is not a caster, and has no joint that places it
    return MobileBase(tuple(driven), tuple(c for c in casters if c.link != tree.root), ground)


def largest(pairs: Sequence[Pair], share: float = 1.0 - EQUAL) -> list[Pair]:
    """The pairs that drive if no controller names them: those larger than `share` of the largest pair, and
    those of unknown size."""
    sizes = [pair.left.radius or pair.right.radius for pair in pairs]
    least = share * max(sizes, default=0.0)
    return [pair for pair, size in zip(pairs, sizes, strict=True) if not 0.0 < size <= least]


def casters_of(
    tree: FrameTree, base: str, ground: float, radius: float, wheels: Sequence[Wheel]
) -> tuple[Caster, ...]:
    """Links with a collision shape that ends near the ground, in the frame of `base`, without driving
    `wheels`.

    `ground` is the height of the contact plane and `radius` that of the driving wheels, both in m. A ball, a
    wheel, or a link with the name of a caster counts if it ends within half of `radius` of the plane, because
    a caster of the wrong size does so. Other shapes count only if they touch the ground."""
    robot, found = tree.robot, []
    driving = {part for wheel in wheels for part in rigid_links(robot, wheel.link)}
    for link in robot.links.values():
        if link.name in driving:
            continue
        above = robot.parent_joint.get(link.name)
        is_called = above is not None and is_caster(above)
        lowest = _lowest(tree, base, link, link.collisions)
        touches = lowest is not None
        if lowest is None and is_called:
            lowest = _lowest(tree, base, link, link.visuals)
        if lowest is None:
            continue
        bottom, base_from_shape, shape = lowest
        away = abs(bottom - ground)
        is_off_ground = away > (0.5 if _rolls(shape, base_from_shape) else 0.05) * radius
        if not is_off_ground or (is_called and away <= 0.5 * radius):
            ends = bounds(shape) if isinstance(shape, Mesh) else None  # other shapes have their origin there
            center = base_from_shape.translation if ends is None else base_from_shape.apply(np.mean(ends, 0))
            found.append(Caster(link.name, shape, bottom, center, touches, is_off_ground))
    return tuple(found)


def links_on_ground(tree: FrameTree, base: str) -> tuple[Caster, ...]:
    """The links with a collision shape that ends at most `LEVEL` above the lowest one, in the frame of
    `base`."""
    found = []
    for link in tree.robot.links.values():
        lowest = _lowest(tree, base, link, link.collisions)
        if lowest is not None:
            bottom, base_from_shape, shape = lowest
            center = base_from_shape.translation
            found.append(Caster(link.name, shape, bottom, center, touches=True, is_off_ground=False))
    ground = min((caster.bottom for caster in found), default=0.0)
    return tuple(caster for caster in found if caster.bottom <= ground + LEVEL)


def _lowest(
    tree: FrameTree, base: str, link: Link, shapes: Sequence[Collision | Visual]
) -> tuple[float, Transform, Geometry] | None:
    """Height in m of the lowest point of a link's shapes, with the pose and geometry of its shape; None if no
    size is known."""
    found, base_from_link = [], tree.pose(link.name, in_frame=base)
    for shape in shapes:
        base_from_shape = base_from_link @ Transform.of(shape.pose)
        try:
            span = span_along(shape.geometry, -base_from_shape.rotation[2])
        except KbotError:
            continue
        if span is not None:
            height = float(base_from_shape.translation[2]) - span[1]
            found.append((height, base_from_shape, shape.geometry))
    return min(found, key=lambda item: item[0], default=None)


def _rolls(shape: Geometry, base_from_shape: Transform) -> bool:
    """Whether a shape is a ball or a wheel, and not a foot."""
    if isinstance(shape, Cylinder):
        return abs(float(base_from_shape.rotation[2, 2])) < 0.5
    return not isinstance(shape, Box | Mesh)
