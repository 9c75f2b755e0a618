"""Advances time: steps of physics, control periods, timers, and disturbances that are due."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable

import mujoco
import numpy as np

from kbot.messages.clock import NEVER, Clock
from kbot.sim import recipe
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.disturbances import Disturbances
from kbot.sim.divergence import diverged, engine_failed
from kbot.sim.engine.engine import Engine
from kbot.sim.numbers import FASTEST, LONGEST, is_within
from kbot.sim.robots import Robots
from kbot.text import KbotError

_WHOLE = (int, np.integer)
_MOST_STEPS = 10**14


class Stepping:
    """Advances the engine, and serves robots, topics and timers at their steps.

    The engine makes a chunk of steps at once. A chunk ends where a control period, a timer, a new wheel speed
    or a disturbance is due, so that the result does not depend on how a run is cut into calls.
    """

    def __init__(
        self,
        engine: Engine,
        clock: Clock,
        commands: CommandDelivery,
        robots: Robots,
        disturbances: Disturbances,
        inside: str,
    ) -> None:
        """`inside`: what the first robot starts inside of, or empty."""
        self._engine, self._clock, self._commands = engine, clock, commands
        self._robots, self._disturbances, self._inside = robots, disturbances, inside
        self.watchers: list[Callable[[mujoco.MjModel, mujoco.MjData], None]] = []
        """Called after every step with the engine's model and data, which they must not change. With any of
        them, the engine makes single steps, each with a Python call."""
        self._period = max(1, round(recipe.CONTROL_PERIOD / engine.timestep))
        self._nanoseconds = engine.timestep * 1e9

    def step(self, n: int = 1) -> None:
        """Advance by `n` steps.

        Raises:
            KbotError: `n` is not a whole number from 0 on.
            SimulationDiverged: a link flew off; the error names the time, the link and the likely cause.
        """
        if not isinstance(n, _WHOLE) or not 0 <= n <= _MOST_STEPS:
            raise KbotError(f"steps are a whole number from 0 to {_MOST_STEPS:g}, not {reprlib.repr(n)}")
        engine = self._engine
        if engine.failure is not None:
            raise engine.failure
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
            KbotError: the time is negative or not finite.
            SimulationDiverged: as for `step`.
        """
        if not (is_within(seconds, LONGEST) and seconds >= 0.0):
            raise KbotError(
                f"a time to run is a finite number of seconds from 0 to {LONGEST:g},"
                f" not {reprlib.repr(seconds)}"
            )
        self.step(round(seconds / self._engine.timestep))

    def jump(self, steps: int) -> None:
        """Go on as if `steps` steps had been made."""
        engine = self._engine
        engine.steps = steps
        engine.failure = None
        engine.mark_moved()
        self._next_period = (steps // self._period + 1) * self._period
        self._commands.following = [robot for robot in self._robots.values() if robot.is_following]
        self._clock.set(round(steps * self._nanoseconds))
        self._disturbances.jump()
        self._plan_stop()

    def _advance(self, n: int) -> None:
        engine, commands, mj_step = self._engine, self._commands, mujoco.mj_step
        while n > 0:
            count = self._next_stop - engine.steps
            if count > n:
                count = n
            if commands.following:
                count = min(count, commands.advance(engine.steps))
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
        """Do what is due at this step."""
        engine = self._engine
        # false for NaN too; numpy's own dot warns where it overflows
        if not mujoco.mju_norm(engine.qvel) < FASTEST:
            self._fail()
        if engine.steps == self._next_period:
            # before anything that can raise: the step is made
            self._next_period += self._period
            self._robots.tick(engine.steps)
            self._robots.publish(round(engine.steps * self._nanoseconds))
        if self._planned_timer < NEVER:
            self._clock.advance_to(round(engine.steps * self._nanoseconds))
        if engine.steps >= self._disturbances.due:
            self._disturbances.bring_up()
        self._plan_stop()

    def _fail(self) -> None:
        engine = self._engine
        # the speeds were still right at the end of the last control period
        last = (engine.steps - 1) // self._period * self._period * engine.timestep
        descriptions = {name: robot.robot for name, robot in self._robots.items()}
        engine.failure = diverged(engine, descriptions, last, self._inside)
        raise engine.failure
