"""The states of a goal, and the report on its end."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from kbot.kinematics.planar_pose import PlanarPose


class GoalState(StrEnum):
    """`accepted` and `driving` go on; the others are ends."""

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
    """How a goal stands, and why in one sentence; the reason is empty where there is nothing to say."""

    goal: PlanarPose
    state: GoalState
    reason: str = ""

    def __str__(self) -> str:
        return f"{self.state}: {self.reason}" if self.reason else str(self.state)
