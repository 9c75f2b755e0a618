"""Forces on links that last for a while."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from kbot.sim.numbers import Vector


class Push(NamedTuple):
    """A force (N) and torque (N m) along the world's axes on a body's centre of mass, until a step."""

    body: str
    force: Vector
    torque: Vector
    until: int


def apply(model: Any, data: Any, pushes: Iterable[Push]) -> None:
    """Make these, and no others, act in the engine."""
    data.xfrc_applied[:] = 0.0
    for push in pushes:
        data.xfrc_applied[model.body(push.body).id] += (*push.force, *push.torque)
