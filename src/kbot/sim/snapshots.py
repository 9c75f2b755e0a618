"""Saves, restores and resets the whole state of a simulation. A run continues from it bit for bit."""

from __future__ import annotations

import hashlib
import reprlib
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

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
"""What the next step depends on; the smaller sets differ in the last bits after a restore."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A saved state of a simulation.

    `vector`: the engine's state; `engine`: a copy of all the engine holds, since the vector lacks sleeping
    bodies; `robots`: what each robot's controllers hold, by name; `pushes` and `welds` that act; `built`: the
    world as it was built, `world` and `changes`: the world at that time and what was spawned and deleted
    until then; `noted`: how many actions the journal had counted.

    Not in it: scheduled faults, which act by time and so act again at a restored one; the subscribers of
    topics, sensors and navigation.
    """

    steps: int
    vector: NDArray[np.float64]
    engine: mujoco.MjData
    robots: dict[str, SavedRobot]
    pushes: tuple[BodyWrench, ...]
    welds: tuple[Weld, ...]
    random: dict[str, Any]  # the state of a generator, as numpy has it
    built: World
    world: World
    changes: tuple[tuple[str, dict[str, object]], ...]
    noted: int

    @property
    def size(self) -> int:
        """Bytes in memory, approximately."""
        return int(self.vector.nbytes + self.engine.nbuffer + self.engine.maxuse_arena)


class Snapshots:
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

    def take(self) -> Snapshot:
        """Save everything that the future of the run depends on."""
        model, data = self._engine.model, self._engine.data
        copy = mujoco.MjData(model)
        mujoco.mj_copyData(copy, model, data)
        return Snapshot(
            self._engine.steps,
            _read(model, data),
            copy,
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
        """Go back to a saved state, with the objects of that time. What follows is the same, bit for bit.

        Raises:
            KbotError: the state is of another simulation, or robots were spawned or deleted since.
        """
        if not isinstance(state, Snapshot):
            raise KbotError(f"a state is what Simulation.state() gave, not {reprlib.repr(state)}")
        engine = self._engine
        assembly, before = engine.assembly, engine.steps
        has_same_robots = set(state.robots) == set(self._robots)
        if state.built is self._models.built and has_same_robots and state.world is not assembly.world:
            assembly = assembly.with_world(state.world)
        if state.welds != assembly.welds:
            assembly = assembly.with_welds(state.welds)
        if not has_same_robots or len(state.vector) != len(_read(assembly.model, assembly.data)):
            raise KbotError("the state is that of another robot or world")
        if assembly is not engine.assembly:
            self._models.use(assembly)
        try:
            mujoco.mj_copyData(engine.data, engine.model, state.engine)
        except mujoco.FatalError:
            raise KbotError("the state is that of another robot or world") from None
        for name, robot in self._robots.items():
            robot.restore(state.robots[name])
        self._disturbances.pushes = state.pushes  # the copied data has their forces already
        self._commands.random.bit_generator.state = state.random
        self._journal.changes[:] = state.changes
        self._stepping.jump(state.steps)
        self._journal.note("restore", after=before, to=state.steps, noted=state.noted)

    def reset(self) -> None:
        """Go back to the start: the same robots and world at time 0, nothing attached, without commands."""
        self._reset_models()
        self._commands.restart()
        self._stepping.jump(0)
        self._journal.note("reset")

    def reset_world(self) -> None:
        """Reset all but the time and the random numbers."""
        time = self._engine.data.time
        self._reset_models()
        self._engine.data.time = time
        self._stepping.jump(self._engine.steps)
        self._journal.note("reset_world")

    def reset_time(self) -> None:
        """Set the time to 0 and nothing else; scheduled faults begin again at their times."""
        steps = self._engine.steps
        self._engine.data.time = 0.0
        self._disturbances.set_back(steps)
        for robot in self._robots.values():
            robot.set_back(steps)
        self._stepping.jump(0)
        self._journal.note("reset_time", after=steps)

    def sha256(self) -> str:
        """Digest of the engine's state; equal runs have equal ones."""
        return hashlib.sha256(
            _read(self._engine.model, self._engine.data).astype("<f8").tobytes()
        ).hexdigest()

    def _reset_models(self) -> None:
        if self._engine.assembly.welds:
            self._models.use(self._engine.assembly.with_welds(()))
        mujoco.mj_resetData(self._engine.model, self._engine.data)
        self._disturbances.pushes = ()
        for robot in self._robots.values():
            robot.restart()


def _read(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """The engine's state as one vector."""
    vector = np.empty(mujoco.mj_stateSize(model, _EVERYTHING))
    mujoco.mj_getState(model, data, vector, _EVERYTHING)
    return vector
