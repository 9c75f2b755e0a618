"""Watches whether a robot touches anything except the ground, at every physics step."""

from __future__ import annotations

import mujoco

from kbot.sim import Simulation
from kbot.sim.collisions import Collisions


class CollisionWatch:
    """Watches a simulation's first robot for collisions until it is closed.

    `collided` becomes true when the robot touches anything except the ground, as `Collisions` defines it.
    `Simulation.collided` is cheaper, but it looks only every 0.08 s.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._collisions = Collisions(simulation.robots)
        self.collided = False
        simulation.stepping.watchers.append(self._look)

    def close(self) -> None:
        """Stop watching."""
        if self._look in self._simulation.stepping.watchers:
            self._simulation.stepping.watchers.remove(self._look)

    def _look(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        if self._collisions.touched(model, data):
            self.collided = True
            self.close()
