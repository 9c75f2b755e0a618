"""The interface of what bridges serve: a bus, a clock and errands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from kbot.messages import Bus, Clock


class Live(Protocol):
    """What a link serves: a simulation, or anything else that speaks on a bus as time passes.

    `errands` are run between two steps, also while it is `paused`.
    """

    @property
    def bus(self) -> Bus: ...

    @property
    def clock(self) -> Clock: ...

    @property
    def errands(self) -> list[Callable[[], bool]]: ...

    @property
    def paused(self) -> bool: ...
