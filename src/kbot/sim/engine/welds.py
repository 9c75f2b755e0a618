"""Welds links and objects that are attached to each other, at their current poses."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from kbot.kinematics.transform import Transform
from kbot.sim.engine.world_builder import body_pose
from kbot.sim.recipe import SOLIMP

STATIC = "world"
"""The engine's name of the body that contains everything static."""
STEPS_TO_CLOSE = 2.0
"""Time constant of a weld in steps: the smallest that MuJoCo recommends for stability."""


@dataclass(frozen=True, slots=True)
class Weld:
    """An attachment of two bodies, by their names in the engine."""

    first: str
    second: str
    first_from_second: Transform


def weld_at_current_pose(model: mujoco.MjModel, data: mujoco.MjData, first: str, second: str) -> Weld:
    """A weld of two bodies at their current poses. The engine's frames must be up to date."""
    world_from_first, world_from_second = (body_pose(data, model.body(name).id) for name in (first, second))
    return Weld(first, second, world_from_first.inverse() @ world_from_second)


def add_weld(spec: mujoco.MjSpec, weld: Weld, timestep: float) -> None:
    """Hold the second body at its pose in the first's frame. The two do not collide with each other."""
    x, y, z, w = weld.first_from_second.quaternion_xyzw
    equality = spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY)
    equality.name1, equality.name2 = weld.first, weld.second
    # anchor, position, quaternion, weight of rotation against translation (mjEQ_WELD's torquescale)
    equality.data[:11] = (0.0, 0.0, 0.0, *weld.first_from_second.translation, w, x, y, z, 1.0)
    equality.solref = (STEPS_TO_CLOSE * timestep, 1.0)
    equality.solimp = SOLIMP
    if STATIC not in (weld.first, weld.second):
        spec.add_exclude(bodyname1=weld.first, bodyname2=weld.second)
