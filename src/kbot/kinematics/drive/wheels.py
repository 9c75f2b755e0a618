"""The wheels of a robot, the pairs that they make, and its casters, found from its joints and shapes.

`find_drive` uses the wheels that have no flaw. `kbot check` uses all wheels that are meant to drive. A wheel
that is fixed, turned wrongly or smaller than its partner is meant to drive if a controller names it, if its
own name says so, or by its shape and place.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

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
"""Of a robot whose wheels `kbot check` looks for: each is compared with each other, and followed up to the
root. A robot with more gets the finding K003."""
EQUAL = 0.1
"""By how much of a wheel's radius two wheels of a pair may differ in size, and stand apart in x and z."""
_PARALLEL = math.cos(math.radians(5.0))
_ROUND = 0.03
"""By how much of its radius a mesh's outline may differ between directions and still be round."""


@dataclass(frozen=True, slots=True, eq=False)
class Wheel:
    """The wheel on a joint, and why it cannot drive: `flaw` is empty for one that can.

    `center` (3,) in m and the unit `axis` (3,) of the joint are in the frame of the base, for `kbot check` in
    that of the root. `radius` and `width` in m are 0 where no round shape is known.
    """

    joint: Joint
    center: Array
    axis: Array
    radius: float = 0.0
    width: float = 0.0
    shape: Geometry | None = None
    flaw: str = "it turns no shape"

    @property
    def link(self) -> str:
        return self.joint.child

    @property
    def bottom(self) -> float:
        """Height of the lowest point, m."""
        return float(self.center[2]) - self.radius


@dataclass(frozen=True, slots=True)
class Pair:
    """Two wheels across from each other."""

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
        """Whether the wheels are across from each other along y."""
        x, y, z = abs(self.left.center - self.right.center).tolist()
        return bool(y > max(x, z))

    @property
    def names(self) -> frozenset[str]:
        """The wheels' joints and links."""
        return frozenset(name for wheel in self.wheels for name in (wheel.joint.name, wheel.link))


@dataclass(frozen=True, slots=True, eq=False)
class Caster:
    """A link that is meant to bear the robot without driving it, with its lowest shape.

    `bottom` is the height of the lowest point and `center` (3,) the middle of the shape, m. `touches` is
    False where no collision shape is known. `is_off_ground` is True for a link that only its name makes a
    caster.
    """

    link: str
    shape: Geometry
    bottom: float
    center: Array
    touches: bool
    is_off_ground: bool


@dataclass(frozen=True, slots=True)
class MobileBase:
    """The wheels that are meant to drive, in pairs front to rear, the casters, and the height of the ground,
    m, in the root's frame."""

    pairs: tuple[Pair, ...]
    casters: tuple[Caster, ...]
    ground: float | None

    @property
    def wheels(self) -> tuple[Wheel, ...]:
        return tuple(wheel for pair in self.pairs for wheel in pair.wheels)


def rigid_links(robot: RobotModel, link: str) -> Iterator[str]:
    """`link` and the links that fixed joints hold to it from below."""
    waiting = [link]
    while waiting:
        name = waiting.pop()
        yield name
        waiting.extend(j.child for j in robot.child_joints[name] if j.type is JointType.FIXED)


def movable_above(robot: RobotModel, link: str) -> Joint | None:
    """The nearest joint above a link that moves by a motor or a spring; None where the link hangs rigidly on
    the root, or on a body that floats."""
    while link != robot.root:
        above = robot.parent_joint[link]
        if above.is_movable:
            return above if above.has_position else None
        link = above.parent
    return None


def carrier(robot: RobotModel, link: str) -> str:
    """The topmost link above `link` that goes with it over the ground: the root, or a body that floats."""
    while link != robot.root:
        above = robot.parent_joint[link]
        if above.is_movable and not above.has_position:
            return link
        link = above.parent
    return link


def find_wheel(tree: FrameTree, joint: Joint, base: str) -> Wheel:
    """The wheel on a joint: its size is that of the largest shape that is round about the axle, else of the
    largest round shape."""
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
    if abs(axis[2]) > 0.2:
        return replace(best, flaw="its axis is not level")
    return replace(best, flaw=first_flaw) if best.flaw and first_flaw else best


def meant_wheels(tree: FrameTree, named: Collection[str]) -> list[Wheel]:
    """The wheels that are meant to drive, in the root's frame: those on joints that a controller names, those
    whose names say so, and plain ones that turn without end."""
    robot, found = tree.robot, []
    for joint in robot.joints.values():
        is_named, turns = joint.name in named, joint.type is JointType.CONTINUOUS
        is_called = bool(WHEEL.search(joint.name) or WHEEL.search(joint.child))
        if not (is_named or ((is_called or turns) and not is_caster(joint))):
            continue
        above = movable_above(robot, joint.parent)
        if above is not None and above.type is not JointType.PRISMATIC:
            continue  # its axle is turned, as by a car's steering and a caster's swivel
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
    """Whether a joint or its child is called a caster."""
    return bool(CASTER.search(joint.child) or CASTER.search(joint.name))


def _shapes(link: Link) -> list[tuple[Pose, Geometry]]:
    """What the link touches the ground with; what is seen of it where nothing plain is said to touch."""
    collisions: list[tuple[Pose, Geometry]] = [(c.pose, c.geometry) for c in link.collisions]
    visuals: list[tuple[Pose, Geometry]] = [(v.pose, v.geometry) for v in link.visuals]
    for shapes in (collisions, visuals):
        plain = [item for item in shapes if isinstance(item[1], Cylinder | Sphere | Capsule)]
        if plain:
            return plain
    return collisions or visuals


def _round_about(shape: Geometry, axis: Array) -> tuple[float, float, Array, str]:
    """Radius, width and middle (3,) of a round shape, and why it is not round about `axis`; the radius is 0
    for a shape that is not round at all.

    `axis` (3,) and the middle are in the shape's frame.
    """
    match shape:
        case Sphere(radius=radius) if radius > 0.0:
            return radius, 2.0 * radius, np.zeros(3), ""
        case Cylinder(radius=radius, length=length) | Capsule(radius=radius, length=length) if radius > 0.0:
            name, ends = ("capsule", 2.0 * radius) if isinstance(shape, Capsule) else ("cylinder", 0.0)
            flaw = f"its {name} does not lie along its axis" if abs(axis[2]) < _PARALLEL else ""
            return radius, length + ends, np.zeros(3), flaw
        case Mesh(path=None):
            flaw = f"its size is not known, for its mesh is not found: {shape.uri}"
        case Mesh():
            try:
                return _round_mesh(shape, axis)
            except KbotError as error:
                flaw = str(error)
        case _:
            flaw = "its shape is not round"
    return 0.0, 0.0, np.zeros(3), flaw


def _round_mesh(mesh: Mesh, axis: Array) -> tuple[float, float, Array, str]:
    """As `_round_about`, by the mesh's outline; one of its own axes is its axle where `axis` is not."""
    points, flaw = vertices(mesh), ""
    for about in (axis, *np.eye(3)):
        across = np.cross(about, np.eye(3)[int(np.argmin(np.abs(about)))])
        across /= np.linalg.norm(across) or 1.0  # an axis that was written as zero has no outline
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
    """Wheels of equal size across from each other, front to rear; left and right by their position.

    `sides` gives the side ("left", "right" or "") of joints that a controller names. With it, names pair
    wheels first and decide what is left and right, because the position or size of a wheel may be wrong.
    """
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
    """The level unit vector along the axle that points left; forward is then nearest to x, else to y. It is y
    for a wheel with a flaw, whose axis may be wrong."""
    if wheel.flaw:
        return np.array([0.0, 1.0, 0.0])
    x, y, _ = wheel.axis
    level = np.array([x, y, 0.0]) / math.hypot(x, y)
    forward_x, forward_y = level[1], -level[0]
    ahead = forward_x if abs(forward_x) > 1e-3 else forward_y
    return level if ahead > 0.0 else -level


def _ahead(wheel: Wheel) -> float:
    """How far ahead a wheel is in the direction in which it drives, m."""
    left_x, left_y, _ = leftward(wheel).tolist()
    x, y, _ = wheel.center.tolist()
    return float(x * left_y - y * left_x)


def _pairs_by_names(wheels: Sequence[Wheel], sides: Mapping[str, str]) -> list[Pair]:
    """Wheels whose joints' names mirror each other; then those that a controller names for its two sides."""
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
    if not abs(a.radius - b.radius) < near or abs(a.axis @ b.axis) < 0.99:
        return False
    axle = leftward(a) if a.flaw else a.axis  # the axis may be the flaw
    between = b.center - a.center
    along = float(between @ axle)
    off_line = float(np.linalg.norm(between - along * axle))
    return off_line <= near and abs(along) > max(a.width, b.width) / 2.0


def meant_base(tree: FrameTree, sides: Mapping[str, str]) -> MobileBase | None:
    """The base of a robot with at least one pair of wheels that are meant to drive; `sides` as for
    `pairs_of`."""
    pairs = pairs_of(meant_wheels(tree, sides), sides)
    # a wheel that is made too small is still meant to drive
    driven = [p for p in pairs if any(w.joint.name in sides for w in p.wheels)] or largest(pairs, 0.7)
    if not driven:
        return None
    wheels = [wheel for pair in driven for wheel in pair.wheels]
    bottoms = sorted(wheel.bottom for wheel in wheels if wheel.radius)
    if not bottoms:
        return MobileBase(tuple(driven), (), None)
    ground = bottoms[len(bottoms) // 2]
    casters = casters_of(tree, tree.root, ground, max(wheel.radius for wheel in wheels), wheels)
    # the root carries the robot, and has no joint to be placed by
    return MobileBase(tuple(driven), tuple(c for c in casters if c.link != tree.root), ground)


def largest(pairs: Sequence[Pair], share: float = 1.0 - EQUAL) -> list[Pair]:
    """The pairs that drive if no controller names them: those larger than `share` of the largest pair. A pair
    of unknown size counts as large."""
    sizes = [pair.left.radius or pair.right.radius for pair in pairs]
    least = share * max(sizes, default=0.0)
    return [pair for pair, size in zip(pairs, sizes, strict=True) if not 0.0 < size <= least]


def casters_of(
    tree: FrameTree, base: str, ground: float, radius: float, wheels: Sequence[Wheel]
) -> tuple[Caster, ...]:
    """Links with a collision shape that ends near the ground, the driving `wheels` left out; in the frame of
    `base`.

    `ground`: height of the contact plane; `radius`: of the driving wheels; both in m. A ball, a wheel or what
    is called a caster counts when it ends within half a drive wheel's radius of the plane, for that is what a
    caster of the wrong size looks like; another shape only when it touches.
    """
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


def _lowest(
    tree: FrameTree, base: str, link: Link, shapes: Sequence[Collision | Visual]
) -> tuple[float, Transform, Geometry] | None:
    """Height in m of the lowest point of a link's shapes, with the pose of the shape that has it; None if no
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
    """Whether it is a ball or a wheel rather than a foot."""
    if isinstance(shape, Cylinder):
        return abs(float(base_from_shape.rotation[2, 2])) < 0.5
    return not isinstance(shape, Box | Mesh)
