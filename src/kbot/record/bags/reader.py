"""Reads ROS 1 bags and rosbag2 folders."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path

from kbot.record.bags.ros1_reader import Ros1Bag
from kbot.record.bags.ros2_folder import Folder
from kbot.record.bags.sqlite_file import SqliteFile
from kbot.record.chunks import in_time_order
from kbot.record.entry import RecordedMessage, Types
from kbot.record.formats import BrokenOff, NoIndex, Note
from kbot.record.limits import Allowance, RecordingTooLarge
from kbot.record.mcap_file import McapSource
from kbot.text import KbotError

UNREADABLE = (ValueError, OSError, sqlite3.Error)
"""What reading a folder raises where it is damaged."""
_ALL = -1 << 63, 1 << 63
"""Times before and after all of SQLite's."""


class Ros1Source:
    """A bag of ROS 1. If it ends before its index, all that is whole is read."""

    kind = "bag of ROS 1"

    def __init__(self, path: str) -> None:
        self._path = path

    def entries(self, note: Note) -> Iterator[RecordedMessage]:
        """Raises KbotError: it is damaged, or not such a bag; BrokenOff after all that is whole."""
        allowance = Allowance(self._path)
        bag = Ros1Bag(self._path, allowance)
        try:
            bag.read_index()
        except NoIndex as missing:
            yield from bag.salvaged(allowance)
            raise BrokenOff(str(missing)) from None
        try:
            yield from in_time_order((chunk.start, bag.messages(chunk, allowance)) for chunk in bag.chunks)
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None


class Ros2Source:
    """A folder of rosbag2. If it has no metadata, all that was committed to its SQLite files is read."""

    kind = "rosbag2"

    def __init__(self, path: str) -> None:
        self._path = Path(path)

    def entries(self, note: Note) -> Iterator[RecordedMessage]:
        """Raises KbotError: it is damaged, or not such a folder; BrokenOff after all that is whole."""
        allowance = Allowance(self._path)
        try:
            folder = read_folder(self._path)
        except NoIndex as missing:
            yield from self._salvaged(allowance)
            raise BrokenOff(str(missing)) from None
        types = Types(self._path, allowance)
        try:
            with folder.opened(allowance) as files:
                for file in files:
                    entries = (
                        McapSource(str(file)).entries(note)
                        if folder.storage == "mcap"
                        else _messages(file, types, allowance)
                    )
                    for entry in entries:
                        yield folder.whole(entry, allowance)
        except UNREADABLE as error:
            raise unread(self._path, error) from None
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None

    def _salvaged(self, allowance: Allowance) -> Iterator[RecordedMessage]:
        """Every message that was committed, in the order it was written."""
        types = Types(self._path, allowance)
        files = filter(Path.is_file, self._path.glob("*.db3"))
        for file in sorted(files, key=lambda file: (len(file.name), file.name)):
            try:
                database = SqliteFile(file, types, is_closed=False)
                try:
                    yield from database.written(allowance)
                finally:
                    database.close()
            except UNREADABLE as error:
                raise BrokenOff(f"{file} cannot be read further: {one_line(error)}") from None


def read_folder(path: Path) -> Folder:
    """Raises NoIndex: it has no metadata, and SQLite files; KbotError: it is not such a folder."""
    if not (path / "metadata.yaml").is_file():
        if list(path.glob("*.db3")):
            raise NoIndex("it was not closed, so that it has no metadata.yaml")
        files = sorted(path.glob("*.mcap"))
        hint = f"; a file in it can be read: {files[0]}" if files else ""
        raise KbotError(f"{path} has no metadata.yaml, as a folder of rosbag2 has{hint}")
    try:
        return Folder(path)
    except UNREADABLE as error:
        raise unread(path, error) from None


def unread(path: Path, error: Exception) -> KbotError:
    """What is reported of a folder whose reading raised this."""
    return KbotError(
        f"{path} cannot be read as rosbag2: {one_line(error)} (to fix it: ros2 bag reindex {path})"
    )


def one_line(error: Exception) -> str:
    """The error's text on one line. SQLite quotes the file's contents."""
    return " ".join(str(error).split())[:300]


def _messages(file: Path, types: Types, allowance: Allowance) -> Iterator[RecordedMessage]:
    database = SqliteFile(file, types, is_closed=True)
    try:
        yield from database.between(None, *_ALL, allowance)
    finally:
        database.close()
