"""The journal of a simulation: actions from outside, and sentences for the user."""

from __future__ import annotations

from collections.abc import Callable

_CHANGES_OF_THE_WORLD = frozenset({"delete_model", "spawn_model", "spawn_sdf", "spawn_thing"})


class Journal:
    """Counts and notes each action from outside, after it is done."""

    def __init__(self) -> None:
        self.write: Callable[[str, dict[str, object]], None] | None = None
        """Called with the name and the numbers of each action, as by a recorder."""
        self.count = 0
        """Actions until now, with or without a `write`."""
        self.changes: list[tuple[str, dict[str, object]]] = []
        """The notes of robots and objects that were spawned or deleted since the world was built."""
        self.listeners: list[Callable[[str], None]] = []
        """Called with each report to the user, such as a trajectory that a controller rejects."""

    def note(self, what: str, **numbers: object) -> None:
        """Note an action that is done."""
        if what in _CHANGES_OF_THE_WORLD:
            self.changes.append((what, numbers))
        if self.write is not None:
            self.write(what, numbers)
        self.count += 1

    def report(self, text: str) -> None:
        """Report something to the user, if anybody listens."""
        for listener in tuple(self.listeners):
            listener(text)
