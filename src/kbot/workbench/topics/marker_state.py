"""Collects the current markers in one message, because pages receive only a topic's newest message."""

from __future__ import annotations

from kbot.messages.visualization import ADD, DELETE, DELETE_ALL, Marker, MarkerArray

MOST_MARKERS = 20_000
CLEAR = Marker(action=DELETE_ALL)


class MarkerState:
    """What a topic's markers have come to, by namespace and number."""

    def __init__(self) -> None:
        self._standing: dict[tuple[str, int], Marker] = {}

    def take(self, message: Marker | MarkerArray) -> None:
        for marker in message.markers if isinstance(message, MarkerArray) else (message,):
            self._take(marker)

    def standing(self, now: int) -> MarkerArray:
        """All that stand at a time in nanoseconds, after a word to forget those before."""
        self._standing = {key: marker for key, marker in self._standing.items() if not _is_over(marker, now)}
        return MarkerArray((CLEAR, *self._standing.values()))

    def _take(self, marker: Marker) -> None:
        key = marker.ns, marker.id
        if marker.action == DELETE_ALL:
            kept = {} if marker.ns == "" else self._standing
            self._standing = {k: m for k, m in kept.items() if m.ns != marker.ns}
        elif marker.action == DELETE:
            self._standing.pop(key, None)
        elif marker.action == ADD and (key in self._standing or len(self._standing) < MOST_MARKERS):
            self._standing.pop(key, None)
            self._standing[key] = marker


def _is_over(marker: Marker, now: int) -> bool:
    life = marker.lifetime.sec * 1_000_000_000 + marker.lifetime.nanosec
    return life > 0 and now > marker.header.stamp.nanoseconds + life
