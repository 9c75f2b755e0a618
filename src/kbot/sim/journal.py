"""The journal of a simulation: actions from outside, and reports to the user."""

from __future__ import annotations

from collections.abc import Callable

_SPAWNS = frozenset({"spawn_model", "spawn_sdf", "spawn_thing"})
_DELETES = "delete_model"


class Journal:
    """Counts each action from outside and passes it to a recorder, after the action."""

    def __init__(self) -> None:
        self.write: Callable[[str, dict[str, object]], None] | None = None
        """Called with the name and the arguments of each action. A recorder sets it."""
        self.count = 0
        """The number of actions so far, with or without a `write`."""
        self.changes: list[tuple[str, dict[str, object]]] = []
        """The actions that make the present world from the one that was built: they spawned what is still
        there, or deleted parts of the built world."""
        self.listeners: list[Callable[[str], None]] = []
        """Called with each report to the user, for example when a controller rejects a trajectory."""

    def note(self, what: str, **numbers: object) -> None:
        """Record a completed action."""
        if what in _SPAWNS:
            self.changes.append((what, numbers))
        elif what == _DELETES:
            self._delete(what, numbers)
        if self.write is not None:
            self.write(what, numbers)
        self.count += 1

    def _delete(self, what: str, numbers: dict[str, object]) -> None:
        """Undo the action that spawned what is deleted. A program may spawn and delete all the time."""
        deleted = numbers["robot"]
        for index, (before, spawned) in enumerate(self.changes):
            if before in _SPAWNS and deleted == spawned.get("name", spawned.get("robot")):
                del self.changes[index]
                return
        self.changes.append((what, numbers))

    def report(self, text: str) -> None:
        """Send a report to all listeners."""
        for listener in tuple(self.listeners):
            listener(text)
