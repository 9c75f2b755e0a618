"""The latest frames and joints of a recording at a time, each from its own message."""

from __future__ import annotations

from kbot.messages import JointState, TFMessage
from kbot.workbench.playback.recorded_run import TF_STATIC, RecordedRun

LOOKS = 1.0, 4.0
"""Seconds before a time in which all frames and joints are searched: the first attempt, then the second."""


class RecordedMoves:
    """The latest message of every frame and joint at a time."""

    def __init__(self, run: RecordedRun) -> None:
        self._run = run
        self._samples = [(entry.nanoseconds, entry.topic, run.read(entry)) for entry in run.samples()]
        self._known = set[tuple[str, str]]().union(*(_parts_of(*sample) for _, *sample in self._samples))
        """All known frames and joints of the recording, each with its topic."""

    def until(self, now: int) -> list[tuple[str, object]]:
        """Return topics and messages, oldest first, with the latest pose of everything at a time in ns."""
        found: list[tuple[str, object]] = []
        missing = self._known
        for seconds in LOOKS:
            after = max(now - round(seconds * 1e9), self._run.index.start - 1)
            entries = self._run.index.between(self._run.moves, after, now)
            found = [(entry.topic, self._run.read(entry)) for entry in entries if entry.topic != TF_STATIC]
            missing = self._known.difference(*(_parts_of(*entry) for entry in found))
            if not missing:
                break
        rare = [
            (topic, message)
            for at, topic, message in self._samples
            if at <= now and _parts_of(topic, message) & missing
        ]
        newest, seen = [], set[tuple[str, str]]()
        for topic, message in reversed((*rare, *found)):
            parts = _parts_of(topic, message)
            if not parts <= seen:
                newest.append((topic, message))
                seen |= parts
        return newest[::-1]


def _parts_of(topic: str, message: object) -> set[tuple[str, str]]:
    """Return the topic with each of the message's frames or joints."""
    if isinstance(message, TFMessage):
        return {(topic, stamped.child_frame_id) for stamped in message.transforms}
    return {(topic, name) for name in message.name} if isinstance(message, JointState) else set()
