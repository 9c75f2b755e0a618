"""Creates a recording in the format that its name selects."""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path

from kbot.record.formats import RecordingWriter
from kbot.text import KbotError

SUFFIXES = {".mcap": "an MCAP file", ".bag": "a ROS 1 bag", "": "a rosbag2 folder"}

_ENDINGS = (".mcap", ".bag", ".bag.active", ".db3")
_BEGINNINGS = (b"\x89MCAP", b"#ROSBAG V", b"SQLite format 3\0")


def check_new(path: str) -> None:
    """Check the name of a new recording. Raises KbotError: the suffix is unknown, or the file exists."""
    target = Path(path)
    if target.suffix not in SUFFIXES:
        known = ", ".join(f"{suffix or 'no suffix'} is {what}" for suffix, what in SUFFIXES.items())
        raise KbotError(f"{path}: unknown recording format '{target.suffix}'; {known}")
    if target.exists():
        raise KbotError(f"{path} already exists; choose another name for the recording")


def open_writer(path: str, *, compress: bool = True) -> RecordingWriter:
    """Create a recording: `.mcap`, `.bag` (ROS 1), or a rosbag2 folder if there is no suffix.

    Raises:
        KbotError: the suffix is unknown, the file exists, or it cannot be created.
    """
    check_new(path)
    target = Path(path)
    try:
        match target.suffix:
            case ".mcap":
                # imported lazily: only MCAP files need it
                from kbot.record.mcap_writer import McapWriter

                return McapWriter(path, compress=compress)
            case ".bag":
                from kbot.record.bags.ros1_writer import Ros1Writer

                return Ros1Writer(path)
            case _:
                from kbot.record.bags.ros2_writer import Ros2Writer

                return Ros2Writer(path)
    except FileExistsError as error:  # another program created it after the check above
        raise KbotError(f"{path} cannot be written: {error.strerror}") from None
    except OSError as error:
        remove_recording(target)
        raise KbotError(f"{path} cannot be written: {error.strerror or error}") from None


def spare_recording(recording: str, target: str) -> None:
    """Refuse a target that would overwrite a recording or is inside its folder.

    Raises:
        KbotError: the target is the recording or is inside its folder.
    """
    source, file = Path(recording), Path(target)
    with suppress(OSError, ValueError):
        if file.exists() and file.samefile(source):
            raise KbotError(f"{target} is the recording itself; choose another file to write")
        if source.is_dir() and file.resolve().is_relative_to(source.resolve()):
            raise KbotError(f"{target} is in the folder of the recording; choose a file outside {recording}")


def spare_recordings(target: str) -> None:
    """Refuse to overwrite a recording with another kind of file. Raises KbotError: the target is a
    recording."""
    with suppress(OSError, ValueError):
        if _is_a_recording(Path(target)):
            raise KbotError(f"{target} is a recording and is not overwritten; choose another file")


def _is_a_recording(file: Path) -> bool:
    """Whether a file is a recording or a part of one, by its first bytes, its name or its folder."""
    if not file.is_file():
        return False
    if file.name.endswith(_ENDINGS) or (file.parent / "metadata.yaml").is_file():
        return True
    with file.open("rb") as stream:
        return stream.read(16).startswith(_BEGINNINGS)


def remove_recording(target: Path) -> None:
    """Delete an empty recording, so that its name is free for the next one."""
    if target.is_dir():
        shutil.rmtree(target, ignore_errors=True)
    else:
        with suppress(OSError):
            target.unlink(missing_ok=True)
