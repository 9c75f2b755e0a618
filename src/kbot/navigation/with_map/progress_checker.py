"""Checks that a robot gets nearer to the end of its path."""

from __future__ import annotations

import math

_RADIAN_IN_METRES = 0.1
"""Progress in m that a turn by one radian counts for."""
_LEAST = 0.01
"""Least progress in m that counts. A robot that pushes against a wall slips and rocks by less."""


class ProgressChecker:
    """Checks that the distance and the turn that are left become less."""

    def __init__(self, patience: float) -> None:
        """`patience`: seconds without progress after which the robot is stalled."""
        self.patience = patience
        self.begin(0.0)

    def begin(self, time: float) -> None:
        """Start again, for example after a new plan."""
        self._least, self._since, self._only_turns = math.inf, time, False

    def is_stalled(self, time: float, metres: float, radians: float) -> bool:
        """Whether there was no progress for longer than `patience`; `metres` and `radians` are left to go."""
        if metres == 0.0 and not self._only_turns:
            # only the final turn is left, which `radians` did not include before
            self.begin(time)
            self._only_turns = True
        left = metres + _RADIAN_IN_METRES * abs(radians)
        if left < self._least - _LEAST:
            self._least, self._since = left, time
        return time - self._since > self.patience
