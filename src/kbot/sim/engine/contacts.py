"""Contacts: which shapes touch each other, with which friction and stiffness.

Two geometries touch when one's `contype` meets the other's `conaffinity`. Of two surfaces the one
with less friction decides (as Gazebo's ODE has it): friction sets the priority.
"""

from __future__ import annotations

from math import sqrt

import mujoco

from kbot.sim.recipe import SOLIMP, SOLREF

GROUND = 1
OBSTACLE = 2
ROBOT = 4
SELF = 8
"""Links of one robot that are to touch each other."""

SPRING = 0.9
"""Impedance of a contact that is a spring: less creeps along slopes."""

MODELS = tuple(1 << bit for bit in range(4, 31))
"""One for each of some models of several bodies, which do not touch each other."""

STIFFEST = 2e5
"""1/s^2, of a spring per mass that the step bears."""

FRICTIONLESS = 1e-4
"""Below this coefficient a contact has no friction at all."""


def set_surface(geom: mujoco.MjsGeom, friction: float) -> None:
    """Stiff contact with a sliding coefficient; no friction about the normal or in rolling."""
    geom.solref = SOLREF
    geom.solimp = SOLIMP
    geom.friction = (max(friction, 0.0), 0.0, 0.0)
    geom.priority, geom.condim = rank(friction)


def set_spring(geom: mujoco.MjsGeom, stiffness: float, damping: float, mass: float) -> None:
    """Let a shape of a robot of `mass` (kg) sink in as a spring of `stiffness` (N/m) has it, each contact by
    its share of the weight; `damping` in N s/m, but no less than lets it not bounce. A stiff one is as stiff
    as the step allows.

    The engine's stiffness is in 1/s^2: at rest it sinks by (1 - d) g / k at an impedance of d.
    """
    per_mass = min(stiffness * (1.0 - SPRING) / mass, STIFFEST)
    least = 2.0 * sqrt(per_mass)
    geom.solref = (-per_mass, -min(max(damping * (1.0 - SPRING) / mass, least), 2.0 * sqrt(STIFFEST)))
    geom.solimp = (SPRING, SPRING, 0.001, 0.5, 2.0)
    # of two surfaces the spring decides
    geom.solmix = 1e6


def rank(friction: float) -> tuple[int, int]:
    """Priority and number of contact dimensions that go with a coefficient."""
    return round(1e6 / (1.0 + max(friction, 0.0))), 3 if friction >= FRICTIONLESS else 1


def as_ground(geom: mujoco.MjsGeom) -> None:
    """Driven on: touches robots and what moves."""
    geom.contype, geom.conaffinity = GROUND, 0


def as_obstacle(geom: mujoco.MjsGeom, moving: bool) -> None:
    """Run into: touches robots, and what moves touches everything."""
    geom.contype, geom.conaffinity = OBSTACLE, GROUND | OBSTACLE if moving else 0


def as_part_of(geom: mujoco.MjsGeom, model: int) -> None:
    """Of a model, one of `MODELS`: run into as what moves is, but by no other part of it."""
    geom.contype, geom.conaffinity = model, GROUND | OBSTACLE | ROBOT | (sum(MODELS) & ~model)


def as_robot(geom: mujoco.MjsGeom, others: bool) -> None:
    """A robot's shape: touches ground and obstacles, and robots too where there are `others`."""
    geom.contype, geom.conaffinity = ROBOT, GROUND | OBSTACLE | (ROBOT if others else 0)


def as_tyre(geom: mujoco.MjsGeom) -> None:
    """The sphere with which a drive wheel meets the ground, and nothing else."""
    geom.contype, geom.conaffinity = 0, GROUND


def as_rim(geom: mujoco.MjsGeom, others: bool) -> None:
    """A drive wheel's own shape: touches all but the ground."""
    geom.contype, geom.conaffinity = ROBOT, OBSTACLE | (ROBOT if others else 0)


def with_own_kind(geom: mujoco.MjsGeom) -> None:
    """Touches those links of its own robot that are marked so too."""
    geom.contype |= SELF
    geom.conaffinity |= SELF
