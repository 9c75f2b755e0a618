"""A recording by time: what a topic said last at a moment, and how all stood then."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence

from kbot.record.entry import Entry
from kbot.record.reader import Recording
from kbot.record.writer import NOTES_TOPIC
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean


class Timeline:
    """Read once, and held in memory as it was recorded; messages are decoded when they are asked for.

    Times are seconds of the recording's clock. Where a run was set back in time, what came later counts.
    """

    def __init__(self, path: str) -> None:
        """Raises KbotError: there is no such recording."""
        recording = Recording(path)
        entries: dict[str, list[Entry]] = {}
        for entry in recording.entries():
            if entry.topic != NOTES_TOPIC:
                told = entries.setdefault(entry.topic, [])
                while told and told[-1].nanoseconds > entry.nanoseconds:
                    told.pop()
                told.append(entry)
        self._entries = entries
        self._times = {topic: [entry.nanoseconds for entry in told] for topic, told in entries.items()}
        self.topics = {topic: told[0].type_name for topic, told in sorted(entries.items())}
        """Names and types, as ROS 2 writes them."""
        self.start = min((times[0] for times in self._times.values()), default=0) * 1e-9
        self.end = max((times[-1] for times in self._times.values()), default=0) * 1e-9

    def at(self, topic: str, seconds: float) -> Entry | None:
        """What the topic said last, until then and at that very moment; None where it said nothing yet.

        Raises:
            KbotError: the recording has no such topic.
        """
        index = bisect_right(self._of(topic), round(seconds * 1e9))
        return self._entries[topic][index - 1] if index else None

    def between(self, topic: str, start: float, end: float) -> Sequence[Entry]:
        """What the topic said from `start` on and before `end`. Raises KbotError as `at`."""
        times = self._of(topic)
        first, last = bisect_left(times, round(start * 1e9)), bisect_left(times, round(end * 1e9))
        return self._entries[topic][first:last]

    def state(self, seconds: float) -> dict[str, Entry]:
        """What every topic said last, by topic; those that said nothing yet are left out."""
        found = {topic: self.at(topic, seconds) for topic in self.topics}
        return {topic: entry for topic, entry in found.items() if entry is not None}

    def _of(self, topic: str) -> list[int]:
        if topic not in self._times:
            hint = did_you_mean(topic, self._times)
            raise KbotError(f"the recording has no topic {topic}" + (f": {hint}" if hint else ""))
        return self._times[topic]
