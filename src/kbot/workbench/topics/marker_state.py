"""Collect the current markers in one message, because pages receive only a topic's newest message."""

from __future__ import annotations

from kbot.messages.visualization import ADD, DELETE, DELETE_ALL, Marker, MarkerArray

MOST_MARKERS = 20_000
"""Markers of one topic."""
CLEAR = Marker(action=DELETE_ALL)


class MarkerState:
    """The current markers of a topic, by namespace and number."""

    def __init__(self) -> None:
        self._current: dict[tuple[str, int], Marker] = {}

    def take(self, message: Marker | MarkerArray) -> None:
        """Apply a message."""
        for marker in message.markers if isinstance(message, MarkerArray) else (message,):
            self._take(marker)

    def current(self, now: int) -> MarkerArray:
        """Return all markers at a time in nanoseconds, after a marker that deletes the earlier ones."""
        self._current = {
            key: marker for key, marker in self._current.items() if not _has_expired(marker, now)
        }
        return MarkerArray((CLEAR, *self._current.values()))

    def _take(self, marker: Marker) -> None:
        key = marker.ns, marker.id
        if marker.action == DELETE_ALL:
            kept = {} if marker.ns == "" else self._current
            self._current = {k: m for k, m in kept.items() if m.ns != marker.ns}
        elif marker.action == DELETE:
            self._current.pop(key, None)
        elif marker.action == ADD and (key in self._current or len(self._current) < MOST_MARKERS):
            self._current.pop(key, None)
            self._current[key] = marker


def _has_expired(marker: Marker, now: int) -> bool:
    life = marker.lifetime.sec * 1_000_000_000 + marker.lifetime.nanosec
    return life > 0 and now > marker.header.stamp.nanoseconds + life
