"""Bags of ROS 1 and folders of rosbag2."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from sqlite3 import Error as SqliteError
from struct import error as StructError

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import ReaderError as Ros1Error
from rosbags.rosbag2 import ReaderError as Ros2Error

from kbot.record.entry import Entry, Types
from kbot.record.reader import Note
from kbot.text import KbotError
from kbot.wire.types import ros2_types

UNREADABLE = (
    *(AnyReaderError, Ros1Error, Ros2Error, OSError, EOFError, SqliteError, StructError),
    *(ValueError, LookupError, AssertionError, RuntimeError, MemoryError),
)
"""What reading raises where a bag is damaged: its library trusts the numbers and names within."""


class BagSource:
    """Both kinds need their index: one that broke off is to be mended by ROS's own tools first."""

    def __init__(self, path: str) -> None:
        self._path = Path(path)
        self._is_ros1 = not self._path.is_dir()
        self.kind = "bag of ROS 1" if self._is_ros1 else "rosbag2"

    def entries(self, note: Note) -> Iterator[Entry]:
        """Raises KbotError: it is no such recording, or has no index."""
        types = Types()
        try:
            with AnyReader([self._path], default_typestore=ros2_types()) as reader:
                for connection in reader.connections:
                    if connection.msgdef.format == MessageDefinitionFormat.MSG:
                        types.learn(connection.msgtype, connection.msgdef.data)
                for connection, at, data in reader.messages():
                    yield Entry(
                        connection.topic, connection.msgtype, at, bytes(data), types, is_ros1=self._is_ros1
                    )
        except UNREADABLE as error:
            mend = f"rosbag reindex {self._path}" if self._is_ros1 else f"ros2 bag reindex {self._path}"
            raise KbotError(
                f"{self._path} cannot be read as {self.kind}: {error} (to mend it: {mend})"
            ) from None
