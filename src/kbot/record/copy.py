"""Copies a recording: a time span, selected topics, or to another format."""

from __future__ import annotations

from pathlib import Path
from struct import error as StructError
from typing import NamedTuple

from kbot.record.entry import RecordedMessage, UnusableType
from kbot.record.formats import NOTES_TOPIC
from kbot.record.reader import Recording
from kbot.record.recorder import DESCRIPTION_TOPIC
from kbot.record.world_recorder import WORLD_TOPIC
from kbot.record.writer import check_new, open_writer, spare_recording
from kbot.text import KbotError
from kbot.text.files import scratch_folder

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
    check_new(target)
    try:
        # a killed run leaves no half recording with the name of a whole one
        with scratch_folder(target) as scratch:
            count, left_out = _write(recording, scratch, notes, first, last, topics)
            Path(scratch).rename(target)
    except (OSError, KbotError) as error:
        # an error of the writer begins with the scratch path
        reason = str(getattr(error, "strerror", None) or error).rpartition(" cannot be written: ")[2]
        raise KbotError(f"{target} was not written: {reason}") from None
    return Copied(count, summary.broken, left_out)


def _write(
    recording: Recording,
    target: str,
    notes: dict[str, dict[str, str]],
    first: int | None,
    last: int | None,
    topics: tuple[str, ...],
) -> tuple[int, dict[str, str]]:
    """Write the wanted messages. The result is their number, and why topics are left out."""
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
                    left_out[entry.topic] = str(error).removeprefix(f"{recording.path}: ")
                    continue
                except (OverflowError, StructError, ValueError) as error:
                    # for example a time outside the range of the format, or a name that is not valid Unicode
                    raise KbotError(f"{entry.place} cannot be written in this format: {error}") from None
                count += 1
        writer.close()
    except (OSError, KbotError):
        writer.abandon()
        raise
    return count, left_out


def _wanted(entry: RecordedMessage, first: int | None, last: int | None, topics: tuple[str, ...]) -> bool:
    if entry.topic == NOTES_TOPIC or (topics and entry.topic not in topics):
        return False
    if last is not None and entry.nanoseconds > last:
        return False
    return first is None or entry.nanoseconds >= first or entry.topic in ALWAYS
