"""Saves, restores and resets the state of a simulation. A run continues from a saved state bit for bit."""

from __future__ import annotations

import hashlib
import reprlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief, brief
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.disturbances import BodyWrench, Disturbances
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.welds import Weld
from kbot.sim.journal import Journal
from kbot.sim.models import Models
from kbot.sim.robot import SavedRobot
from kbot.sim.robots import Robots
from kbot.sim.stepping import Stepping
from kbot.text import KbotError
from kbot.world import World

_EVERYTHING = mujoco.mjtState.mjSTATE_INTEGRATION
"""All that the next step depends on if no body sleeps. With MuJoCo's FULLPHYSICS a restored run differs by
2e-12."""
_AWAKE_COUNTS = ("ntree_awake", "nbody_awake", "nparent_awake", "nv_awake")
"""The engine counts what is awake only when something falls asleep or wakes."""


@dataclass(frozen=True, slots=True)
class EngineResults:
    """What the engine computed in its last step, without contacts and constraints.

    A copy of the engine's `MjData` would take 0.5 MB even for a small robot, and 14 MB of address space for
    its stack. A page keeps hundreds of snapshots.
    """

    shapes: tuple[tuple[str, tuple[int, ...]], ...]
    """The names of the arrays, and their shapes."""
    arrays: bytes
    """Their values one after the other."""
    awake: tuple[int, ...]
    """The values of `_AWAKE_COUNTS`."""


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot(Brief):
    """A saved state of a simulation.

    - `vector`: the engine's state.
    - `results`: those of the engine's last step, because the vector does not include which bodies sleep, and
      the engine does not compute the results of a sleeping body again.
    - `robots`: the state of each robot's controllers, by name.
    - `pushes`, `welds`: those that were active.
    - `built`: the world before anything was spawned or deleted.
    - `world`, `changes`: the world at that time, and what was spawned and deleted until then.
    - `noted`: the number of actions in the journal.

    A snapshot does not contain scheduled faults: they depend on time only, so they act again after a restore.
    It does not contain the state of subscribers, sensors and navigation either.
    """

    steps: int
    vector: NDArray[np.float64]
    results: EngineResults
    robots: dict[str, SavedRobot]
    pushes: tuple[BodyWrench, ...]
    welds: tuple[Weld, ...]
    random: dict[str, Any]  # the state of a numpy generator
    built: World
    world: World
    changes: tuple[tuple[str, dict[str, object]], ...]
    noted: int

    @property
    def size(self) -> int:
        """Bytes in memory, approximately."""
        return self.vector.nbytes + len(self.results.arrays)

    def _shown(self) -> Iterator[str]:
        yield f"steps={self.steps}"
        yield f"robots={brief(list(self.robots))}"
        yield f"world={self.world.name!r}"


class Snapshots(Brief):
    """Saves, restores and resets all parts of one simulation."""

    def __init__(
        self,
        engine: Engine,
        commands: CommandDelivery,
        robots: Robots,
        disturbances: Disturbances,
        models: Models,
        stepping: Stepping,
        journal: Journal,
    ) -> None:
        self._engine, self._commands, self._robots = engine, commands, robots
        self._disturbances, self._models = disturbances, models
        self._stepping, self._journal = stepping, journal
        self._results_of: mujoco.MjModel | None = None
        self._shapes: tuple[tuple[str, tuple[int, ...]], ...] = ()
        """The arrays in `EngineResults` of the model `_results_of`."""

    def take(self) -> Snapshot:
        """Save everything that determines how the run continues."""
        return Snapshot(
            self._engine.steps,
            _read(self._engine.model, self._engine.data),
            self._results(),
            {name: robot.save() for name, robot in self._robots.items()},
            self._disturbances.pushes,
            self._engine.assembly.welds,
            dict(self._commands.random.bit_generator.state),
            self._models.built,
            self._engine.world,
            tuple(self._journal.changes),
            self._journal.count,
        )

    def restore(self, state: Snapshot) -> None:
        """Restore a saved state and its objects. The run continues from it bit for bit.

        Raises:
            KbotError: the state is from another simulation, or robots were spawned or deleted since.
        """
        if not isinstance(state, Snapshot):
            raise KbotError(f"a state must be a result of Simulation.state(), not {reprlib.repr(state)}")
        engine = self._engine
        assembly, before = engine.assembly, engine.steps
        has_same_robots = set(state.robots) == set(self._robots)
        if state.built is self._models.built and has_same_robots and state.world is not assembly.world:
            assembly = assembly.with_world(state.world)
        if state.welds != assembly.welds:
            assembly = assembly.with_welds(state.welds)
        if not has_same_robots or state.results.shapes != self._shapes_of(assembly.model):
            raise KbotError("the state is from a simulation with other robots or another world")
        if assembly is not engine.assembly:
            self._models.use(assembly)
        self._use(state)
        for name, robot in self._robots.items():
            robot.restore(state.robots[name])
        self._disturbances.pushes = state.pushes  # the vector contains their forces
        self._commands.random.bit_generator.state = state.random
        self._journal.changes[:] = state.changes
        self._stepping.jump(state.steps)
        self._journal.note("restore", after=before, to=state.steps, noted=state.noted)

    def reset(self) -> None:
        """Reset to time 0: the same robots and world, without commands and attachments."""
        self._reset_models()
        self._commands.restart()
        self._stepping.jump(0)
        self._journal.note("reset")

    def reset_world(self) -> None:
        """Reset everything except the time and the random numbers."""
        time = self._engine.data.time
        self._reset_models()
        self._engine.data.time = time
        self._stepping.jump(self._engine.steps)
        self._journal.note("reset_world")

    def reset_time(self) -> None:
        """Set only the time to 0. Scheduled faults start again at their times."""
        steps = self._engine.steps
        self._engine.data.time = 0.0
        self._disturbances.shift_time(steps)
        for robot in self._robots.values():
            robot.shift_time(steps)
        self._stepping.jump(0)
        self._journal.note("reset_time", after=steps)

    def sha256(self) -> str:
        """Digest of the engine's state. Equal runs have equal digests."""
        return hashlib.sha256(
            _read(self._engine.model, self._engine.data).astype("<f8").tobytes()
        ).hexdigest()

    def _results(self) -> EngineResults:
        data, shapes = self._engine.data, self._shapes_of(self._engine.model)
        arrays = b"".join([getattr(data, name).tobytes() for name, _ in shapes])
        return EngineResults(shapes, arrays, tuple(getattr(data, name) for name in _AWAKE_COUNTS))

    def _shapes_of(self, model: mujoco.MjModel) -> tuple[tuple[str, tuple[int, ...]], ...]:
        if self._results_of is not model:
            self._results_of, self._shapes = model, _shapes(model)
        return self._shapes

    def _use(self, state: Snapshot) -> None:
        model, data = self._engine.model, self._engine.data
        mujoco.mj_resetData(model, data)  # deletes the contacts, which the next step finds again
        at = 0
        for name, _ in state.results.shapes:
            array = getattr(data, name)
            array.flat = np.frombuffer(state.results.arrays, array.dtype, array.size, at)
            at += array.nbytes
        for name, count in zip(_AWAKE_COUNTS, state.results.awake, strict=True):
            setattr(data, name, count)
        mujoco.mj_setState(model, data, state.vector, _EVERYTHING)

    def _reset_models(self) -> None:
        if self._engine.assembly.welds:
            self._models.use(self._engine.assembly.with_welds(()))
        mujoco.mj_resetData(self._engine.model, self._engine.data)
        self._engine.mark_moved()
        self._disturbances.pushes = ()
        for robot in self._robots.values():
            robot.restart()


def _shapes(model: mujoco.MjModel) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """The names and shapes of the engine's arrays whose sizes do not change during a run.

    The sizes of others, such as contacts, change. They are empty before the first step.
    """
    data = mujoco.MjData(model)
    arrays = {name: getattr(data, name) for name in dir(data)}
    return tuple((n, a.shape) for n, a in arrays.items() if isinstance(a, np.ndarray) and a.size)


def _read(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """The engine's state as one vector."""
    vector = np.empty(mujoco.mj_stateSize(model, _EVERYTHING))
    mujoco.mj_getState(model, data, vector, _EVERYTHING)
    return vector
