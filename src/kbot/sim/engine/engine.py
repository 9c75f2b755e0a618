"""The physics engine with its current model, its step count and its failure."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief, counted
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.world_builder import moving_bodies
from kbot.sim.numbers import FURTHEST
from kbot.text import DescriptionError, KbotError
from kbot.world import World


class Engine(Brief):
    """MuJoCo's `model` and `data` of the current assembly, after `steps` steps."""

    def __init__(self, assembly: Assembly) -> None:
        self.timestep = assembly.timestep
        self.steps = 0
        self.moves = 0
        """How often something was moved, added or removed by other means than a step."""
        self.failure: DescriptionError | None = None
        """Why the last step failed. None while the run continues."""
        self.use(assembly)

    def use(self, assembly: Assembly) -> None:
        """Replace the assembly. Indices into the previous model become invalid."""
        self.moves += 1
        self.assembly = assembly
        self.model = assembly.model
        self.data = assembly.data
        self.qvel: NDArray[np.float64] = assembly.data.qvel
        self.moving = moving_bodies(assembly.model, assembly.world)
        """The engine's indices of the bodies of the world that can move, by name."""
        self.is_fresh = False
        """Whether the frames belong to the current positions. After a step they are one step behind."""

    def refresh(self) -> None:
        """Compute the frames of the current positions."""
        if not self.is_fresh:
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            mujoco.mj_comVel(self.model, self.data)
            self.is_fresh = True

    def current(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """The model and the data with current frames, to read from. Do not change them."""
        self.refresh()
        return self.model, self.data

    def mark_moved(self) -> None:
        """Call this after something was moved by other means than a step."""
        self.moves += 1
        self.is_fresh = False

    @property
    def world(self) -> World:
        """The current world, with spawned and without deleted objects."""
        return self.assembly.world

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.steps * self.timestep

    @property
    def has_failed(self) -> bool:
        """Whether a step failed, or a position or velocity is not finite. Then the run needs a reset."""
        if self.failure is not None:
            return True
        data = self.data
        return not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all())

    @property
    def has_diverged(self) -> bool:
        """Whether the run has failed or a body is further away than `FURTHEST`."""
        return self.has_failed or not np.abs(self.current()[1].xpos).max() <= FURTHEST

    def require_sound(self) -> None:
        """Raises KbotError: the run has failed and needs a reset."""
        if self.has_failed:
            raise KbotError("the run has diverged: reset it first")

    def _shown(self) -> Iterator[str]:
        yield f"{self.time:g} s"
        yield counted(self.model.nbody - 1, "body", "bodies")
