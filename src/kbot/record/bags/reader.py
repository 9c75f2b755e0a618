"""Reads ROS 1 bags and rosbag2 folders."""

from __future__ import annotations

import re
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
"""Errors that reading a damaged folder raises."""
_ALL = -1 << 63, 1 << 63
"""The range of times in SQLite: 64-bit integers."""


class Ros1Source:
    """A ROS 1 bag. If it ends before its index, all readable messages are read."""

    kind = "ROS 1 bag"

    def __init__(self, path: str) -> None:
        self._path = path

    def entries(self, note: Note) -> Iterator[RecordedMessage]:
        """Every message by time. Raises KbotError: it is damaged, or not a bag; BrokenOff: see
        `RecordingSource`."""
        allowance = Allowance(self._path)
        bag = Ros1Bag(self._path, allowance)
        try:
            bag.read_index()
        except NoIndex as missing:
            yield from bag.readable_messages(allowance)
            raise BrokenOff(str(missing)) from None
        try:
            yield from in_time_order((chunk.start, bag.messages(chunk, allowance)) for chunk in bag.chunks)
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None


_PART = re.compile(r"(?P<name>.+)_(?P<number>[0-9]{1,9})\.mcap")


class Ros2Source:
    """A rosbag2 folder. If it has no metadata, all messages of its files are read that are complete."""

    kind = "rosbag2"

    def __init__(self, path: str) -> None:
        self._path = Path(path)

    def entries(self, note: Note) -> Iterator[RecordedMessage]:
        """Every message. Raises KbotError: it is damaged, or not a rosbag2 folder; BrokenOff: see
        `RecordingSource`."""
        allowance = Allowance(self._path)
        try:
            folder = read_folder(self._path)
        except NoIndex as missing:
            yield from self._committed(allowance)
            reasons = [str(missing)]
            for file in parts_without_metadata(self._path):
                try:
                    yield from McapSource(str(file)).entries(note)
                except BrokenOff as error:
                    reasons.append(f"{file.name}: {error}")
            raise BrokenOff("; ".join(reasons)) from None
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
            raise unreadable_error(self._path, error) from None
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None

    def _committed(self, allowance: Allowance) -> Iterator[RecordedMessage]:
        """Every committed message in the order it was written."""
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
                raise BrokenOff(f"the rest of {file} cannot be read: {one_line(error)}") from None
            except RecordingTooLarge as error:
                raise KbotError(f"{self._path}: {error}") from None


def read_folder(path: Path) -> Folder:
    """Read the metadata.

    Raises:
        NoIndex: there is none, but the files of one recording.
        KbotError: it is not a rosbag2 folder.
    """
    if not (path / "metadata.yaml").is_file():
        if list(path.glob("*.db3")) or parts_without_metadata(path):
            raise NoIndex("it was not closed, so it has no metadata.yaml")
        files = sorted(path.glob("*.mcap"))
        hint = f"; you can read a file in it: {files[0]}" if files else ""
        raise KbotError(f"{path} is not a rosbag2 folder: it has no metadata.yaml{hint}")
    try:
        return Folder(path)
    except UNREADABLE as error:
        raise unreadable_error(path, error) from None


def parts_without_metadata(path: Path) -> list[Path]:
    """The MCAP files of a folder, in order, if they are parts of one recording: `NAME_0.mcap` and so on."""
    found = {file: _PART.fullmatch(file.name) for file in path.glob("*.mcap") if file.is_file()}
    numbers = {file: int(part["number"]) for file, part in found.items() if part}
    is_one = len(numbers) == len(found) and len({part["name"] for part in found.values() if part}) == 1
    return sorted(numbers, key=numbers.__getitem__) if is_one else []


def unreadable_error(path: Path, error: Exception) -> KbotError:
    """The error for a folder that cannot be read because of another error."""
    return KbotError(
        f"{path} cannot be read as rosbag2: {one_line(error)} (to fix it: ros2 bag reindex {path})"
    )


def one_line(error: Exception) -> str:
    """The text of an error on one line, shortened: SQLite quotes the contents of the file."""
    return " ".join(str(error).split())[:300]


def _messages(file: Path, types: Types, allowance: Allowance) -> Iterator[RecordedMessage]:
    database = SqliteFile(file, types, is_closed=True)
    try:
        yield from database.between(None, *_ALL, allowance)
    finally:
        database.close()
