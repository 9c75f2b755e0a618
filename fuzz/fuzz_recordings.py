"""Fuzzes the readers of recordings: MCAP, bags of ROS 1, and folders of rosbag2 with their metadata.

A file with any bytes is either read or refused with a KbotError of one line. The recordings are written by
KBot and by the mcap library. tests/record/test_hostile_recordings.py has the inputs that failed.
"""

import sqlite3
import tempfile
from contextlib import closing, suppress
from functools import cache, partial
from pathlib import Path

from choices import Choices
from edits import edited
from mcap.writer import CompressionType, Writer

from kbot.messages import String, TFMessage
from kbot.record import limits
from kbot.record.copy import copy_recording
from kbot.record.feed import Packet
from kbot.record.index import open_index
from kbot.record.reader import Recording
from kbot.record.writer import open_writer
from kbot.text import KbotError

limits.LARGEST_PIECE = 1 << 20
limits._FREE = 1 << 26
TOPICS = {"/chatter": String("word"), "/tf": TFMessage()}


def files(kind: str, folder: Path) -> tuple[Path, Path]:
    """The recording, and the file in it whose bytes are fuzzed."""
    if kind in ("rosbag2", "metadata"):
        run = folder / "run"
        return run, run / ("metadata.yaml" if kind == "metadata" else "run.db3")
    path = folder / f"run.{kind}"
    return path, path


def write_seed(kind: str, folder: Path) -> None:
    """Write a small recording without compression and checksums, which would reject most changed bytes."""
    recording, _ = files(kind, folder)
    if kind == "mcap":
        with recording.open("wb") as stream:
            mcap = Writer(stream, compression=CompressionType.NONE, enable_crcs=False, chunk_size=300)
            mcap.start("ros2", "")
            for number, (topic, message) in enumerate(TOPICS.items()):
                packet = Packet(topic, message, 1)
                text = packet.ros2_definition[0].encode()
                schema = mcap.register_schema(f"own_msgs/msg/T{number}", "ros2msg", text)
                channel = mcap.register_channel(topic, "cdr", schema)
                for time in range(4):
                    mcap.add_message(channel, time, packet.cdr, time)
            mcap.add_metadata("kbot", {"robot": "kbot"})
            mcap.finish()
        return
    writer = open_writer(str(recording))
    for time in range(1, 5):
        for topic, message in TOPICS.items():
            writer.write(Packet(topic, message, time))
    writer.close()
    if kind == "rosbag2":
        with closing(sqlite3.connect(recording / "run.db3", isolation_level=None)) as database:
            database.execute("PRAGMA page_size = 512")
            database.execute("VACUUM")


def read(recording: Path, copied: str) -> None:
    """Use everything that reads a recording, and copy it to the format of a name. Raises KbotError."""
    found = Recording(str(recording)).summary()
    for entry in Recording(str(recording)).entries():
        with suppress(KbotError):
            entry.message()
    with suppress(KbotError):
        index = open_index(str(recording))
        for topic in found.topics:
            index.newest(topic, index.end)
        list(index.between(list(found.topics), index.start - 1, index.end))
        index.close()
    with tempfile.TemporaryDirectory() as folder, suppress(KbotError):
        copy_recording(str(recording), f"{folder}/{copied}")


@cache
def prepared(kind: str) -> tuple[Path, Path, list[bytes]]:
    """The recording, the file in it that is fuzzed, and its valid content."""
    folder = Path(kind).absolute()
    folder.mkdir()
    write_seed(kind, folder)
    recording, fuzzed = files(kind, folder)
    return recording, fuzzed, [fuzzed.read_bytes()]


def one_input(kind: str, choices: Choices) -> None:
    recording, fuzzed, seeds = prepared(kind)
    fuzzed.write_bytes(edited(choices, seeds))
    try:
        read(recording, choices.pick(("copy.bag", "copy.mcap", "copy")))
    except KbotError as refusal:
        if "\n" in str(refusal):
            raise AssertionError("the error has two lines") from refusal


TARGETS = {kind: partial(one_input, kind) for kind in ("mcap", "bag", "rosbag2", "metadata")}
