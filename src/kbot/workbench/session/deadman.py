"""Who drives: one page at a time, and nobody once it falls silent."""

from __future__ import annotations

DEADMAN_SECONDS = 0.5
NOBODY = 0


class Deadman:
    """The switch that a driver keeps pressing; pages are known by their numbers."""

    def __init__(self) -> None:
        self.driver = NOBODY
        self._quiet_for = 0.0

    def press(self, client: int) -> None:
        """A page drives."""
        self.driver, self._quiet_for = client, 0.0

    def release(self) -> None:
        self.driver = NOBODY

    def is_let_go(self, wall_seconds: float) -> bool:
        """Whether the driver has by now been silent for too long."""
        if self.driver == NOBODY:
            return False
        self._quiet_for += wall_seconds
        return self._quiet_for > DEADMAN_SECONDS
