"""Notices when a robot no longer gets on."""

from __future__ import annotations

import math

_RADIAN_IN_METRES = 0.1
"""What turning by a radian counts for beside driving."""
_LEAST = 0.01
"""m of progress that count: a robot that pushes a wall slips and rocks by less."""


class Progress:
    """Watches what is left to do. A robot that spins or pushes a wall does not reduce it."""

    def __init__(self, patience: float) -> None:
        """`patience`: seconds that may pass without any progress."""
        self.patience = patience
        self.begin(0.0)

    def begin(self, time: float) -> None:
        """Start anew, as after a new plan."""
        self._least, self._since, self._only_turns = math.inf, time, False

    def stalled(self, time: float, metres: float, radians: float) -> bool:
        """Whether what is left has not become less for longer than the patience lasts."""
        if metres == 0.0 and not self._only_turns:
            # the last turn is left, which was not counted before
            self.begin(time)
            self._only_turns = True
        left = metres + _RADIAN_IN_METRES * abs(radians)
        if left < self._least - _LEAST:
            self._least, self._since = left, time
        return time - self._since > self.patience
