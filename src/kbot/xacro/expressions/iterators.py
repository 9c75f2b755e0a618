"""Iterators of expressions, which charge for each item."""

from __future__ import annotations

from kbot.xacro.values import Value

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from kbot.xacro.budget import Budget


class Counted:
    """What `map`, `filter`, `zip`, `enumerate`, `reversed` and generator expressions give.

    Python's own would run in C code without end where a list grows while it is gone through, and
    would overflow the stack where thousands take from one another.
    """

    __slots__ = ("_budget", "_iterator")

    def __init__(self, budget: Budget, iterator: Iterator[Value]) -> None:
        self._budget = budget
        self._iterator = iterator

    def __iter__(self) -> Counted:
        return self

    def __next__(self) -> Value:
        budget = self._budget
        budget.charge(2)
        budget.enter()
        try:
            return next(self._iterator)
        finally:
            budget.leave()
