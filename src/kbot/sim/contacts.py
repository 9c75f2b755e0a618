"""Who touches whom, and with what friction: contact bits and priorities.

Two geometries touch when one's `contype` meets the other's `conaffinity`. Of two surfaces the one
with less friction decides (as Gazebo's ODE has it): friction sets the priority.
"""

from __future__ import annotations

from typing import Any

from kbot.sim.recipe import SOLIMP, SOLREF

GROUND = 1
OBSTACLE = 2
ROBOT = 4
SELF = 8
"""Links of one robot that are to touch each other."""

FRICTIONLESS = 1e-4
"""Below this coefficient a contact has no friction at all."""


def set_surface(geom: Any, friction: float) -> None:  # noqa: ANN401 - the engine has no types
    """Stiff contact with a sliding coefficient; no friction about the normal or in rolling."""
    geom.solref = SOLREF
    geom.solimp = SOLIMP
    geom.friction = (max(friction, 0.0), 0.0, 0.0)
    geom.priority, geom.condim = rank(friction)


def rank(friction: float) -> tuple[int, int]:
    """Priority and number of contact dimensions that go with a coefficient."""
    return round(1e6 / (1.0 + max(friction, 0.0))), 3 if friction >= FRICTIONLESS else 1


def as_ground(geom: Any) -> None:  # noqa: ANN401
    """Driven on: touches robots and what moves."""
    geom.contype, geom.conaffinity = GROUND, 0


def as_obstacle(geom: Any, moving: bool) -> None:  # noqa: ANN401
    """Run into: touches robots, and what moves touches everything."""
    geom.contype, geom.conaffinity = OBSTACLE, GROUND | OBSTACLE if moving else 0


def as_robot(geom: Any, others: bool) -> None:  # noqa: ANN401
    """A robot's shape: touches ground and obstacles, and robots too where there are `others`."""
    geom.contype, geom.conaffinity = ROBOT, GROUND | OBSTACLE | (ROBOT if others else 0)


def as_tyre(geom: Any) -> None:  # noqa: ANN401
    """The sphere with which a drive wheel meets the ground, and nothing else."""
    geom.contype, geom.conaffinity = 0, GROUND


def as_rim(geom: Any, others: bool) -> None:  # noqa: ANN401
    """A drive wheel's own shape: touches all but the ground."""
    geom.contype, geom.conaffinity = ROBOT, OBSTACLE | (ROBOT if others else 0)


def with_own_kind(geom: Any) -> None:  # noqa: ANN401
    """Touches those links of its own robot that are marked so too."""
    geom.contype |= SELF
    geom.conaffinity |= SELF
