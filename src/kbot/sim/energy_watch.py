"""Finds jumps in a robot's velocity that no force explains: errors of the physics engine.

Contacts, friction and gravity only convert or remove mechanical energy. Only motors and pushes add some. So a
robot that becomes much faster within 0.02 s, while the energy of everything that moves rises by more than the
motors can give, was moved by an error of the simulation, such as a contact that does not exist.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.sim.disturbances import Disturbances
from kbot.sim.engine.assembly import DEEP
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.recipe import CONTROL_PERIOD
from kbot.sim.robot import SimulatedRobot
from kbot.sim.statics import mass_of

CHANGE = 2.0
"""Change of velocity in m/s within a control period from which the energy is computed, and least speed that
the additional energy gives the robot.

Gravity and friction with a coefficient of 1 change the velocity by 0.2 m/s each, so that ordinary driving
never gets there. A robot that is fired at a wall at 7 m/s enters it by 14 mm in a time step, and gains up to
1.7 m/s when it is pushed out.
"""
_NOISE = 0.2
"""Share of the kinetic energy that an impact may add, because the engine solves impacts in steps."""
_PUSHED_OUT = 1.0
"""Seconds after something was moved within which contacts push out what overlaps."""


@dataclass(frozen=True, slots=True)
class Jump:
    """Between `since` and `until` (s) the robot's velocity changed by `change` (m/s), and the energy of
    everything that moves rose by more than motors can give."""

    since: float
    until: float
    change: float


class EnergyWatch:
    """Watches the first robot, which must not be fixed to the world. `jump` is the first one, or None."""

    def __init__(self, engine: Engine, disturbances: Disturbances) -> None:
        self._engine, self._disturbances = engine, disturbances
        self.jump: Jump | None = None
        self._seen: tuple[int, str] | None = None
        self._moved_at = engine.time
        self._velocity = (0.0, 0.0, 0.0)

    def look(self, robot: SimulatedRobot) -> None:
        """Call this every control period."""
        if self.jump is not None:
            return
        engine, data = self._engine, self._engine.data
        before, self._velocity = self._velocity, robot.body.root_velocity
        seen = engine.moves, self._disturbances.last
        if seen != self._seen:
            if self._seen is None or self._seen[0] != engine.moves:
                self._moved_at = engine.time
            self._seen = seen
            self._positions, self._speeds = data.qpos.copy(), data.qvel.copy()
            return
        (x, y, z), (u, v, w) = before, self._velocity
        change = (u - x) ** 2 + (v - y) ** 2 + (w - z) ** 2
        # a push may do any work
        if change > CHANGE * CHANGE and not self._disturbances.pushes and self._is_impossible(robot):
            time = engine.time
            self.jump = Jump(time - CONTROL_PERIOD, time, float(change**0.5))
        self._positions[:] = data.qpos
        self._speeds[:] = data.qvel

    def _is_impossible(self, robot: SimulatedRobot) -> bool:
        model, now = self._engine.model, self._engine.data
        if not (np.isfinite(now.qpos).all() and np.isfinite(now.qvel).all()):
            return False  # the run has diverged
        trial = mujoco.MjData(model)
        potential, kinetic = _energy(model, trial, self._positions, self._speeds)
        overlaps = (trial.contact.dist < -DEEP) & np.isin(
            trial.contact.geom, own_geometries(model, robot.name)
        ).any(axis=1)
        if self._engine.time < self._moved_at + _PUSHED_OUT and overlaps.any():
            return False  # W111: it was put into something
        speeds = np.abs(trial.actuator_velocity)
        later = sum(_energy(model, trial, now.qpos, now.qvel))
        allowed = _NOISE * kinetic + 0.5 * mass_of(model, robot) * CHANGE**2
        work = _work(model, np.maximum(speeds, np.abs(trial.actuator_velocity)))
        return bool(later - potential - kinetic > allowed + work)


def _work(model: mujoco.MjModel, speeds: NDArray[np.float64]) -> float:
    """The most work in J that motors at these speeds can do in a control period."""
    most = np.where(model.actuator_forcelimited > 0, np.abs(model.actuator_forcerange).max(axis=1), inf)
    with np.errstate(invalid="ignore"):  # a motor without a limit that stands still
        return float(np.nansum(most * speeds)) * CONTROL_PERIOD


def _energy(
    model: mujoco.MjModel,
    trial: mujoco.MjData,
    positions: NDArray[np.float64],
    speeds: NDArray[np.float64],
) -> tuple[float, float]:
    """The potential and the kinetic energy in J."""
    trial.qpos[:], trial.qvel[:] = positions, speeds
    mujoco.mj_fwdPosition(model, trial)
    mujoco.mj_fwdVelocity(model, trial)
    mujoco.mj_energyPos(model, trial)
    mujoco.mj_energyVel(model, trial)
    potential, kinetic = trial.energy.tolist()
    return potential, kinetic
