"""Welds links and objects that are attached to each other, at their current poses."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from kbot.kinematics.transform import Transform
from kbot.sim.engine.world_builder import body_pose
from kbot.sim.recipe import SOLIMP

STANDING = "world"
"""The engine's name of the body that all that stands still is part of."""
STEPS_TO_CLOSE = 2.0
"""Time constant of a weld in steps; the engine is stable from there on."""


@dataclass(frozen=True, slots=True)
class Weld:
    """`first` and `second` are bodies by the engine's names."""

    first: str
    second: str
    first_from_second: Transform


def weld_as_it_stands(model: mujoco.MjModel, data: mujoco.MjData, first: str, second: str) -> Weld:
    """Two bodies as they stand now; the engine's frames must be up to date."""
    one, two = (body_pose(data, model.body(name).id) for name in (first, second))
    return Weld(first, second, one.inverse() @ two)


def add_weld(spec: mujoco.MjSpec, weld: Weld, timestep: float) -> None:
    """Hold the second body at its place in the first's frame; the two do not touch each other."""
    x, y, z, w = weld.first_from_second.quaternion_xyzw
    equality = spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY)
    equality.name1, equality.name2 = weld.first, weld.second
    # anchor, place, quaternion, weight of turning against moving in 1/m
    equality.data[:11] = (0.0, 0.0, 0.0, *weld.first_from_second.translation, w, x, y, z, 1.0)
    equality.solref = (STEPS_TO_CLOSE * timestep, 1.0)
    equality.solimp = SOLIMP
    if STANDING not in (weld.first, weld.second):
        spec.add_exclude(bodyname1=weld.first, bodyname2=weld.second)
