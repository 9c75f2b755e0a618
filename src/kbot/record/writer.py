"""Opens a new recording in the format that its name gives."""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path

from kbot.record.formats import RecordingWriter
from kbot.text import KbotError

SUFFIXES = {".mcap": "an MCAP file", ".bag": "a bag of ROS 1", "": "a folder as rosbag2 has it"}

_ENDINGS = (".mcap", ".bag", ".bag.active", ".db3")
_BEGINNINGS = (b"\x89MCAP", b"#ROSBAG V", b"SQLite format 3\0")


def open_writer(path: str, *, compress: bool = True) -> RecordingWriter:
    """A new recording: `.mcap`, `.bag` (ROS 1), or without suffix a rosbag2 folder.

    Raises:
        KbotError: the suffix says no format, something is there already, or it cannot be made.
    """
    target = Path(path)
    if target.suffix not in SUFFIXES:
        known = ", ".join(f"{suffix or 'no suffix'} is {what}" for suffix, what in SUFFIXES.items())
        raise KbotError(f"{path}: '{target.suffix}' is no kind of recording; {known}")
    if target.exists():
        raise KbotError(f"{path} is there already; a recording overwrites nothing")
    try:
        match target.suffix:
            case ".mcap":
                # lazy in this module: one format needs no other's writer
                from kbot.record.mcap_file import McapWriter

                return McapWriter(path, compress=compress)
            case ".bag":
                from kbot.record.bags.ros1_writer import Ros1Writer

                return Ros1Writer(path)
            case _:
                from kbot.record.bags.ros2_writer import Ros2Writer

                return Ros2Writer(path)
    except FileExistsError as error:  # of somebody else, made since
        raise KbotError(f"{path} cannot be written: {error.strerror}") from None
    except OSError as error:
        remove_recording(target)
        raise KbotError(f"{path} cannot be written: {error.strerror or error}") from None


def spare_recording(recording: str, target: str) -> None:
    """Make sure that what is made of a recording is written neither over it nor into its folder.

    Raises:
        KbotError: it would be.
    """
    source, file = Path(recording), Path(target)
    with suppress(OSError, ValueError):
        if file.exists() and file.samefile(source):
            raise KbotError(f"{target} is the recording itself; name another file to write")
        if source.is_dir() and file.resolve().is_relative_to(source.resolve()):
            raise KbotError(f"{target} lies in the folder of the recording; name a file outside {recording}")


def spare_recordings(target: str) -> None:
    """Make sure that what is no recording is written over none. Raises KbotError: it would be."""
    with suppress(OSError, ValueError):
        if _is_a_recording(Path(target)):
            raise KbotError(f"{target} is a recording, which nothing else is written over; name another file")


def _is_a_recording(file: Path) -> bool:
    """Whether there is one, or a part of one, by its first bytes, its name or its folder."""
    if not file.is_file():
        return False
    if file.name.endswith(_ENDINGS) or (file.parent / "metadata.yaml").is_file():
        return True
    with file.open("rb") as stream:
        return stream.read(16).startswith(_BEGINNINGS)


def remove_recording(target: Path) -> None:
    """Take away one that has nothing in it, so that it is not in the way of the next."""
    if target.is_dir():
        shutil.rmtree(target, ignore_errors=True)
    else:
        with suppress(OSError):
            target.unlink(missing_ok=True)
