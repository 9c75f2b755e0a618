"""Writes rosbag2 folders: metadata.yaml and an SQLite file."""

from __future__ import annotations

import errno
import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rosbags.rosbag2 import StoragePlugin, Writer

from kbot.messages.types import String
from kbot.record.encodings.quality import parsed_qos
from kbot.record.feed import Packet
from kbot.record.formats import NOTES_TOPIC, Recordable

if TYPE_CHECKING:
    from rosbags.interfaces import Connection


COMMIT_PERIOD = 1_000_000_000
"""Nanoseconds of recorded time between commits. If the disk is full, all committed messages are kept."""

_NOT_IN_NAMES = frozenset("#%?")
"""Characters with a special meaning in the URI that the rosbags library passes to SQLite."""


class Ros2Writer:
    """Writes the metadata at the end. KBot reads an unfinished folder without it, other programs after
    `ros2 bag reindex`."""

    def __init__(self, path: str) -> None:
        """Raises OSError: the folder exists or cannot be created, or SQLite does not accept its name."""
        if not _NOT_IN_NAMES.isdisjoint(path):
            taken = " and ".join(sorted(_NOT_IN_NAMES.intersection(path)))
            raise OSError(errno.EINVAL, f"the name of a rosbag2 folder cannot contain {taken}")
        self._writer = Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3)
        with _sqlite_errors_as_oserror():
            self._writer.open()
        self._connections: dict[tuple[str, str], Connection] = {}
        self._time = 0
        self._committed = 0

    def write(self, packet: Recordable) -> None:
        key = (packet.topic, packet.type_name)
        connection = self._connections.get(key)
        if connection is None:
            definition, digest = packet.ros2_definition
            with _sqlite_errors_as_oserror():
                connection = self._connections[key] = self._writer.add_connection(
                    packet.topic,
                    packet.type_name,
                    msgdef=definition,
                    rihs01=digest,
                    offered_qos_profiles=parsed_qos(packet.offered_qos),
                )
        self._time = packet.nanoseconds
        with _sqlite_errors_as_oserror():
            self._writer.write(connection, packet.nanoseconds, packet.cdr)
        if not 0 <= self._time - self._committed < COMMIT_PERIOD:
            self._committed = self._time
            self.flush()

    def annotate(self, name: str, values: dict[str, str]) -> None:
        text = String(json.dumps({"name": name, **values}))
        self.write(Packet(NOTES_TOPIC, text, self._time, is_latched=True))

    def flush(self) -> None:
        connection = getattr(self._writer.storage, "conn", None)
        if connection is not None:
            with _sqlite_errors_as_oserror():
                connection.commit()

    def close(self) -> None:
        with _sqlite_errors_as_oserror():
            self._writer.close()

    def abandon(self) -> None:
        self._writer.abort()


@contextmanager
def _sqlite_errors_as_oserror() -> Iterator[None]:
    """Raise SQLite's errors, for example of a full disk, as OSError like the other formats."""
    try:
        yield
    except sqlite3.Error as error:
        raise OSError(errno.EIO, str(error)) from error
