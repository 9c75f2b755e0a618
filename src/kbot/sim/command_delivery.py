"""Keeps the robots that follow a command, and loses commands by chance if a fault asks for it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from kbot.sim.engine.engine import Engine
from kbot.sim.numbers import LONGEST, positive
from kbot.sim.recipe import CONTROL_PERIOD


class Follower(Protocol):
    """A robot, as far as its servos get new commands between two control periods."""

    def advance(self, step: int) -> int:
        """Send the servos their next commands if these are due.

        Returns the steps until the next ones are due, 0 when the servos have what was commanded.
        """
        ...


class CommandDelivery:
    """The commands that robots follow; `lost_share` of those from outside are lost."""

    def __init__(self, engine: Engine, seed: int) -> None:
        self._engine = engine
        self._seed = seed
        self._longest = max(1, round(CONTROL_PERIOD / engine.timestep))
        self.following: list[Follower] = []
        """The robots whose servos get new commands now."""
        self.lost_share = 0.0
        """Probability from 0 to 1, set by the fault LostCommands."""
        self.restart()

    def restart(self) -> None:
        """Draw the same random numbers as at the start."""
        self.random = np.random.default_rng(self._seed)

    def deadline(self, watchdog: float | None) -> int | None:
        """The step at which a command ends that is given now, None for one without a watchdog (s).

        Raises:
            KbotError: the watchdog is not a time.
        """
        if watchdog is None:
            return None
        watchdog = positive("a watchdog's time in seconds", watchdog, LONGEST)
        return self._engine.steps + max(1, round(watchdog / self._engine.timestep))

    def is_lost(self) -> bool:
        """Whether a command from outside is lost. Call this once for each of them: it draws a number."""
        # a lost command is journalled too: a replay draws the same numbers
        return self.lost_share > 0.0 and bool(self.random.random() < self.lost_share)

    def follow(self, robot: Follower) -> None:
        """Call `advance` of a robot from now on, until it has what was commanded."""
        if robot not in self.following:
            self.following.append(robot)

    def advance(self, step: int) -> int:
        """Advance the robots that follow a command; the steps until the next of them is due."""
        wait = self._longest
        for robot in tuple(self.following):
            due = robot.advance(step)
            if due:
                wait = min(wait, due)
            else:
                self.following.remove(robot)
        return wait
