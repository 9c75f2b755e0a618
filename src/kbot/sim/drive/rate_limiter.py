"""How a speed goes to the one that is wanted, under limits of acceleration and jerk."""

from __future__ import annotations

from math import copysign, inf, sqrt


class RateLimiter:
    """One speed's way, a period at a time. `acceleration` is what the last period ended with, where the
    jerk is limited."""

    def __init__(
        self, period: float, acceleration: float, deceleration: float | None = None, jerk: float = inf
    ) -> None:
        self._period = period
        self._faster = acceleration
        self._slower = acceleration if deceleration is None else deceleration
        self._jerk = jerk
        self.acceleration = 0.0

    def advance(self, value: float, target: float) -> tuple[float, float]:
        """The speed at the end of a period, and its mean over the period."""
        limit = self._faster if abs(target) > abs(value) and target * value >= 0.0 else self._slower
        if self._jerk < inf:
            return self._smoothly(value, target, limit)
        change, step = target - value, limit * self._period
        if change > step:
            return value + step, value + step / 2.0
        if change < -step:
            return value - step, value - step / 2.0
        return target, value + change - change * abs(change) / (2.0 * step)

    def _smoothly(self, value: float, target: float, limit: float) -> tuple[float, float]:
        """With the acceleration itself on a slope: as steep as still lets it come down to zero in time."""
        period, before, change = self._period, self.acceleration, target - value
        wanted = copysign(min(limit, sqrt(2.0 * self._jerk * abs(change))), change)
        step = self._jerk * period
        after = min(max(wanted, before - step), before + step)
        end = value + (before + after) / 2.0 * period
        if (target - end) * change <= 0.0 or abs(target - end) < step * period / 2.0:
            self.acceleration = 0.0
            return target, (value + target) / 2.0
        self.acceleration = after
        return end, value + before * period / 2.0 + (after - before) * period / 6.0
