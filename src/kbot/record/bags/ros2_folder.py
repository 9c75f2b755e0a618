"""Reads the metadata of rosbag2 folders, and finds their files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath

from kbot.record.entry import RecordedMessage
from kbot.record.limits import Allowance, RecordingTooLarge, inflate
from kbot.text.files import read_bytes
from kbot.text.temporary import TemporaryFolder
from kbot.text.yaml import TEXT, YamlError, load_yaml

NEWEST_VERSION = 9
"""Newest known version of the metadata. Later versions may use the same names with another meaning."""
STORAGES = "sqlite3", "mcap"
_LARGEST_METADATA = 1 << 24
"""Bytes. The metadata of a recording with 1000 topics has 1 MB."""
_COPY_BYTES = 1 << 20


class Folder:
    """The contents of `metadata.yaml`. `files` are sorted by time."""

    def __init__(self, path: Path) -> None:
        """Raises ValueError: a required entry is missing or unknown."""
        self.path = path
        facts = _metadata(path / "metadata.yaml")
        version = str(facts.get("version", ""))
        if not version.isdecimal() or len(version) > 3 or int(version) > NEWEST_VERSION:
            raise ValueError(f"its metadata has version {version[:20]!r}; KBot reads 1 to {NEWEST_VERSION}")
        self.storage = str(facts.get("storage_identifier", ""))
        if self.storage not in STORAGES:
            raise ValueError(f"unknown storage {self.storage[:40]!r}")
        mode = str(facts.get("compression_mode", "")).lower()
        self.is_compressed, self.has_compressed_messages = mode == "file", mode == "message"
        compression = facts.get("compression_format", "")
        if mode not in ("", "none") and (compression != "zstd" or mode not in ("file", "message")):
            raise ValueError(f"unknown compression {compression!r:.40} in mode {mode[:40]}")
        names = facts.get("relative_file_paths")
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise ValueError("its metadata has no list relative_file_paths")
        # older versions write the folder before the file name; a file may be listed more than once
        self.files = list(dict.fromkeys(path / PurePath(name).name for name in names))
        for file in self.files:
            if not file.is_file():
                raise ValueError(f"{file} is missing")

    @contextmanager
    def opened(self, allowance: Allowance) -> Iterator[list[Path]]:
        """The files, decompressed to a temporary folder if whole files are compressed.

        Raises:
            ValueError, OSError: a file is damaged, or the disk is full.
            RecordingTooLarge: the allowance is used up.
        """
        if not self.is_compressed:
            yield self.files
            return
        with TemporaryFolder("recording") as folder:
            found = []
            for number, file in enumerate(self.files):
                target = folder / f"{number}-{file.stem}"
                _decompress(file, target, allowance)
                found.append(target)
            yield found

    def whole(self, entry: RecordedMessage, allowance: Allowance) -> RecordedMessage:
        """The message, decompressed if messages are compressed. Raises ValueError: it is damaged."""
        if not self.has_compressed_messages:
            return entry
        try:
            data = inflate(entry.data, "zstd")
        except RecordingTooLarge as error:
            raise RecordingTooLarge(f"{entry.topic} at {entry.nanoseconds * 1e-9:.3f} s: {error}") from None
        allowance.charge(len(data))
        return entry.with_data(data)


def _metadata(file: Path) -> dict[str, object]:
    """The metadata with all scalars as text, because a number may have any length.

    Raises:
        ValueError, OSError: it cannot be read.
    """
    text = read_bytes(file, _LARGEST_METADATA).decode("utf-8")
    try:
        facts = load_yaml(text, TEXT)["rosbag2_bagfile_information"]
        facts.get("version")
    except (YamlError, LookupError, TypeError, AttributeError) as error:
        words = " ".join(str(error).split())
        raise ValueError(f"its metadata is not valid for rosbag2: {words[:200]}") from None
    return dict(facts)


def _decompress(file: Path, target: Path, allowance: Allowance) -> None:
    """Decompress a file. Raises ValueError: it is damaged; RecordingTooLarge: the allowance is used up."""
    from kbot.record.zstd import ZstdError, ZstdFile  # imported lazily: few recordings are compressed

    try:
        with ZstdFile(file) as reader, target.open("wb") as out:
            while data := reader.read(_COPY_BYTES):
                allowance.charge(2 * len(data))  # each byte is written to the disk and read again
                out.write(data)
    except (ZstdError, EOFError) as error:
        raise ValueError(f"{file}: {error}") from None
