"""Decides which page drives: one at a time, and none if it stops sending."""

from __future__ import annotations

from collections.abc import Callable

DEADMAN_SECONDS = 0.5
NOBODY = 0


class Deadman:
    """The switch that a driver keeps pressing; pages are known by their numbers."""

    def __init__(self, move: Callable[[float, float], None]) -> None:
        """`move` drives the robot, m/s forward and rad/s turning."""
        self.driver = NOBODY
        self._move = move
        self._quiet_for = 0.0

    def drive(self, linear: float, angular: float, client: int) -> None:
        """A page drives, or lets go; one that does not drive has nothing to let go of."""
        stands = linear == 0.0 and angular == 0.0
        if stands and client != self.driver:
            return
        self._move(linear, angular)
        self.driver, self._quiet_for = NOBODY if stands else client, 0.0

    def stop(self) -> None:
        """The robot stops, whoever drove."""
        self.release()
        self._move(0.0, 0.0)

    def release(self) -> None:
        """Nobody drives from here on; the robot is told nothing."""
        self.driver = NOBODY

    def leave(self, client: int) -> None:
        """A page is gone."""
        if client == self.driver:
            self.stop()

    def pass_time(self, wall_seconds: float) -> None:
        """Stop the robot where its driver has by now been silent for too long."""
        self._quiet_for += wall_seconds
        if self.driver != NOBODY and self._quiet_for > DEADMAN_SECONDS:
            self.stop()
