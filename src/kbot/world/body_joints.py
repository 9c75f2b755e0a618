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
    """One way to move. `axis`: unit vector in the body's axes as it stands at the start (of no meaning for a
    ball). Limits in rad or m from there; damping in N m s/rad or N s/m, friction in N m or N, stiffness of a
    spring in N m/rad or N/m, which is at rest at `spring_reference`."""

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
    """`parent`: the body it hangs on, empty for the world. `anchor` (m, in the body's frame): the point about
    which it turns. The freedoms follow one another from the parent on; with a `lead` (m/rad) the second, a
    slide, follows the first as a nut its screw."""

    name: str
    parent: str
    anchor: Vector
    freedoms: tuple[Freedom, ...]
    lead: float | None = None
    origin: Origin | None = None


@dataclass(frozen=True, slots=True)
class Loop:
    """A joint between two bodies that already hang on something: it closes a ring. The bodies share the
    `points` (m, in the world as it stands at the start): one for a ball, two along the axis of a hinge."""

    name: str
    first: str
    second: str
    points: tuple[Vector, ...]
    origin: Origin | None = None
