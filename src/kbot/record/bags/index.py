"""Bags of ROS 1 and folders of rosbag2 by their index."""

from __future__ import annotations

import weakref
from collections import Counter, deque
from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.interfaces import MessageDefinitionFormat

from kbot.record.bags.columns import checked
from kbot.record.bags.reader import UNREADABLE, unread
from kbot.record.entry import Entry, Types
from kbot.record.formats import NOTES_TOPIC, read_note
from kbot.text import KbotError
from kbot.wire.types import ros2_types

FIRST_WINDOW = 1_000_000_000
"""Nanoseconds before a moment in which what was said last is looked for first; then in eight times that."""


class BagIndex:
    """One recording, open until `close` or while it is in use."""

    broken = ""

    def __init__(self, path: str) -> None:
        """Raises KbotError: it is no such recording, or has no index."""
        self._path = path
        self._is_ros1 = not Path(path).is_dir()
        try:
            self._reader = AnyReader([Path(path)], default_typestore=ros2_types())
            self._reader.open()
        except UNREADABLE as error:
            raise unread(Path(path), error) from None
        self._closing = weakref.finalize(self, self._reader.close)
        self._types = Types()
        for connection in self._reader.connections:
            if connection.msgdef.format == MessageDefinitionFormat.MSG:
                self._types.learn(connection.msgtype, connection.msgdef.data)
        self.topics = {connection.topic: connection.msgtype for connection in self._reader.connections}
        self.counts: Counter[str] = Counter()
        for connection in self._reader.connections:
            self.counts[connection.topic] += connection.msgcount
        self.start, self.end = self._reader.start_time, self._reader.end_time
        self.notes = dict(map(read_note, self.between((NOTES_TOPIC,), self.start - 1, self.end)))

    def damage(self, nanoseconds: int) -> None:
        return None

    def close(self) -> None:
        self._closing()

    def newest(self, topic: str, nanoseconds: int) -> Entry | None:
        """What a topic said last until a time."""
        window, before = FIRST_WINDOW, nanoseconds
        while before >= self.start:
            after = max(nanoseconds - window, self.start - 1)
            said = deque(self.between((topic,), after, before), maxlen=1)
            if said:
                return said[0]
            before, window = after, window * 8
        return None

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[Entry]:
        """What these topics said after a time and until another, in its order."""
        wanted = [connection for connection in self._reader.connections if connection.topic in topics]
        if not wanted:
            return
        try:
            for connection, at, data in self._reader.messages(wanted, start=after + 1, stop=until + 1):
                found = checked(connection.topic, connection.msgtype, at, data)
                yield Entry(*found, self._types, is_ros1=self._is_ros1)
        except UNREADABLE as error:
            raise KbotError(f"{self._path} is damaged: {error}") from None
