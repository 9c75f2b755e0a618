"""Decide which page drives: one at a time, and none after it stops sending."""

from __future__ import annotations

from collections.abc import Callable

DEADMAN_SECONDS = 0.5
"""Seconds without a message from the driving page after which the robot stops."""
NOBODY = 0
"""The number of no page."""


class Deadman:
    """The dead man's switch of the driving page. Pages are identified by their numbers."""

    def __init__(self, move: Callable[[float, float], None]) -> None:
        """`move` drives the robot, in m/s forward and rad/s turning."""
        self.driver = NOBODY
        self._move = move
        self._quiet_for = 0.0

    def drive(self, linear: float, angular: float, client: int) -> None:
        """Drive the robot from a page. Zero speeds stop it, but only from the page that drives."""
        stands = linear == 0.0 and angular == 0.0
        if stands and client != self.driver:
            return
        self._move(linear, angular)
        self.driver, self._quiet_for = NOBODY if stands else client, 0.0

    def stop(self) -> None:
        """Stop the robot, whichever page drives."""
        self.release()
        self._move(0.0, 0.0)

    def release(self) -> None:
        """Forget the driving page without a command to the robot."""
        self.driver = NOBODY

    def leave(self, client: int) -> None:
        """Stop the robot if the page that disconnected was driving."""
        if client == self.driver:
            self.stop()

    def pass_time(self, wall_seconds: float) -> None:
        """Stop the robot if the driving page has been silent for too long."""
        self._quiet_for += wall_seconds
        if self.driver != NOBODY and self._quiet_for > DEADMAN_SECONDS:
            self.stop()
