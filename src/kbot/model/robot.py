"""The robot model: links and joints by name, in the order of the file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from kbot.brief import Brief, brief, counted
from kbot.model.geometry import Geometry
from kbot.text import Element, Origin

Row = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """A URDF `<origin>` in the parent frame: metres, and fixed-axis roll, pitch, yaw in radians."""

    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    origin: Origin | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Inertial(Brief):
    """Mass in kg, and inertia tensor in kg m^2 about the centre of mass, in the axes of `pose`."""

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
        """The rows of the symmetric tensor."""
        return (
            (self.ixx, self.ixy, self.ixz),
            (self.ixy, self.iyy, self.iyz),
            (self.ixz, self.iyz, self.izz),
        )

    def _shown(self) -> Iterator[str]:
        yield f"mass={self.mass:g}"
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
            yield f"{name}={getattr(self, name):g}"


@dataclass(frozen=True, slots=True)
class Material:
    """A material. `rgba` is in 0..1, or None if the name is not defined."""

    name: str
    rgba: tuple[float, float, float, float] | None
    texture: str | None
    origin: Origin


@dataclass(frozen=True, slots=True, repr=False)
class Visual(Brief):
    name: str
    pose: Pose
    geometry: Geometry
    material: Material | None
    origin: Origin

    def _shown(self) -> Iterator[str]:
        yield from [repr(self.name)] if self.name else []
        yield brief(self.geometry)
        yield str(self.origin)


@dataclass(frozen=True, slots=True, repr=False)
class Collision(Brief):
    name: str
    pose: Pose
    geometry: Geometry
    origin: Origin

    def _shown(self) -> Iterator[str]:
        yield from [repr(self.name)] if self.name else []
        yield brief(self.geometry)
        yield str(self.origin)


@dataclass(frozen=True, slots=True, repr=False)
class Link(Brief):
    name: str
    inertial: Inertial | None
    visuals: tuple[Visual, ...]
    collisions: tuple[Collision, ...]
    origin: Origin

    @property
    def mass(self) -> float:
        """Mass in kg, 0 without `<inertial>`."""
        return self.inertial.mass if self.inertial is not None else 0.0

    @property
    def shapes(self) -> tuple[Visual | Collision, ...]:
        """The visuals, then the collisions."""
        return (*self.visuals, *self.collisions)

    def _shown(self) -> Iterator[str]:
        yield repr(self.name)
        yield f"{self.mass:g} kg"
        yield counted(len(self.visuals), "visual")
        yield counted(len(self.collisions), "collision")


class JointType(StrEnum):
    FIXED = "fixed"
    CONTINUOUS = "continuous"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    PLANAR = "planar"
    FLOATING = "floating"


@dataclass(frozen=True, slots=True)
class Limit:
    """Limits: position in rad or m, effort in N m or N, velocity in rad/s or m/s. None if not given."""

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
    """The position is multiplier * position of `joint` + offset."""

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


@dataclass(frozen=True, slots=True, repr=False)
class Joint(Brief):
    """A joint. `axis` is in the joint frame, not normalised; x without `<axis>` (then no `axis_origin`)."""

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
        """Whether its position is a single number."""
        return self.type in (JointType.CONTINUOUS, JointType.REVOLUTE, JointType.PRISMATIC)

    @property
    def range(self) -> tuple[float, float]:
        """The lowest and highest position in rad or m.

        A missing bound is 0, as in URDF. Continuous joints and joints without a limit are unbounded.
        """
        if self.limit is None or self.type is JointType.CONTINUOUS:
            return -math.inf, math.inf
        return self.limit.lower or 0.0, self.limit.upper or 0.0

    @property
    def effort_limit(self) -> float:
        """The effort limit in N m or N, infinite if it is 0 or missing. Gazebo does not enforce a negative
        one."""
        effort = self.limit.effort if self.limit is not None else None
        return effort if effort is not None and effort > 0.0 else math.inf

    @property
    def speed_limit(self) -> float:
        """The velocity limit in rad/s or m/s, as `effort_limit`."""
        velocity = self.limit.velocity if self.limit is not None else None
        return velocity if velocity is not None and velocity > 0.0 else math.inf

    def _shown(self) -> Iterator[str]:
        yield repr(self.name)
        yield repr(str(self.type))
        yield f"parent={self.parent!r}"
        yield f"child={self.child!r}"


@dataclass(frozen=True, repr=False)
class RobotModel(Brief):
    """A robot description: a tree of links connected by joints.

    `extensions` are the elements of the root that URDF does not define (`<gazebo>`, `<transmission>`,
    `<ros2_control>` …), as written and with their origins.
    """

    name: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    materials: Mapping[str, Material]
    extensions: tuple[Element, ...]
    origin: Origin

    @cached_property
    def root(self) -> str:
        """The name of the root link, which is not the child of a joint."""
        children = {joint.child for joint in self.joints.values()}
        return next(name for name in self.links if name not in children)

    @cached_property
    def parent_joint(self) -> Mapping[str, Joint]:
        """The parent joint of each link except the root."""
        return {joint.child: joint for joint in self.joints.values()}

    @cached_property
    def child_joints(self) -> Mapping[str, tuple[Joint, ...]]:
        """The child joints of each link."""
        below: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            below[joint.parent].append(joint)
        return {name: tuple(joints) for name, joints in below.items()}

    @cached_property
    def movable_joints(self) -> tuple[Joint, ...]:
        """The joints whose position is a single number, in order, including mimic joints."""
        return tuple(joint for joint in self.joints.values() if joint.has_position)

    def _shown(self) -> Iterator[str]:
        yield repr(self.name)
        yield counted(len(self.links), "link")
        yield counted(len(self.joints), "joint")
        yield repr(self.origin.span.source.path)
