"""Copies a recording: a time span, selected topics, or to another format."""

from __future__ import annotations

import shutil
from pathlib import Path
from struct import error as StructError
from typing import NamedTuple

from kbot.record.entry import RecordedMessage, UnusableType
from kbot.record.formats import NOTES_TOPIC
from kbot.record.reader import Recording
from kbot.record.recorder import DESCRIPTION_TOPIC
from kbot.record.world_recorder import WORLD_TOPIC
from kbot.record.writer import open_writer, spare_recording
from kbot.text import KbotError

ROSBAG2 = "rosbag2.serialized_metadata"
"""The metadata in which rosbag2 counts the messages of its own MCAP files. A copy may have fewer messages."""
ALWAYS = frozenset({DESCRIPTION_TOPIC, "/tf_static", WORLD_TOPIC})
"""Topics that a cut keeps from before its start: they are rarely published, mostly at the start, and all
later messages depend on them."""


class Copied(NamedTuple):
    """The number of messages that were written, and what is missing."""

    messages: int
    broken: str
    """Why the source is incomplete, empty if it is complete."""
    left_out: dict[str, str]
    """Why messages of some topics could not be written, by topic."""


def copy_recording(
    path: str,
    target: str,
    *,
    start: float | None = None,
    end: float | None = None,
    topics: tuple[str, ...] = (),
) -> Copied:
    """Write the messages from `start` to `end` (seconds of the recording's clock) to a new recording.

    Messages of the topics in `ALWAYS` are kept even if they are before `start`. Topics whose type is not
    usable are left out.

    Raises:
        KbotError: a file cannot be read or written, a topic does not exist, or the time span is empty.
    """
    recording = Recording(path)
    spare_recording(path, target)
    if topics:
        topics = recording.require_topics(topics)
    if start is not None and end is not None and end < start:
        raise KbotError(f"the end of the cut, {end:g} s, is before its start, {start:g} s")
    first = None if start is None else round(start * 1e9)
    last = None if end is None else round(end * 1e9)
    summary = recording.summary()
    if first is not None and summary.end is not None and first > summary.end:
        raise KbotError(
            f"{path} ends at {summary.end * 1e-9:g} s, before the start of the cut at {start:g} s"
        )
    if last is not None and summary.start is not None and last < summary.start:
        raise KbotError(f"{path} begins at {summary.start * 1e-9:g} s, after the end of the cut at {end:g} s")
    notes = {name: values for name, values in summary.notes.items() if name != ROSBAG2}
    if first is not None or last is not None or topics:
        notes = {
            ("kbot.cut" if name == "kbot" else name): v for name, v in notes.items() if name != "kbot.end"
        }
    writer = open_writer(target)
    count, left_out = 0, dict[str, str]()
    try:
        for name, values in notes.items():
            writer.annotate(name, values)
        for entry in recording.entries():
            if _wanted(entry, first, last, topics) and entry.topic not in left_out:
                try:
                    writer.write(entry)
                except UnusableType as error:
                    left_out[entry.topic] = str(error).removeprefix(f"{path}: ")
                    continue
                except (OverflowError, StructError, ValueError) as error:
                    # for example a time outside the range of the format, or a name that is not valid Unicode
                    raise KbotError(f"{entry.place} cannot be written in this format: {error}") from None
                count += 1
        writer.close()
    except (OSError, KbotError) as error:
        writer.abandon()
        _remove(target)
        raise KbotError(f"{target} was not written: {getattr(error, 'strerror', None) or error}") from None
    return Copied(count, summary.broken, left_out)


def _wanted(entry: RecordedMessage, first: int | None, last: int | None, topics: tuple[str, ...]) -> bool:
    if entry.topic == NOTES_TOPIC or (topics and entry.topic not in topics):
        return False
    if last is not None and entry.nanoseconds > last:
        return False
    return first is None or entry.nanoseconds >= first or entry.topic in ALWAYS


def _remove(target: str) -> None:
    path = Path(target)
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
