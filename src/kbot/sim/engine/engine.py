"""The engine with what stands in it now."""

from __future__ import annotations

from typing import Any

import mujoco

from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.world_builder import moving_bodies


class Engine:
    """MuJoCo's `model` and `data` of the assembly that is used now."""

    def __init__(self, assembly: Assembly) -> None:
        self.use(assembly)

    def use(self, assembly: Assembly) -> None:
        """Go on with another assembly, in which whoever looked up places in the last one does so again."""
        self.assembly = assembly
        self.model: Any = assembly.model
        self.data: Any = assembly.data
        self.qvel: Any = assembly.data.qvel
        self.moving = moving_bodies(assembly.model, assembly.world)
        """The engine's indices of those bodies of the world that can move, by name."""
        self.is_fresh = False
        """Whether the frames are those of the positions; a step leaves them one behind."""

    def refresh(self) -> None:
        """Bring the frames up to the positions of now."""
        if not self.is_fresh:
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            mujoco.mj_comVel(self.model, self.data)
            self.is_fresh = True
