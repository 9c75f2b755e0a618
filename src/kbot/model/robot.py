"""The whole robot: links and joints by name, in the order of the file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from kbot.model.geometry import Geometry
from kbot.text import Element, Origin

Row = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """A URDF `<origin>`: metres, and fixed-axis roll, pitch, yaw in radians, in the parent frame."""

    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    origin: Origin | None = None


@dataclass(frozen=True, slots=True)
class Inertial:
    """Mass in kg; tensor in kg m^2 about the centre of mass, in the axes of `pose`."""

    mass: float
    ixx: float
    ixy: float
    ixz: float
    iyy: float
    iyz: float
    izz: float
    pose: Pose
    origin: Origin
    mass_origin: Origin
    inertia_origin: Origin

    @property
    def tensor(self) -> tuple[Row, Row, Row]:
        """The tensor's rows, symmetric."""
        return (
            (self.ixx, self.ixy, self.ixz),
            (self.ixy, self.iyy, self.iyz),
            (self.ixz, self.iyz, self.izz),
        )


@dataclass(frozen=True, slots=True)
class Material:
    """`rgba` in 0..1, None where only a name was given and no such material is defined."""

    name: str
    rgba: tuple[float, float, float, float] | None
    texture: str | None
    origin: Origin


@dataclass(frozen=True, slots=True)
class Visual:
    name: str
    pose: Pose
    geometry: Geometry
    material: Material | None
    origin: Origin


@dataclass(frozen=True, slots=True)
class Collision:
    name: str
    pose: Pose
    geometry: Geometry
    origin: Origin


@dataclass(frozen=True, slots=True)
class Link:
    name: str
    inertial: Inertial | None
    visuals: tuple[Visual, ...]
    collisions: tuple[Collision, ...]
    origin: Origin

    @property
    def shapes(self) -> tuple[Visual | Collision, ...]:
        """What is seen of it, then what it touches with."""
        return (*self.visuals, *self.collisions)


class JointType(StrEnum):
    FIXED = "fixed"
    CONTINUOUS = "continuous"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    PLANAR = "planar"
    FLOATING = "floating"


@dataclass(frozen=True, slots=True)
class Limit:
    """Position in rad or m (None when not given), effort in N m or N, velocity in rad/s or m/s."""

    lower: float | None
    upper: float | None
    effort: float | None
    velocity: float | None
    origin: Origin


@dataclass(frozen=True, slots=True)
class Dynamics:
    """Viscous damping (N m s/rad or N s/m) and Coulomb friction (N m or N)."""

    damping: float
    friction: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class Mimic:
    """position = multiplier * position of `joint` + offset."""

    joint: str
    multiplier: float
    offset: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class SafetyController:
    soft_lower_limit: float
    soft_upper_limit: float
    k_position: float
    k_velocity: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class Joint:
    """`axis` is as written, not normalised (x when not given: see `axis_origin`), in the joint frame."""

    name: str
    type: JointType
    parent: str
    child: str
    pose: Pose
    axis: tuple[float, float, float]
    axis_origin: Origin | None
    limit: Limit | None
    dynamics: Dynamics | None
    mimic: Mimic | None
    safety: SafetyController | None
    origin: Origin
    parent_origin: Origin
    child_origin: Origin

    @property
    def is_movable(self) -> bool:
        return self.type is not JointType.FIXED

    @property
    def has_position(self) -> bool:
        """Whether one number says where it stands."""
        return self.type in (JointType.CONTINUOUS, JointType.REVOLUTE, JointType.PRISMATIC)

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest position in rad or m: 0 for a bound that is not given (URDF), infinite for a
        continuous joint and for one without a limit."""
        if self.limit is None or self.type is JointType.CONTINUOUS:
            return -math.inf, math.inf
        return self.limit.lower or 0.0, self.limit.upper or 0.0


@dataclass(frozen=True)
class RobotModel:
    """A robot description: a tree of links held together by joints.

    `extensions` are the root's elements that URDF itself does not define (`<gazebo>`,
    `<transmission>`, `<ros2_control>` …), as written and with their origins.
    """

    name: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    materials: Mapping[str, Material]
    extensions: tuple[Element, ...]
    origin: Origin

    @cached_property
    def root(self) -> str:
        """Name of the link that is no joint's child."""
        children = {joint.child for joint in self.joints.values()}
        return next(name for name in self.links if name not in children)

    @cached_property
    def parent_joint(self) -> Mapping[str, Joint]:
        """The joint above each link, the root left out."""
        return {joint.child: joint for joint in self.joints.values()}

    @cached_property
    def child_joints(self) -> Mapping[str, tuple[Joint, ...]]:
        """The joints beneath each link."""
        below: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            below[joint.parent].append(joint)
        return {name: tuple(joints) for name, joints in below.items()}

    @cached_property
    def movable_joints(self) -> tuple[Joint, ...]:
        """Joints whose position is one number, in order, mimics included."""
        return tuple(joint for joint in self.joints.values() if joint.has_position)
