"""Report objects that fell off the floor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kbot.sim import Simulation
from kbot.workbench.driving.world_actions import model_of
from kbot.workbench.protocol import FallenView

if TYPE_CHECKING:
    import mujoco

BELOW = 0.1
"""Metres below the lowest static point at which an object counts as fallen."""


class OutOfWorld:
    """Detects objects that fall off the floor, and when."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        self._model: mujoco.MjModel | None = None
        self._lowest = 0.0
        self._since: dict[str, float] = {}
        self.fallen: tuple[FallenView, ...] = ()

    def update(self) -> None:
        """Update `fallen` to the current time of the simulation."""
        model, data = self._sim.engine.current()
        if model is not self._model:
            self._model, self._lowest = model, _lowest(model, data)
        heights = data.xipos[:, 2]
        deepest = self._lowest - BELOW
        found: dict[str, float] = {}
        if heights[1:].min(initial=deepest) < deepest:  # body 0 is the world
            highest: dict[str, float] = {}
            for index in range(1, model.nbody):
                owner = self._owner(model.body(index).name)
                highest[owner] = max(highest.get(owner, -np.inf), float(heights[index]))
            found = {owner: z for owner, z in highest.items() if z < deepest}
        time = self._sim.time
        self._since = {name: min(self._since.get(name, time), time) for name in found}
        self.fallen = tuple(
            FallenView(name, round(self._since[name], 3), round(z, 1)) for name, z in found.items()
        )

    def _owner(self, body: str) -> str:
        """Return the robot or object that a body belongs to. The name of the robot on display is empty."""
        owner = model_of(self._sim, body.removeprefix("/")).partition("::")[0]
        return "" if owner == self._sim.robots.first.name else owner


def _lowest(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Return the height in m of the lowest static point, or 0 if nothing is static."""
    still = np.flatnonzero(model.body_weldid[model.geom_bodyid] == 0)
    if len(still) == 0:
        return 0.0
    centre, half = model.geom_aabb[still, :3], model.geom_aabb[still, 3:]
    up = data.geom_xmat[still].reshape(-1, 3, 3)[:, 2]
    z = data.geom_xpos[still, 2] + (up * centre).sum(axis=1) - (np.abs(up) * half).sum(axis=1)
    is_plane = model.geom_type[still] == 0  # the bounding box of a plane is infinite
    return float(np.where(is_plane, data.geom_xpos[still, 2], z).min())
