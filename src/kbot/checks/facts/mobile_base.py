"""The wheels, casters and ground contact of a wheeled robot, also of one whose drive does not work.

`kbot.kinematics.find_drive` finds only a drive that works. This module also recognises a wheel that is fixed,
turned wrongly or smaller than its partner: by a controller that names it, by its name, or by its shape and
place.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from kbot.checks.facts.bodies import LinkBody, LinkShape, axis_of
from kbot.kinematics.drive.part_names import CASTER, WHEEL, mirrored_name, side_of
from kbot.kinematics.drive.wheels import movable_above, rigid_links
from kbot.kinematics.spatial import SpatialFrame, Vector, dot, subtract, unit
from kbot.model import Box, Cylinder, Joint, JointType, Mesh, RobotModel, Sphere

MOST_JOINTS = 1_000
"""Of a robot whose wheels are looked for: each is compared with each other, and followed up to the root.
A robot with more gets the finding K003."""


@dataclass(frozen=True, slots=True)
class MeantWheel:
    """A wheel as it is meant; positions in the root's frame, m.

    `axis` is the joint's, a unit vector in the root's frame; `radius` and `width` are None where the
    shape is a mesh that is not there.
    """

    joint: Joint
    link: str
    center: Vector
    axis: Vector
    radius: float | None
    width: float | None
    part: LinkShape | None

    @property
    def bottom(self) -> float | None:
        return None if self.radius is None else self.center[2] - self.radius


@dataclass(frozen=True, slots=True)
class Pair:
    """Two wheels across from each other, as their names say (else as they stand)."""

    left: MeantWheel
    right: MeantWheel

    @property
    def separation(self) -> float:
        """Distance between the wheels' middles along y, m, as they stand."""
        return abs(self.left.center[1] - self.right.center[1])

    @property
    def is_level(self) -> bool:
        """Whether the wheels stand across from each other along y."""
        between = [abs(a - b) for a, b in zip(self.left.center, self.right.center, strict=True)]
        return between[1] > max(between[0], between[2])

    @property
    def names(self) -> frozenset[str]:
        """The wheels' joints and links."""
        return frozenset(name for wheel in (self.left, self.right) for name in (wheel.joint.name, wheel.link))


@dataclass(frozen=True, slots=True)
class Caster:
    """A link that bears the robot without driving it, and the height of its lowest point, m.

    `touches` is False for one that is called a caster and has a visual alone.
    """

    link: str
    part: LinkShape
    bottom: float
    center: Vector
    joint: Joint
    touches: bool


@dataclass(frozen=True, slots=True)
class MobileBase:
    """The wheels that drive, in pairs front to rear; the casters; the height of the ground, m."""

    pairs: tuple[Pair, ...]
    casters: tuple[Caster, ...]
    ground: float | None

    @property
    def wheels(self) -> tuple[MeantWheel, ...]:
        return tuple(w for pair in self.pairs for w in (pair.left, pair.right))


def find_mobile_base(
    robot: RobotModel,
    frames: Mapping[str, SpatialFrame],
    bodies: Mapping[str, LinkBody],
    named: Mapping[str, str],
) -> MobileBase | None:
    """The base of a robot with at least one pair of drive wheels, else None.

    `named`: joints that a controller or plugin drives, each with its side ("left", "right" or "").
    """
    if len(robot.joints) > MOST_JOINTS:
        return None
    wheels = [w for j in robot.joints.values() if (w := _wheel(robot, j, frames, bodies, j.name in named))]
    pairs = _pairs(wheels, named)
    if not pairs:
        return None
    driven = [p for p in pairs if p.left.joint.name in named or p.right.joint.name in named]
    if not driven:
        largest = max(p.left.radius or p.right.radius or 0.0 for p in pairs)
        driven = [p for p in pairs if (p.left.radius or p.right.radius or largest) > 0.7 * largest]
    driven.sort(key=lambda p: -p.left.center[0])
    bottoms = sorted(w.bottom for p in driven for w in (p.left, p.right) if w.bottom is not None)
    ground = bottoms[len(bottoms) // 2] if bottoms else None
    casters: tuple[Caster, ...] = ()
    if ground is not None:
        size = max(w.radius or 0.0 for p in driven for w in (p.left, p.right))
        driving = {name for p in driven for w in (p.left, p.right) for name in rigid_links(robot, w.link)}
        casters = tuple(_casters(robot, frames, bodies, driving, ground, size))
    return MobileBase(tuple(driven), casters, ground)


def is_caster(joint: Joint) -> bool:
    """Whether a joint or its child is called a caster."""
    return bool(CASTER.search(joint.child) or CASTER.search(joint.name))


def lowest(part: LinkShape, frame: SpatialFrame) -> float:
    """Height of a part's lowest point in the root's frame, `frame` being its link's."""
    down = frame.local_direction((0.0, 0.0, -1.0))
    return frame.point(part.frame.translation)[2] - part.support(down)


def _wheel(
    robot: RobotModel,
    joint: Joint,
    frames: Mapping[str, SpatialFrame],
    bodies: Mapping[str, LinkBody],
    named: bool,
) -> MeantWheel | None:
    called = bool(WHEEL.search(joint.name) or WHEEL.search(joint.child))
    turns = joint.type is JointType.CONTINUOUS
    if not named and not (called or turns):
        return None
    if not named and (CASTER.search(joint.name) or CASTER.search(joint.child)):
        return None
    above = movable_above(robot, joint.parent)
    if not named and above is not None and above.type is not JointType.PRISMATIC:
        return None
    frame = frames[joint.child]
    axis = unit(frame.direction(joint.axis)) or (0.0, 0.0, 0.0)
    steers = joint.type is JointType.REVOLUTE and abs(axis[2]) > 0.7
    suspends = joint.type is JointType.PRISMATIC and not named and abs(axis[2]) > 0.5
    if suspends or steers or _is_steered(robot, joint):
        return None
    round_part = _round_part(bodies, list(rigid_links(robot, joint.child)), frames, frame)
    if round_part is None:
        shapes = any(
            robot.links[name].visuals or robot.links[name].collisions
            for name in rigid_links(robot, joint.child)
        )
        if not (named or (called and turns and shapes)):
            return None
        return MeantWheel(joint, joint.child, frame.translation, axis, None, None, None)
    part, center, radius, width = round_part
    if not named and not called and abs(axis[2]) > 0.5:
        return None
    if not named and not isinstance(part.geometry, Cylinder | Sphere) and not called:
        return None
    return MeantWheel(joint, joint.child, center, axis, radius, width, part)


def _is_steered(robot: RobotModel, joint: Joint) -> bool:
    """Whether a joint above turns the wheel's axle, as a car's steering and a caster's swivel do."""
    above = movable_above(robot, joint.parent)
    return above is not None and above.type in (JointType.REVOLUTE, JointType.CONTINUOUS)


def _round_part(
    bodies: Mapping[str, LinkBody], links: list[str], frames: Mapping[str, SpatialFrame], own: SpatialFrame
) -> tuple[LinkShape, Vector, float, float] | None:
    """The largest round shape at the joint: part, centre in the root's frame, radius, width."""
    best: tuple[LinkShape, Vector, float, float] | None = None
    for link in links:
        body = bodies[link]
        for part in body.collisions or body.visuals:
            center = frames[link].point(part.frame.translation)
            match part.geometry:
                case Sphere(radius=r):
                    size = (r, 2.0 * r)
                case Cylinder(radius=r, length=length):
                    size = (r, length)
                case Mesh():
                    a, b, c = sorted(part.half)
                    if c - b > 0.03 * c and b - a > 0.03 * c:
                        continue
                    size = (c, 2.0 * a) if c - b <= 0.03 * c else (b, 2.0 * c)
                case _:
                    continue
            if best is None or size[0] > best[2]:
                best = (part, center, *size)
    return best


def _pairs(wheels: list[MeantWheel], named: Mapping[str, str]) -> list[Pair]:
    """Wheels across from each other: first those whose names mirror, then those that stand so."""
    by_joint = {w.joint.name: w for w in wheels}
    pairs: list[Pair] = []
    left_over = dict(by_joint)
    for wheel in wheels:
        partner = by_joint.get(mirrored_name(wheel.joint.name) or "")
        if (
            partner
            and partner is not wheel
            and wheel.joint.name in left_over
            and partner.joint.name in left_over
        ):
            del left_over[wheel.joint.name], left_over[partner.joint.name]
            is_left = side_of(wheel.joint.name) == "left"
            pairs.append(Pair(wheel, partner) if is_left else Pair(partner, wheel))
    rest = list(left_over.values())
    sides = {w.joint.name: named.get(w.joint.name, "") for w in rest}
    lefts = [w for w in rest if sides[w.joint.name] == "left"]
    rights = [w for w in rest if sides[w.joint.name] == "right"]
    if lefts and len(lefts) == len(rights):
        pairs += [Pair(a, b) for a, b in zip(lefts, rights, strict=True)]
        rest = [w for w in rest if w not in lefts and w not in rights]
    while rest:
        first = rest.pop(0)
        partner = next((w for w in rest if _across(first, w)), None)
        if partner:
            rest.remove(partner)
            left, right = (first, partner) if first.center[1] > partner.center[1] else (partner, first)
            pairs.append(Pair(left, right))
    return pairs


def _across(a: MeantWheel, b: MeantWheel) -> bool:
    if a.radius is None or b.radius is None:
        return False
    near = 0.1 * max(a.radius, b.radius)
    between = subtract(a.center, b.center)
    return (
        abs(a.radius - b.radius) < near
        and abs(between[0]) < near
        and abs(between[2]) < near
        and abs(between[1]) > near
        and abs(a.center[1] + b.center[1]) < near + 0.1 * abs(between[1])
        and abs(dot(a.axis, b.axis)) > 0.9
    )


def _casters(
    robot: RobotModel,
    frames: Mapping[str, SpatialFrame],
    bodies: Mapping[str, LinkBody],
    driving: set[str],
    ground: float,
    size: float,
) -> Iterator[Caster]:
    """Links that end near the ground: round ones and those called casters within half a wheel's radius."""
    for name, body in bodies.items():
        joint = robot.parent_joint.get(name)
        if name in driving or joint is None:
            continue
        parts = body.collisions
        called = bool(CASTER.search(name) or CASTER.search(joint.name))
        if not parts and called:
            parts = body.visuals
        if not parts:
            continue
        part = min(parts, key=lambda p: lowest(p, frames[name]))
        bottom = lowest(part, frames[name])
        wheel_like = isinstance(part.geometry, Sphere) or _rolls(part, frames[name])
        reach = 0.5 if wheel_like or called else 0.05
        if isinstance(part.geometry, Box) and not called:
            reach = 0.02
        if abs(bottom - ground) <= reach * size:
            yield Caster(
                name, part, bottom, frames[name].point(part.frame.translation), joint, bool(body.collisions)
            )


def _rolls(part: LinkShape, frame: SpatialFrame) -> bool:
    axis = axis_of(part)
    return axis is not None and abs(frame.direction(axis)[2]) < math.sin(math.radians(30.0))
