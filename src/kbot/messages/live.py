"""The interface of what bridges serve: a bus, a clock and errands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from kbot.messages import Bus, Clock


class Live(Protocol):
    """What a link serves: a simulation, or anything else that publishes on a bus as time passes.

    Its owner calls the `errands` between two steps, also while it is `paused`. An errand returns whether it
    did something.
    """

    @property
    def bus(self) -> Bus: ...

    @property
    def clock(self) -> Clock: ...

    @property
    def errands(self) -> list[Callable[[], bool]]: ...

    @property
    def paused(self) -> bool: ...
