"""Joints between bodies of a world."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import inf

from kbot.text import Origin

Vector = tuple[float, float, float]


class JointMotion(StrEnum):
    TURN = "turn"
    SLIDE = "slide"
    BALL = "ball"


@dataclass(frozen=True, slots=True)
class Freedom:
    """One degree of freedom of a joint, or a ball.

    `axis` is a unit vector in the body's axes at the start, without meaning for a ball. Limits are in rad or
    m from the start. Damping is in N m s/rad or N s/m, friction in N m or N. A spring has the stiffness in N
    m/rad or N/m and is at rest at `spring_reference`.
    """

    motion: JointMotion
    axis: Vector = (0.0, 0.0, 1.0)
    lower: float = -inf
    upper: float = inf
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    spring_reference: float = 0.0


@dataclass(frozen=True, slots=True)
class BodyJoint:
    """The joint that connects a body to its `parent` (empty for the world).

    `anchor` is the point about which the body turns (m, in the body's frame). The freedoms are ordered from
    the parent to the body. With a `lead` (m/rad) the second freedom, a slide, follows the first as a nut
    follows a screw.
    """

    name: str
    parent: str
    anchor: Vector
    freedoms: tuple[Freedom, ...]
    lead: float | None = None
    origin: Origin | None = None


@dataclass(frozen=True, slots=True)
class Loop:
    """A joint that closes a kinematic loop: both bodies have a joint to a parent already.

    The bodies share the `points` (m, in the world at the start): one for a ball, two along a hinge's axis.
    """

    name: str
    first: str
    second: str
    points: tuple[Vector, ...]
    origin: Origin | None = None
