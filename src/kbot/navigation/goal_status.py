"""The states of a goal, and the report on it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from kbot.kinematics.planar_pose import PlanarPose


class GoalState(StrEnum):
    """The state of a goal. `accepted` and `driving` are under way; all others are final."""

    ACCEPTED = "accepted"
    DRIVING = "driving"
    REACHED = "reached"
    STUCK = "stuck"
    CANCELLED = "cancelled"
    REFUSED = "refused"

    @property
    def is_end(self) -> bool:
        return self not in (GoalState.ACCEPTED, GoalState.DRIVING)


@dataclass(frozen=True, slots=True)
class GoalReport:
    """The state of a goal and its reason in one sentence, which may be empty.

    It equals the text of its state, so `status == "reached"` works.
    """

    goal: PlanarPose
    state: GoalState
    reason: str = ""

    def __eq__(self, other: object) -> bool:
        if isinstance(other, GoalReport):
            return (self.goal, self.state, self.reason) == (other.goal, other.state, other.reason)
        return self.state == other if isinstance(other, str) else NotImplemented

    def __str__(self) -> str:
        return f"{self.state}: {self.reason}" if self.reason else str(self.state)
