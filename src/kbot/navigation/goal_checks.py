"""Checks a goal: its pose and its time limit."""

from __future__ import annotations

import math
import reprlib

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim.numbers import FURTHEST
from kbot.text import KbotError


def require_goal(goal: PlanarPose) -> None:
    """Raises KbotError: it is not a pose, a number is not finite, or the goal is further than `FURTHEST` from
    the origin."""
    if not isinstance(goal, PlanarPose):
        raise KbotError(f"a goal must be a PlanarPose(x, y, yaw) in m and rad, not {reprlib.repr(goal)}")
    if not all(math.isfinite(v) for v in (goal.x, goal.y, goal.yaw)):
        raise KbotError("a goal needs a finite x and y in m and a finite yaw in rad")
    if max(abs(goal.x), abs(goal.y)) > FURTHEST:
        raise KbotError(f"the goal ({goal.x:g}, {goal.y:g}) is further than {FURTHEST:g} m from the origin")


def require_timeout(timeout: float | None) -> None:
    """Raises KbotError: the time limit of a goal is not a finite number of seconds above 0."""
    if timeout is not None and not (math.isfinite(timeout) and timeout > 0.0):
        raise KbotError(f"a timeout must be a finite number of seconds above 0, not {timeout}")
