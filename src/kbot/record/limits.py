"""Limits on reading recordings, because a small file can decompress to a huge one."""

from __future__ import annotations

import bz2
from io import BytesIO
from pathlib import Path

from kbot.text import KbotError

LARGEST_PIECE = 192 << 20
"""Bytes of a record, a chunk or a message. Up to three are in memory at once. An image of 8000 x 8000 pixels
has this size, and writers begin a new chunk after 1 to 4 MB."""

_FREE = 2 << 30
_RATIO = 2000
"""A file may decompress to 2 GiB plus 2000 times its size: images of one colour compress by a factor of 2000,
and 2 GiB take 4 s."""
_RECORD = 8192
"""Reading one record of a chunk takes as long as decompressing this many bytes."""
_PART = 1024
"""Converting one object of a message takes as long as decompressing this many bytes."""
_CHARACTER = 256
"""Parsing one character of a definition takes as long as decompressing this many bytes."""
LONGEST_NAME = 255
"""Characters of a topic or a type. ROS generates file names from types, and file names have at most 255
characters."""
_SLOWNESS = {"lz4": 2, "bz2": 6}
"""Decompression time as a multiple of zstd's."""
_READ_BYTES = 1 << 20
"""Bytes to decompress at once. The reader reserves memory for all bytes that it is asked for."""
_KEPT = 1 << 29
"""Bytes of a recording without a usable index that may be held in memory, in addition to 4 times its size."""


class RecordingTooLarge(KbotError):
    """Reading it would take more time or memory than is allowed for a recording of its size."""


class Damaged(Exception):
    """The bytes do not follow the format."""


class Allowance:
    """The remaining cost that one pass over a recording may have."""

    def __init__(self, path: str | Path) -> None:
        self._size = size_on_disk(Path(path))
        self._left = _FREE + _RATIO * self._size

    def charge(
        self, size: int = 0, *, records: int = 0, parts: int = 0, characters: int = 0, compression: str = ""
    ) -> None:
        """Subtract the cost of decompressed bytes, records, parts of messages and characters of definitions.

        Raises:
            RecordingTooLarge: the allowance is used up.
        """
        self._left -= size * _SLOWNESS.get(compression, 1)
        self._left -= records * _RECORD + parts * _PART + characters * _CHARACTER
        if self._left < 0:
            raise RecordingTooLarge(
                f"it decompresses to too much data for a file of {self._size:,} bytes; reading stopped"
            )


def check_names(*names: str) -> None:
    """Check the names of a topic and its type, which are held in memory.

    Raises:
        RecordingTooLarge: one is longer than ROS allows.
    """
    longest = max(names, key=len)
    if len(longest) > LONGEST_NAME:
        raise RecordingTooLarge(
            f"the name {longest[:40]!r}... of a topic or type has {len(longest):,} characters (limit: "
            f"{LONGEST_NAME})"
        )


def check_length(at: int, stated: int, left: int, *, is_skipped: bool = False) -> None:
    """Check the length that a record states.

    A skipped record, such as an attachment, may be larger than LARGEST_PIECE.

    Raises:
        Damaged: the record is longer than the remaining bytes, or than LARGEST_PIECE.
    """
    if stated > left:
        raise Damaged(f"the record at byte {at:,} should have {stated:,} bytes, but only {left:,} are left")
    if stated > LARGEST_PIECE and not is_skipped:
        raise Damaged(f"the record at byte {at:,} has more than {LARGEST_PIECE:,} bytes")


def memory_limit(path: str | Path) -> int:
    """Bytes of a recording that may be held in memory at once."""
    # zstd compresses messages of odometry and lidars to about a quarter
    return _KEPT + 4 * size_on_disk(Path(path))


def size_on_disk(path: Path) -> int:
    """Bytes of a file, or of the files in a folder; 0 if it is gone."""
    try:
        return sum(file.stat().st_size for file in (path.iterdir() if path.is_dir() else (path,)))
    except OSError:
        return 0


def inflate(data: bytes, compression: str, size: int | None = None) -> bytes:
    """Decompress data. `size` is the stated size of the result, None if none is stated.

    Raises:
        ValueError: it is damaged, does not have the stated size, or has an unknown compression.
        RecordingTooLarge: it is larger than LARGEST_PIECE.
    """
    is_large = size is not None and size > LARGEST_PIECE
    most = LARGEST_PIECE if size is None or is_large else size
    # read one byte more than expected, to detect longer data
    found = _inflated(data, compression, most + 1)
    if len(found) > LARGEST_PIECE:
        raise RecordingTooLarge(f"it decompresses to more than {LARGEST_PIECE:,} bytes")
    if size is not None and len(found) != size:
        relation = "more" if len(found) > size else "fewer"
        raise ValueError(f"it decompresses to {relation} than the {size:,} bytes that it states")
    return found


def _inflated(data: bytes, compression: str, most: int) -> bytes:
    """Decompress up to `most` bytes. Raises ValueError: the data is damaged or incomplete."""
    match compression:
        case "" | "none":
            return data
        case "zstd":
            return _unpacked_frames(data, most)
        case "lz4":
            from lz4.frame import LZ4FrameDecompressor

            stream = LZ4FrameDecompressor()
        case "bz2":
            stream = bz2.BZ2Decompressor()
        case _:
            raise ValueError(f"unknown compression {compression!r}")
    try:
        found: bytes = stream.decompress(data, max_length=most)
    except (RuntimeError, OSError, EOFError) as error:
        raise ValueError(f"{compression}: {error}") from None
    if not stream.eof and len(found) < most:
        raise ValueError(f"the {compression} data is incomplete")
    return found


def _unpacked_frames(data: bytes, most: int) -> bytes:
    """Decompress up to `most` bytes of any number of zstd frames. Raises ValueError: one is damaged or
    incomplete."""
    from kbot.record.zstd import ZstdError, ZstdFile  # imported lazily: only this compression needs it

    parts: list[bytes] = []
    try:
        # the unused_data of a ZstdDecompressor would copy the rest for each of millions of empty frames
        with ZstdFile(BytesIO(data)) as reader:
            while part := reader.read(min(most, _READ_BYTES)):
                parts.append(part)
                most -= len(part)
    except (ZstdError, EOFError) as error:
        raise ValueError(f"zstd: {error}") from None
    return b"".join(parts)
