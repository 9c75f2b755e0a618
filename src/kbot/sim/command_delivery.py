"""Delivers commands to the robots that execute them, and drops commands at random if a fault is injected."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from kbot.brief import Brief
from kbot.sim.engine.engine import Engine
from kbot.sim.numbers import LONGEST, positive
from kbot.sim.recipe import CONTROL_PERIOD


class Follower(Protocol):
    """A robot whose servos receive new commands between two control periods."""

    def advance(self, step: int) -> int:
        """Send the servos their next commands if these are due.

        Returns the steps until the next ones are due, 0 when the servos have reached the command.
        """
        ...


class CommandDelivery(Brief):
    """The commands that robots are executing. `lost_share` of the commands from outside are dropped."""

    def __init__(self, engine: Engine, seed: int) -> None:
        self._engine = engine
        self._seed = seed
        self._longest = max(1, round(CONTROL_PERIOD / engine.timestep))
        self.following: list[Follower] = []
        """The robots whose servos currently receive new commands."""
        self.lost_share = 0.0
        """Probability from 0 to 1, set by the fault LostCommands."""
        self.restart()

    def restart(self) -> None:
        """Draw the same random numbers as at the start."""
        self.random = np.random.default_rng(self._seed)

    def deadline(self, watchdog: float | None) -> int | None:
        """The step at which a command given now times out. None without a watchdog (s).

        Raises:
            KbotError: the watchdog is not a positive time.
        """
        if watchdog is None:
            return None
        watchdog = positive("the watchdog time in seconds", watchdog, LONGEST)
        return self._engine.steps + max(1, round(watchdog / self._engine.timestep))

    def is_lost(self) -> bool:
        """Whether a command from outside is lost. Call this once per command: it draws a random number."""
        # lost commands are recorded in the journal too, so that a replay draws the same numbers
        return self.lost_share > 0.0 and bool(self.random.random() < self.lost_share)

    def follow(self, robot: Follower) -> None:
        """Call the robot's `advance` from now on, until it has reached the command."""
        if robot not in self.following:
            self.following.append(robot)

    def advance(self, step: int) -> int:
        """Advance the robots that are executing a command. Returns the steps until the next one is due."""
        wait = self._longest
        for robot in tuple(self.following):
            due = robot.advance(step)
            if due:
                if due < wait:  # not min(), which takes three times as long
                    wait = due
            else:
                self.following.remove(robot)
        return wait
