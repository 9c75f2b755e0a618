"""What a simulation is made of, but for its robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbot.kinematics.odometry import PlanarPose
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.naming import Naming
from kbot.sim.numbers import FURTHEST, is_finite, shortened, vector
from kbot.sim.recipe import Contacts
from kbot.text import KbotError
from kbot.world import World


@dataclass(frozen=True, slots=True)
class Setup:
    """As `Simulation` is given it; `timestep` in seconds.

    Raises:
        KbotError: a step, a seed, a start, or limits, that are none.
    """

    world: World
    seed: int
    timestep: float
    contacts: Contacts
    limits: DriveLimits | None
    start: PlanarPose
    naming: Naming

    def __post_init__(self) -> None:
        start, limits, seed, timestep = self.start, self.limits, self.seed, self.timestep
        if not isinstance(start, PlanarPose):
            raise KbotError(f"a start is a PlanarPose(x, y, yaw) in m and rad, not {shortened(start)}")
        if not (limits is None or isinstance(limits, DriveLimits)):
            raise KbotError(f"limits are DriveLimits(linear_velocity=...), not {shortened(limits)}")
        vector("a start", (start.x, start.y, start.yaw), FURTHEST)
        if not (is_finite(timestep) and 1e-5 <= timestep <= 0.02):
            raise KbotError(f"a step is 0.00001 to 0.02 seconds long, not {timestep!r}")
        if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
            raise KbotError(f"a seed is a whole number from 0 on, not {seed!r}")
