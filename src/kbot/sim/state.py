"""A simulation's whole state: from it a run goes on bit for bit."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.sim.disturbances import Push
from kbot.sim.engine.welds import Weld
from kbot.text import KbotError
from kbot.world import World

_EVERYTHING = mujoco.mjtState.mjSTATE_INTEGRATION
"""What the next step depends on; the smaller sets differ in the last bits after a restore."""


@dataclass(frozen=True, eq=False)
class State:
    """`vector`: the engine's state; `engine`: a copy of all the engine holds, for what lies asleep is not
    in the vector; `robots`: what each robot's controllers hold, by name; `pushes` that still act and `welds`
    that hold; `built`: the world as it was at first, `world` and `changes`: as it is, and what came and
    went; `noted`: how much was journalled until then."""

    steps: int
    vector: NDArray[np.float64]
    engine: Any
    robots: dict[str, tuple[Any, ...]]
    pushes: tuple[Push, ...]
    welds: tuple[Weld, ...]
    random: dict[str, Any]
    built: World
    world: World
    changes: tuple[tuple[str, dict[str, Any]], ...]
    noted: int

    @property
    def size(self) -> int:
        """Bytes held, about."""
        return int(self.vector.nbytes + self.engine.nbuffer + self.engine.maxuse_arena)


def copy_engine(model: Any, data: Any) -> Any:
    """All that the engine holds."""
    copy = mujoco.MjData(model)
    mujoco.mj_copyData(copy, model, data)
    return copy


def restore_engine(model: Any, data: Any, copy: Any) -> None:
    """Raises KbotError where the copy is of another model."""
    try:
        mujoco.mj_copyData(data, model, copy)
    except mujoco.FatalError:
        raise KbotError("the state is that of another robot or world") from None


def read_engine(model: Any, data: Any) -> NDArray[np.float64]:
    """The engine's state as one vector."""
    vector = np.empty(mujoco.mj_stateSize(model, _EVERYTHING))
    mujoco.mj_getState(model, data, vector, _EVERYTHING)
    return vector


def digest(vector: NDArray[np.float64]) -> str:
    """SHA-256 of the vector's bytes, little-endian."""
    return hashlib.sha256(vector.astype("<f8").tobytes()).hexdigest()
