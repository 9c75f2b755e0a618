"""Folders of rosbag2: their metadata, and the files that it names."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath
from typing import Any

from kbot.record.entry import Entry
from kbot.record.limits import Allowance, TooLarge, inflate, size_on_disk

NEWEST_VERSION = 9
"""Of the metadata. Later ones may mean something else by the same names."""
STORAGES = "sqlite3", "mcap"
_LARGEST_METADATA = 1 << 24
"""Bytes. A recording of 1000 topics has 1 MB."""
_DEEPEST = 50
"""Levels of YAML. The library in C recurses through them until the process has no stack left."""
_COPY_BYTES = 1 << 20


class Folder:
    """What `metadata.yaml` tells. `files` are in the order of time."""

    def __init__(self, path: Path) -> None:
        """Raises ValueError: it does not tell what is needed."""
        self.path = path
        facts = _metadata(path / "metadata.yaml")
        version = str(facts.get("version", ""))
        if not version.isdecimal() or len(version) > 3 or int(version) > NEWEST_VERSION:
            raise ValueError(f"its metadata is of version {version[:20]!r}; known are 1 to {NEWEST_VERSION}")
        self.storage = str(facts.get("storage_identifier", ""))
        if self.storage not in STORAGES:
            raise ValueError(f"the storage {self.storage[:40]!r} is not known")
        mode = str(facts.get("compression_mode", "")).lower()
        self.is_compressed, self.has_compressed_messages = mode == "file", mode == "message"
        compression = facts.get("compression_format", "")
        if mode not in ("", "none") and (compression != "zstd" or mode not in ("file", "message")):
            raise ValueError(f"the compression {compression!r:.40} of each {mode[:40]} is not known")
        names = facts.get("relative_file_paths")
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise ValueError("its metadata has no list relative_file_paths")
        # older versions have the folder's name before the file's; each file once, however often it is named
        self.files = list(dict.fromkeys(path / PurePath(name).name for name in names))
        for file in self.files:
            if not file.is_file():
                raise ValueError(f"{file} is missing")

    @contextmanager
    def opened(self) -> Iterator[list[Path]]:
        """Its files, decompressed if they are compressed as a whole."""
        if not self.is_compressed:
            yield self.files
            return
        folder = Path(tempfile.mkdtemp(prefix="kbot-"))
        try:
            left = 64 * size_on_disk(self.path) + (1 << 30)
            found = []
            for number, file in enumerate(self.files):
                target = folder / f"{number}-{file.stem}"
                left = _decompress(file, target, left)
                found.append(target)
            yield found
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def whole(self, entry: Entry, allowance: Allowance) -> Entry:
        """A message as it was before it was compressed. Raises ValueError: it is damaged."""
        if not self.has_compressed_messages:
            return entry
        try:
            data = inflate(entry.data, "zstd")
        except TooLarge as error:
            raise TooLarge(f"{entry.topic} at {entry.nanoseconds * 1e-9:.3f} s: {error}") from None
        allowance.charge(len(data))
        return entry.with_data(data)


def _metadata(file: Path) -> dict[str, Any]:
    """All scalars as text: a number may have any length. Raises ValueError: it is not such a file."""
    import yaml

    if file.stat().st_size > _LARGEST_METADATA:
        raise ValueError(f"its metadata has more than {_LARGEST_METADATA:,} bytes")
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
    try:
        text = file.read_text(encoding="utf-8")
        depth = 0
        for event in yaml.parse(text, loader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST:
                raise ValueError(f"its metadata is nested more than {_DEEPEST} deep")
        found = yaml.load(text, loader)
        facts = found["rosbag2_bagfile_information"]
        facts.get("version")
    except (yaml.YAMLError, LookupError, TypeError, AttributeError, RecursionError) as error:
        words = " ".join(str(error).split())
        raise ValueError(f"its metadata is not that of rosbag2: {words[:200]}") from None
    return dict(facts)


def _decompress(file: Path, target: Path, most: int) -> int:
    """How many bytes of `most` are left. Raises ValueError: it is damaged, or larger."""
    import zstandard

    try:
        with (
            file.open("rb") as packed,
            zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True) as reader,
            target.open("wb") as out,
        ):
            while data := reader.read(_COPY_BYTES):
                most -= len(data)
                if most < 0:
                    raise ValueError(f"{file} decompresses to more than 64 times its size and 1 GiB")
                out.write(data)
    except zstandard.ZstdError as error:
        raise ValueError(f"{file}: {error}") from None
    return most
