"""The iterator type of expressions, which charges for each item."""

from __future__ import annotations

from kbot.xacro.values import Value

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from kbot.xacro.budget import Budget


class Counted:
    """The result of `map`, `filter`, `zip`, `enumerate`, `reversed` and generator expressions.

    Python's own iterators would run endlessly in C code if a list grows during the iteration. They would also
    overflow the stack if thousands of them are nested.
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
