"""What holds two links together and how the child may move."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from kbot.model.link import Pose
from kbot.text import Origin


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
