"""A world in simulated time: steps, control periods, timers, and what is due between them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from kbot.messages.bus import Bus
from kbot.messages.clock import NEVER, Clock
from kbot.sim import recipe
from kbot.sim.disturbances import Disturbances
from kbot.sim.divergence import SimulationDiverged, diverged, engine_failed
from kbot.sim.engine.engine import Engine
from kbot.sim.numbers import FASTEST, FURTHEST, LONGEST, is_within, shortened
from kbot.sim.robot import SimulatedRobot
from kbot.sim.topics import RobotTopics
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World

COMINGS = frozenset({"delete_model", "spawn_model", "spawn_sdf", "spawn_thing"})
_WHOLE = (int, np.integer)
_MOST_STEPS = 10**14


class Running:
    """Moves the engine on, and serves robots, topics and timers at their steps.

    A chunk of steps goes to the engine at once; it ends where a control period, a timer, a new wheel
    speed or a disturbance is due, so that how a run is cut into calls does not change it.
    """

    def __init__(self, engine: Engine, seed: int, timestep: float) -> None:
        self._engine = engine
        self.built = self.world
        """The world as it was at first."""
        self.seed = seed
        self.timestep = timestep
        self.clock = Clock()
        self.bus = Bus()
        self._random = np.random.default_rng(seed)
        self.robots: dict[str, SimulatedRobot] = {}
        """All robots by name, the first being the one that the simulation's own methods speak of."""
        self._topics: dict[str, RobotTopics] = {}
        self._lost_commands = 0.0
        self._disturbances = Disturbances(self, engine)
        self.journal: Callable[[str, dict[str, Any]], None] | None = None
        """Told of all that is done to the simulation from outside, once it is done: what, and its numbers."""
        self.tells: list[Callable[[str], None]] = []
        """Given sentences for the user: what a controller refuses or cannot reach."""
        self.noted = 0
        """How much was done to the simulation from outside; what the journal was told, if there was one."""
        self.changes: list[tuple[str, dict[str, Any]]] = []
        """What came into the world and went since it was built, as the journal has it."""
        self.attached: dict[str, Any] = {}
        """What was put on it once for all who use it, such as the sensors that its robot declares."""
        self.paused = False
        """Whether those that let time pass by the wall's clock, the page and bridges, wait."""
        self.step_watchers: list[Callable[[Any, Any], None]] = []
        """Called after every step of physics with the engine's model and data, not to be changed. While there
        are none, the engine does many steps at once."""
        self.errands: list[Callable[[], bool]] = []
        """What `run_errands` does; each says whether it did something."""
        self._tick_steps = max(1, round(recipe.CONTROL_PERIOD / timestep))
        self._step_ns = timestep * 1e9
        self._slewing: list[SimulatedRobot] = []
        self._steps = 0
        self._failure: SimulationDiverged | None = None
        self._inside = ""
        """What the first robot starts inside of, as it should not."""
        self._seen = -1
        self._heard: list[RobotTopics] = []
        """Those of the robots' topics that somebody listens to, as of the bus's change `_seen`."""

    @property
    def world(self) -> World:
        """The world as it is, with what came and without what went."""
        return self._engine.assembly.world

    def named(self, name: str | None = None) -> SimulatedRobot:
        """A robot by name, the first for None. Raises KbotError when there is no such robot."""
        if name is None:
            return next(iter(self.robots.values()))
        if not isinstance(name, str) or name not in self.robots:
            hint = did_you_mean(str(name), self.robots) or f"there are {', '.join(self.robots)}"
            raise KbotError(f"there is no robot {shortened(name)}: {hint}")
        return self.robots[name]

    @property
    def lost_commands(self) -> float:
        """Share of the commands from outside that are lost, as a fault has it."""
        return self._lost_commands

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self._steps * self.timestep

    @property
    def has_diverged(self) -> bool:
        """Whether the run left the physical: a step failed, or a thing is nowhere or further off than
        `FURTHEST`."""
        return self.has_failed or not np.abs(self.engine()[1].xpos).max() <= FURTHEST

    @property
    def has_failed(self) -> bool:
        """Whether a step failed or a thing is nowhere, so that the run goes on only after a reset."""
        if self._failure is not None:
            return True
        _, data = self.engine()
        return not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all())

    def require_sound(self) -> None:
        """Raises KbotError: the run goes on only after a reset."""
        if self.has_failed:
            raise KbotError("the run has diverged: reset it first")

    @property
    def steps(self) -> int:
        return self._steps

    def step(self, n: int = 1) -> None:
        """Go on by `n` steps.

        Raises:
            KbotError: `n` is not a whole number from 0 on.
            SimulationDiverged: the run left the physical; says when, which link, and the likely cause.
        """
        if not isinstance(n, _WHOLE) or not 0 <= n <= _MOST_STEPS:
            told = f"from 0 to {_MOST_STEPS:g}, not {shortened(n)}"
            raise KbotError(f"steps are a whole number {told}")
        if self._failure is not None:
            raise self._failure
        if self.clock.next_due != self._planned_due:
            self._plan_stop()
        try:
            self._step(n)
        except mujoco.FatalError as error:
            self._failure = engine_failed(error, self.time)
            raise self._failure from None
        self.clock.advance_to(round(self._steps * self._step_ns))

    def _step(self, n: int) -> None:
        engine, mj_step = self._engine, mujoco.mj_step
        while n > 0:
            count = self._next_stop - self._steps
            if count > n:
                count = n
            if self._slewing:
                count = min(count, self._slew())
            if self.step_watchers:
                self._step_watched(count)
            else:
                mj_step(engine.model, engine.data, count)
            engine.is_fresh = False
            self._steps += count
            n -= count
            if self._steps == self._next_stop:
                self._stop()

    def _step_watched(self, count: int) -> None:
        model, data = self._engine.model, self._engine.data
        for _ in range(count):
            mujoco.mj_step(model, data)
            for watch in tuple(self.step_watchers):
                watch(model, data)

    def run(self, seconds: float) -> None:
        """Go on by a time, rounded to whole steps.

        Raises:
            KbotError: the time is negative or not finite.
            SimulationDiverged: as for `step`.
        """
        if not (is_within(seconds, LONGEST) and seconds >= 0.0):
            raise KbotError(
                f"a time to run is a finite number of seconds from 0 to {LONGEST:g}, not {shortened(seconds)}"
            )
        self.step(round(seconds / self.timestep))

    def run_errands(self) -> bool:
        """Do what others have asked for, and say whether that was anything. Whoever lets time pass by the
        wall's clock calls this between steps, also while it is paused: an errand may reset the run, or
        change who is in it."""
        return sum(errand() for errand in tuple(self.errands)) > 0

    def pause_physics(self) -> None:
        """Let no time pass by itself: the page and bridges wait. `step` and `run` go on as they are told,
        as Gazebo's single step does, and commands are taken."""
        self.paused = True

    def unpause_physics(self) -> None:
        """Let time pass again."""
        self.paused = False

    def engine(self) -> tuple[Any, Any]:
        """The engine's model and data with frames as of now, for what measures in them; not to be changed."""
        self._engine.refresh()
        return self._engine.model, self._engine.data

    def frames_are_old(self) -> None:
        """To be called when something was moved other than by a step."""
        self._engine.is_fresh = False

    def _start_at(self, steps: int) -> None:
        """Go on from here as if this were that step."""
        self._steps = steps
        self._failure = None
        self._next_tick = (steps // self._tick_steps + 1) * self._tick_steps
        self._slewing = [robot for robot in self.robots.values() if robot._is_slewing]
        self.frames_are_old()
        self.clock.set(round(steps * self._step_ns))
        self._disturbances.jump()
        self._plan_stop()

    def _plan_stop(self) -> None:
        """Find the step at which something other than physics is due: a control period or a timer."""
        self._planned_due: int = self.clock.next_due
        self._next_stop = self._next_tick
        if self._planned_due < NEVER:
            due = math.ceil(self._planned_due / self._step_ns - 1e-6)
            self._next_stop = min(self._next_tick, max(due, self._steps + 1))
        if self._disturbances.due < self._next_stop:
            self._next_stop = max(self._disturbances.due, self._steps + 1)

    def _stop(self) -> None:
        """Do what is due at this step."""
        # false for NaN too; numpy's own dot warns where it overflows
        if not mujoco.mju_norm(self._engine.qvel) < FASTEST:
            self._fail()
        if self._steps == self._next_tick:
            self._next_tick += self._tick_steps
            for robot in self.robots.values():
                if robot._tick(self._steps):
                    self._serve(robot)
            if self.bus.changes != self._seen:
                self._seen = self.bus.changes
                self._heard = [topics for topics in self._topics.values() if topics.find_listeners()]
            if self._heard:
                self.clock.begin_moment(round(self._steps * self._step_ns))
                for topics in self._heard:
                    topics.publish(self.clock)
        if self._planned_due < NEVER:
            self.clock.advance_to(round(self._steps * self._step_ns))
        if self._steps >= self._disturbances.due:
            self._disturbances.bring_up()
        self._plan_stop()

    def _fail(self) -> None:
        # at the end of the control period before, it was looked at too
        last = (self._steps - 1) // self._tick_steps * self._tick_steps * self.timestep
        self._failure = diverged(self._engine, self.robots, self.time, last, self._inside)
        raise self._failure

    def _slew(self) -> int:
        """Serve the robots that follow a new command; steps until the next of them is due."""
        wait = self._tick_steps
        for robot in tuple(self._slewing):
            due = robot._slew(self._steps)
            if due:
                wait = min(wait, due)
            else:
                self._slewing.remove(robot)
        return wait

    def _serve(self, robot: SimulatedRobot) -> None:
        """Call a robot's `slew` when it is due, from now on."""
        if robot not in self._slewing:
            self._slewing.append(robot)

    def tell(self, text: str) -> None:
        """Tell the user, where somebody passes it on."""
        for tell in tuple(self.tells):
            tell(text)

    def _note(self, what: str, **numbers: object) -> None:
        if what in COMINGS:
            self.changes.append((what, numbers))
        if self.journal is not None:
            self.journal(what, numbers)
        self.noted += 1
