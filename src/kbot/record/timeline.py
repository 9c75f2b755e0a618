"""A recording by time: what a topic said last at a moment, and how all stood then."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.record.entry import Entry
from kbot.record.index import open_index
from kbot.record.writer import NOTES_TOPIC
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean


class Timeline:
    """Read as it is asked, by its index; messages are decoded when they are asked for.

    Times are seconds of the recording's clock. Where a run was set back in time, what came later counts.
    """

    def __init__(self, path: str) -> None:
        """Raises KbotError: there is no such recording."""
        self._index = open_index(path)
        self.topics = {name: kind for name, kind in sorted(self._index.topics.items()) if name != NOTES_TOPIC}
        """Names and types, as ROS 2 writes them."""
        self.start, self.end = self._index.start * 1e-9, self._index.end * 1e-9

    def at(self, topic: str, seconds: float) -> Entry | None:
        """What the topic said last, until then and at that very moment; None where it said nothing yet.

        Raises:
            KbotError: the recording has no such topic.
        """
        self._require(topic)
        return self._index.newest(topic, round(seconds * 1e9))

    def between(self, topic: str, start: float, end: float) -> Sequence[Entry]:
        """What the topic said from `start` on and before `end`. Raises KbotError as `at`."""
        self._require(topic)
        return list(self._index.between((topic,), round(start * 1e9) - 1, round(end * 1e9) - 1))

    def state(self, seconds: float) -> dict[str, Entry]:
        """What every topic said last, by topic; those that said nothing yet are left out."""
        found = {topic: self.at(topic, seconds) for topic in self.topics}
        return {topic: entry for topic, entry in found.items() if entry is not None}

    def _require(self, topic: str) -> None:
        if topic not in self.topics:
            hint = did_you_mean(topic, self.topics)
            raise KbotError(f"the recording has no topic {topic}" + (f": {hint}" if hint else ""))
