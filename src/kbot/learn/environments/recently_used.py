"""Keeps what was used recently, with one limit for the whole process."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar
from weakref import ref

MOST_KEPT = 128
"""Stages, and the places of worlds. Either takes a few MB, and 0.05 to 0.1 s to build."""
T = TypeVar("T")
_ORDER: OrderedDict[tuple[ref[Any], Hashable], None] = OrderedDict()  # of caches of any type
"""The keys in all caches, from the one that was not used for the longest time."""


class RecentlyUsed(Generic[T]):
    """A cache. Its values are dropped when enough others were used since, also those of other caches."""

    def __init__(self) -> None:
        self._values: dict[Hashable, T] = {}

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """The value of a key, which is made if it is not kept. Threads may make the same value twice."""
        value = self._values.get(key)
        if value is None:
            value = self._values[key] = make()
        entry = ref(self), key
        _ORDER[entry] = None
        _ORDER.move_to_end(entry)
        while len(_ORDER) > MOST_KEPT:
            (cache, oldest), _ = _ORDER.popitem(last=False)
            owner = cache()
            if owner is not None:
                owner._values.pop(oldest, None)
        return value
