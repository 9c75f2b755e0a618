"""MCAP files, read from front to back: a file that was never closed gives all its whole chunks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from struct import error as StructError

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader

from kbot.record.entry import Entry, Types
from kbot.record.reader import BrokenOff, Note
from kbot.text import KbotError

LARGEST_RECORD = 1 << 30
CARRIED = ("cdr", "ros1")
"""Encodings of messages that are read."""


class McapSource:
    """Messages in CDR or in ROS 1's encoding; others are skipped."""

    kind = "MCAP"

    def __init__(self, path: str) -> None:
        self._path = path

    def entries(self, note: Note) -> Iterator[Entry]:
        """Raises BrokenOff, KbotError: see `Source`."""
        types, schemas, channels = Types(), dict[int, Schema](), dict[int, Channel]()
        started = False
        faults = unreadable()
        with Path(self._path).open("rb") as stream:
            records = StreamReader(stream, validate_crcs=True, record_size_limit=LARGEST_RECORD).records
            while True:
                try:
                    record = next(records)
                except StopIteration:
                    return
                except faults as error:
                    if not started:
                        told = str(error) if isinstance(error, McapError) else ""
                        why = told or "it ends before its first record"
                        raise KbotError(f"{self._path} is no MCAP file: {why}") from None
                    raise BrokenOff("it was not closed: what follows its last whole chunk is lost") from None
                started = True
                match record:
                    case Schema():
                        schemas[record.id] = record
                        if record.encoding in ("ros2msg", "ros1msg"):
                            types.learn(full_name(record.name), record.data.decode(errors="replace"))
                    case Channel():
                        channels[record.id] = record
                    case Metadata():
                        note(record.name, dict(record.metadata))
                    case Message():
                        channel = channels[record.channel_id]
                        schema = schemas.get(channel.schema_id)
                        if schema is None or channel.message_encoding not in CARRIED:
                            continue
                        is_ros1 = channel.message_encoding == "ros1"
                        name = full_name(schema.name)
                        yield Entry(channel.topic, name, record.log_time, record.data, types, is_ros1=is_ros1)


def full_name(name: str) -> str:
    """A type as ROS 2 writes it, `std_msgs/msg/String`, of either writing."""
    package, _, rest = name.partition("/")
    return f"{package}/msg/{rest.removeprefix('msg/')}"


def unreadable() -> tuple[type[Exception], ...]:
    """What reading raises where a file is no MCAP, or broken."""
    import zstandard

    return (McapError, EOFError, StructError, ValueError, RuntimeError, zstandard.ZstdError)
