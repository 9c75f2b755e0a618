"""Contacts: which shapes touch each other, with which friction and stiffness.

In MuJoCo two geometries touch if the `contype` of one and the `conaffinity` of the other have a bit in
common. A contact takes its parameters from the geometry with the higher priority. Here lower friction gives a
higher priority, so that the surface with less friction decides, as in Gazebo's ODE.
"""

from __future__ import annotations

from math import sqrt

import mujoco

from kbot.sim.recipe import SKID_DAMPING, SKID_IMPRATIO, SKID_SOLIMP, SOLIMP, SOLREF

GROUND = 1
OBSTACLE = 2
ROBOT = 4
SELF = 8
"""Links of one robot with self-collision."""

FLOOR = 16
WALL = 32
"""Planes have bits of their own, ground `FLOOR` and obstacles `WALL`, because cylinders do not touch them
(`plane_contacts.py`)."""
PLANES = FLOOR | WALL
GROUNDS = GROUND | FLOOR
OBSTACLES = OBSTACLE | WALL

SPRING = 0.9
"""Impedance of a contact that acts as a spring. With less, robots creep down slopes."""

MODELS = tuple(1 << bit for bit in range(6, 31))
"""The other bits: one per model, so that the bodies of a model do not touch each other."""

STIFFEST = 2e5
"""Highest stiffness per mass in 1/s^2 that is stable at the default time step."""

FRICTIONLESS = 1e-4
"""Below this coefficient a contact has no friction (condim 1)."""


def set_surface(geom: mujoco.MjsGeom, friction: float) -> None:
    """Make a stiff contact with sliding friction, without torsional or rolling friction."""
    geom.solref = SOLREF
    geom.solimp = SOLIMP
    geom.friction = (max(friction, 0.0), 0.0, 0.0)
    geom.priority, geom.condim = rank(friction)


def set_spring(geom: mujoco.MjsGeom, stiffness: float, damping: float, mass: float) -> None:
    """Make a contact that acts as a spring of `stiffness` (N/m) and `damping` (N s/m).

    Each contact of the robot of `mass` (kg) sinks in by its share of the weight. The damping is at least
    critical, so that it does not bounce. The stiffness is at most what the time step allows.

    MuJoCo's stiffness is in 1/s^2: at an impedance of d, a contact at rest sinks in by (1 - d) g / k.
    """
    per_mass = min(stiffness * (1.0 - SPRING) / mass, STIFFEST)
    least = 2.0 * sqrt(per_mass)
    geom.solref = (-per_mass, -min(max(damping * (1.0 - SPRING) / mass, least), 2.0 * sqrt(STIFFEST)))
    geom.solimp = (SPRING, SPRING, 0.001, 0.5, 2.0)
    # solmix is the weight of a geometry in the mean of both: the spring decides
    geom.solmix = 1e6


def rank(friction: float) -> tuple[int, int]:
    """The priority and the number of contact dimensions (condim) for a coefficient of friction."""
    return round(1e6 / (1.0 + max(friction, 0.0))), 3 if friction >= FRICTIONLESS else 1


def as_ground(geom: mujoco.MjsGeom) -> None:
    """Make a shape to drive on. It touches robots and moving bodies."""
    geom.contype, geom.conaffinity = FLOOR if geom.type == mujoco.mjtGeom.mjGEOM_PLANE else GROUND, 0


def as_obstacle(geom: mujoco.MjsGeom, moving: bool) -> None:
    """Make an obstacle. It touches robots and moving bodies. If it moves itself, it touches everything."""
    geom.contype = WALL if geom.type == mujoco.mjtGeom.mjGEOM_PLANE else OBSTACLE
    geom.conaffinity = GROUNDS | OBSTACLES if moving else 0


def as_part_of(geom: mujoco.MjsGeom, model: int) -> None:
    """Make a shape of a model (one of `MODELS`): a moving obstacle that does not touch its own model."""
    geom.contype, geom.conaffinity = model, GROUNDS | OBSTACLES | ROBOT | (sum(MODELS) & ~model)


def as_robot(geom: mujoco.MjsGeom, others: bool) -> None:
    """Make a robot's shape. It touches ground and obstacles, and if there are `others`, robots too."""
    geom.contype, geom.conaffinity = ROBOT, GROUNDS | OBSTACLES | (ROBOT if others else 0)


def as_tyre(geom: mujoco.MjsGeom) -> None:
    """Make the sphere of a drive wheel. It touches only the ground."""
    geom.contype, geom.conaffinity = 0, GROUNDS


def add_skidding(
    spec: mujoco.MjSpec, ground: mujoco.MjsGeom, tyre: mujoco.MjsGeom, across: float, along: float
) -> None:
    """Let a tyre slide over a shape of the ground, with friction across and along its rolling direction.

    The lower friction of ground and tyre applies. Only a plane aligns a contact with the axis of a capsule:
    on other shapes of the ground, the lower of both applies in all directions.
    """
    if ground.type != mujoco.mjtGeom.mjGEOM_PLANE:
        across = along = min(across, along)
    most = float(ground.friction[0])
    pair = spec.add_pair(geomname1=ground.name, geomname2=tyre.name)
    pair.friction = (min(across, most), min(along, most), 0.0, 0.0, 0.0)
    pair.condim = rank(max(pair.friction[0], pair.friction[1]))[1]
    pair.solref = SOLREF
    if along > 0.0:
        pair.solimp = SKID_SOLIMP
        pair.solreffriction = (-1.0, -SKID_DAMPING)
        spec.option.impratio = SKID_IMPRATIO
    else:  # the tyre slides along its rolling direction only, as if it rolled
        pair.solimp = SOLIMP


def as_rim(geom: mujoco.MjsGeom, others: bool) -> None:
    """Make a drive wheel's own shape. It touches everything except the ground."""
    geom.contype, geom.conaffinity = ROBOT, OBSTACLES | (ROBOT if others else 0)


def with_self_collision(geom: mujoco.MjsGeom) -> None:
    """Let a shape also touch the links of its own robot that have self-collision."""
    geom.contype |= SELF
    geom.conaffinity |= SELF
