"""Notices when a robot no longer gets on."""

from __future__ import annotations

import math

_RADIAN_IN_METRES = 0.1
"""What turning by a radian counts for beside driving."""
_LEAST = 0.01


class Progress:
    """Watches what is left to do, which a robot that spins or pushes a wall does not make less."""

    def __init__(self, patience: float) -> None:
        """`patience`: seconds that may pass without any progress."""
        self.patience = patience
        self.begin(0.0)

    def begin(self, time: float) -> None:
        """Start anew, as after a new plan."""
        self._least, self._since = math.inf, time

    def stalled(self, time: float, metres: float, radians: float) -> bool:
        """Whether what is left has not become less for longer than the patience lasts."""
        left = metres + _RADIAN_IN_METRES * abs(radians)
        if left < self._least - _LEAST:
            self._least, self._since = left, time
        return time - self._since > self.patience
