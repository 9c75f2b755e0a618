"""A simulation's whole state: from it a run goes on bit for bit."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

_EVERYTHING = mujoco.mjtState.mjSTATE_INTEGRATION
"""What the next step depends on; the smaller sets differ in the last bits after a restore."""


@dataclass(frozen=True, eq=False)
class State:
    """`engine`: the engine's vector; `robots`: what each robot's controllers hold, by name."""

    steps: int
    engine: NDArray[np.float64]
    robots: dict[str, tuple[Any, ...]]
    random: dict[str, Any]


def read_engine(model: Any, data: Any) -> NDArray[np.float64]:  # noqa: ANN401
    """The engine's state as one vector."""
    vector = np.empty(mujoco.mj_stateSize(model, _EVERYTHING))
    mujoco.mj_getState(model, data, vector, _EVERYTHING)
    return vector


def write_engine(model: Any, data: Any, vector: NDArray[np.float64]) -> None:  # noqa: ANN401
    mujoco.mj_setState(model, data, vector, _EVERYTHING)


def digest(vector: NDArray[np.float64]) -> str:
    """SHA-256 of the vector's bytes, little-endian."""
    return hashlib.sha256(vector.astype("<f8").tobytes()).hexdigest()
