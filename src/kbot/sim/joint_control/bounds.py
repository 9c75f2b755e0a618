"""What a joint may be told: its limits, and the softer ones of its safety controller.

Source of the soft limits: ros_control's `joint_limits_interface`, which has them from the PR2: near an
end the speed towards it is bound by k_position times the way that is left, and the effort by k_velocity
times what the speed is above that bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from kbot.model import Joint, JointType, SafetyController


@dataclass(frozen=True, slots=True)
class JointBounds:
    """`lower` and `upper` in rad or m; `speed` in rad/s or m/s, `effort` in N m or N: else endless."""

    lower: float
    upper: float
    speed: float
    effort: float
    safety: SafetyController | None

    @classmethod
    def of(cls, joint: Joint) -> JointBounds:
        lower, upper = joint.range
        limit, safety = joint.limit, joint.safety
        if joint.type is JointType.CONTINUOUS:
            # without an end, a safety controller bounds no position
            safety = None
        elif safety is not None and safety.soft_lower_limit < safety.soft_upper_limit:
            lower, upper = max(lower, safety.soft_lower_limit), min(upper, safety.soft_upper_limit)
        speed = limit.velocity if limit is not None and limit.velocity else inf
        effort = limit.effort if limit is not None and limit.effort else inf
        return cls(lower, upper, speed, effort, safety)

    def position(self, wanted: float) -> float:
        return min(max(wanted, self.lower), self.upper)

    def velocity(self, wanted: float, position: float) -> float:
        """A speed that may be commanded where the joint stands."""
        lowest, highest = self._speeds(position)
        return min(max(wanted, lowest), highest)

    def force(self, wanted: float, position: float, velocity: float) -> float:
        """An effort that may be commanded where the joint stands and as it moves."""
        lowest, highest = -self.effort, self.effort
        if self.safety is not None and self.safety.k_velocity:
            slowest, fastest = self._speeds(position)
            k = self.safety.k_velocity
            lowest = min(max(-k * (velocity - slowest), lowest), self.effort)
            highest = max(min(-k * (velocity - fastest), highest), -self.effort)
        return min(max(wanted, lowest), highest)

    def _speeds(self, position: float) -> tuple[float, float]:
        lowest, highest = -self.speed, self.speed
        if self.safety is not None and self.safety.k_position:
            k = self.safety.k_position
            lowest = min(max(-k * (position - self.lower), lowest), self.speed)
            highest = max(min(-k * (position - self.upper), highest), -self.speed)
        return lowest, highest
