"""Bags of ROS 1 and folders of rosbag2."""

from __future__ import annotations

from collections.abc import Iterator
from os import SEEK_END
from pathlib import Path
from sqlite3 import Error as SqliteError
from struct import error as StructError

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import ReaderError as Ros1Error
from rosbags.rosbag1.reader import Header, RecordType
from rosbags.rosbag2 import ReaderError as Ros2Error

from kbot.record.bags.columns import checked
from kbot.record.bags.ros1_salvage import salvaged
from kbot.record.bags.ros2_salvage import salvaged_folder
from kbot.record.entry import Entry, Types
from kbot.record.formats import BrokenOff, NoIndex, Note
from kbot.text import KbotError
from kbot.wire.types import ros2_types

UNREADABLE = (
    *(AnyReaderError, Ros1Error, Ros2Error, OSError, EOFError, SqliteError, StructError),
    *(ValueError, LookupError, AssertionError, RuntimeError, MemoryError),
)
"""What reading raises where a bag is damaged: its library trusts the numbers and names within."""


class BagSource:
    """Of a bag of ROS 1 that has no index, and of a folder of SQLite files without metadata, all is read that
    is whole."""

    def __init__(self, path: str) -> None:
        self._path = Path(path)
        self._is_ros1 = not self._path.is_dir()
        self.kind = "bag of ROS 1" if self._is_ros1 else "rosbag2"

    def entries(self, note: Note) -> Iterator[Entry]:
        """Raises KbotError: it is no such recording; BrokenOff after all that is whole."""
        try:
            yield from self._indexed()
        except NoIndex as missing:
            yield from salvaged(self._path, UNREADABLE) if self._is_ros1 else salvaged_folder(self._path)
            raise BrokenOff(str(missing)) from None

    def _indexed(self) -> Iterator[Entry]:
        types = Types()
        try:
            with AnyReader([self._path], default_typestore=ros2_types()) as reader:
                for connection in reader.connections:
                    if connection.msgdef.format == MessageDefinitionFormat.MSG:
                        types.learn(connection.msgtype, connection.msgdef.data)
                for connection, at, data in reader.messages():
                    found = checked(connection.topic, connection.msgtype, at, data)
                    yield Entry(*found, types, is_ros1=self._is_ros1)
        except UNREADABLE as error:
            raise unread(self._path, error) from None


def unread(path: Path, error: Exception) -> KbotError:
    """What is to be said of a bag whose reading raised this; a NoIndex where it can be read without."""
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return KbotError(
                f"{path} cannot be read as rosbag2: {error} (to mend it: ros2 bag reindex {path})"
            )
        if list(path.glob("*.db3")):
            return NoIndex("it was not closed, so that it has no metadata.yaml")
        files = sorted(path.glob("*.mcap"))
        mend = f"; a file in it can be read: {files[0]}" if files else ""
        return KbotError(f"{path} has no metadata.yaml, as a folder of rosbag2 has{mend}")
    missing = _missing_index(path)
    if missing:
        return NoIndex(missing)
    mend = f"a machine with ROS 1 mends what is whole: rosbag reindex {path}"
    return KbotError(f"{path} cannot be read as bag of ROS 1: {error}; {mend}")


def _missing_index(path: Path) -> str:
    """In words: that a bag of ROS 1 ends before its index, empty where it does not."""
    try:
        with path.open("rb") as stream:
            stream.readline()
            index = Header.read(stream, RecordType.BAGHEADER).get_uint64("index_pos")
            size = stream.seek(0, SEEK_END)
    except UNREADABLE:
        return ""
    if index == 0:
        return f"it was not closed, so that its {size:,} bytes have no index"
    return f"it ends after {size:,} bytes, before its index at {index:,}" if size <= index else ""
