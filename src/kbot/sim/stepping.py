"""Advances time: physics steps, control periods, timers and disturbances."""

from __future__ import annotations

import math
import reprlib
import threading
import time
from collections.abc import Callable, Iterator
from typing import Protocol

import mujoco
import numpy as np

from kbot.brief import Brief, counted
from kbot.messages.clock import NEVER, Clock
from kbot.sim import recipe
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.disturbances import Disturbances
from kbot.sim.divergence import diverged, engine_failed
from kbot.sim.engine.engine import Engine
from kbot.sim.motion_watch import MotionWatch
from kbot.sim.numbers import FASTEST, LONGEST, is_within
from kbot.sim.robots import Robots
from kbot.text import KbotError

_WHOLE = (int, np.integer)


class Pace(Protocol):
    """Slows a program's steps down to real time, for a page that shows them."""

    def wait(self, steps: int) -> int:
        """Wait until the next steps are due. Returns how many may be made then, at most `steps`."""
        ...


_MOST_STEPS = 10**14
"""The longest time, `LONGEST`, at the smallest time step of 1e-5 s."""
_ROUNDING = 1e-6
"""The share of a time step up to which a time counts as 0. `sim.run(5.0 - sim.time)` must work if the
difference is only a rounding error. In a run of a day, that is at most 1.5e-11 s."""


class Stepping(Brief):
    """Advances the engine, and updates robots, topics and timers at their steps.

    The engine makes many steps in one call. Such a chunk ends where a control period, a timer, a new wheel
    speed or a disturbance is due. So the result does not depend on how a run is split into calls.
    """

    def __init__(
        self,
        engine: Engine,
        clock: Clock,
        commands: CommandDelivery,
        robots: Robots,
        disturbances: Disturbances,
        watch: MotionWatch,
        inside: str,
    ) -> None:
        """`inside` names the body that the first robot overlaps at the start, or is empty."""
        self._watch = watch
        self._engine, self._clock, self._commands = engine, clock, commands
        self._robots, self._disturbances, self._inside = robots, disturbances, inside
        self.watchers: list[Callable[[mujoco.MjModel, mujoco.MjData], None]] = []
        """Called after every step with the engine's model and data, which they must not change.

        With watchers, the engine makes single steps, each with a Python call.
        """
        self.was_called = False
        """Whether the program has called `step` or `run`."""
        self.emptied = -math.inf
        """When `step` or `run` was last called for 0 steps, by `time.monotonic`."""
        self.pace: Pace | None = None
        """Called before steps while a page shows the run. Otherwise steps are made as fast as possible."""
        self._period = max(1, round(recipe.CONTROL_PERIOD / engine.timestep))
        self._nanoseconds = engine.timestep * 1e9
        self._in_use = threading.RLock()
        """Held during a step: the engine must not be entered by two threads. A callback may step again."""

    def step(self, n: int = 1) -> None:
        """Advance by `n` steps.

        Raises:
            KbotError: `n` is not a whole number of at least 0.
            SimulationDiverged: a link flew off. The error names the time, the link and the likely cause.
        """
        if not isinstance(n, _WHOLE) or not 0 <= n <= _MOST_STEPS:
            raise KbotError(
                f"the number of steps must be a whole number from 0 to {_MOST_STEPS:g}, not {reprlib.repr(n)}"
            )
        self.was_called = True
        if n == 0:
            self.emptied = time.monotonic()
        while self.pace is not None and (allowed := self.pace.wait(n)) < n:
            self._step(allowed)
            n -= allowed
        self._step(n)

    def _step(self, n: int) -> None:
        engine = self._engine
        if not self._in_use.acquire(blocking=False):
            raise KbotError("another thread is stepping this simulation. Step it on one thread at a time")
        try:
            self._step_alone(engine, n)
        finally:
            self._in_use.release()

    def _step_alone(self, engine: Engine, n: int) -> None:
        if engine.failure is not None:
            raise engine.failure
        self._robots.find_subscribers(round(engine.steps * self._nanoseconds) + 1)
        if self._clock.next_due != self._planned_timer or self._disturbances.due != self._planned_disturbance:
            self._plan_stop()
        try:
            self._advance(n)
        except mujoco.FatalError as error:
            engine.failure = engine_failed(error, engine.time)
            raise engine.failure from None
        self._clock.advance_to(round(engine.steps * self._nanoseconds))

    def run(self, seconds: float) -> None:
        """Advance by a time, rounded to whole steps.

        Raises:
            KbotError: as for `steps_in`.
            SimulationDiverged: as for `step`.
        """
        self.step(self.steps_in(seconds))

    def steps_in(self, seconds: float) -> int:
        """The number of steps nearest to a time.

        Raises:
            KbotError: the time is negative or not finite, or it is above 0 and rounds to no step.
        """
        if not (is_within(seconds, LONGEST) and seconds >= 0.0):
            raise KbotError(
                f"the time to run must be from 0 to {LONGEST:g} seconds, not {reprlib.repr(seconds)}"
            )
        timestep = self._engine.timestep
        steps = round(seconds / timestep)
        if steps == 0 and seconds > _ROUNDING * timestep:
            raise KbotError(
                f"the time to run, {seconds:g} s, rounds to no step: the time step is {timestep:g} s. Run for"
                f" at least {timestep:g} s, or create the simulation with a smaller timestep"
            )
        return steps

    def jump(self, steps: int) -> None:
        """Continue as if `steps` steps had been made."""
        engine = self._engine
        engine.steps = steps
        engine.failure = None
        engine.mark_moved()
        self._next_period = (steps // self._period + 1) * self._period
        self._commands.following = [robot for robot in self._robots.values() if robot.is_following]
        self._clock.set(round(steps * self._nanoseconds))
        self._disturbances.jump()
        self._watch.restart()
        self._plan_stop()

    def _advance(self, n: int) -> None:
        engine, commands, mj_step = self._engine, self._commands, mujoco.mj_step
        while n > 0:
            count = self._next_stop - engine.steps
            if count > n:
                count = n
            if commands.following and (due := commands.advance(engine.steps)) < count:
                count = due
            if self.watchers:
                self._step_watched(count)
            else:
                mj_step(engine.model, engine.data, count)
            engine.is_fresh = False
            engine.steps += count
            n -= count
            if engine.steps == self._next_stop:
                self._stop()

    def _step_watched(self, count: int) -> None:
        model, data = self._engine.model, self._engine.data
        for _ in range(count):
            mujoco.mj_step(model, data)
            for watch in tuple(self.watchers):
                watch(model, data)

    def _plan_stop(self) -> None:
        """Find the step at which a control period, a timer or a disturbance is due next."""
        steps = self._engine.steps
        self._planned_timer: int = self._clock.next_due
        self._planned_disturbance = self._disturbances.due
        self._next_stop = self._next_period
        if self._planned_timer < NEVER:
            due = math.ceil(self._planned_timer / self._nanoseconds - 1e-6)
            self._next_stop = min(self._next_period, max(due, steps + 1))
        if self._planned_disturbance < self._next_stop:
            self._next_stop = max(self._planned_disturbance, steps + 1)

    def _stop(self) -> None:
        """Update what is due at this step."""
        engine = self._engine
        # the comparison is false for NaN too; numpy's dot would print a warning on overflow
        if not mujoco.mju_norm(engine.qvel) < FASTEST:
            self._fail()
        if engine.steps == self._next_period:
            # before anything that can raise, because the step was made
            self._next_period += self._period
            self._robots.tick(engine.steps)
            self._watch.look()
            self._robots.publish(round(engine.steps * self._nanoseconds))
        if self._planned_timer < NEVER:
            self._clock.advance_to(round(engine.steps * self._nanoseconds))
        if engine.steps >= self._disturbances.due:
            self._disturbances.update()
        self._plan_stop()

    def _fail(self) -> None:
        engine = self._engine
        # the speeds were still plausible at the end of the last control period
        last = (engine.steps - 1) // self._period * self._period * engine.timestep
        descriptions = {name: robot.robot for name, robot in self._robots.items()}
        engine.failure = diverged(engine, descriptions, last, self._inside)
        raise engine.failure

    def _shown(self) -> Iterator[str]:
        yield counted(self._engine.steps, "step")
