"""Limits on reading recordings, because a small file can decompress to a huge one."""

from __future__ import annotations

import bz2
from pathlib import Path

from kbot.text import KbotError

LARGEST_PIECE = 192 << 20
"""Bytes of a record, a chunk or a message, of which three are in memory at times. An image of 8000 x 8000
pixels is as large; writers begin a new chunk after 1 to 4 MB."""

_FREE = 2 << 30
_RATIO = 2000
"""A file may decompress to 2 GiB, and to so many times its size beyond: images of one colour reach 2000, and
2 GiB take 4 s."""
_RECORD = 8192
"""Bytes that take as long to decompress as one record in a chunk takes to read."""
_PART = 1024
"""Bytes that take as long to decompress as one object in a message takes to convert."""
_SLOWNESS = {"lz4": 2, "bz2": 6}
"""How much longer than zstd a compression takes."""
_KEPT = 1 << 29
"""Bytes of a recording without a usable index that are held in memory, whatever its size on disk."""


class RecordingTooLarge(KbotError):
    """Reading it would take more time or memory than a recording of its size may."""


class Damaged(Exception):
    """The bytes do not follow the format."""


class Allowance:
    """What one reading of a recording may still cost."""

    def __init__(self, path: str | Path) -> None:
        self._size = size_on_disk(Path(path))
        self._left = _FREE + _RATIO * self._size

    def charge(self, size: int = 0, *, records: int = 0, parts: int = 0, compression: str = "") -> None:
        """Raises RecordingTooLarge: it is used up by decompressed bytes, records or parts of messages."""
        self._left -= size * _SLOWNESS.get(compression, 1) + records * _RECORD + parts * _PART
        if self._left < 0:
            raise RecordingTooLarge(
                f"it decompresses to too much data for its {self._size:,} bytes; reading stopped"
            )


def check_length(at: int, stated: int, left: int, *, is_skipped: bool = False) -> None:
    """Raises Damaged: the record at a place states more bytes than are left, or than LARGEST_PIECE. A record
    that is skipped, as an attachment, may be larger than that."""
    if stated > left:
        raise Damaged(f"the record at byte {at:,} states {stated:,} bytes, and {left:,} are left")
    if stated > LARGEST_PIECE and not is_skipped:
        raise Damaged(f"the record at byte {at:,} has more than {LARGEST_PIECE:,} bytes")


def kept_bytes(path: str | Path) -> int:
    """How much of a recording may be held in memory at once."""
    # zstd compresses messages of odometry and lidars to about a quarter
    return _KEPT + 4 * size_on_disk(Path(path))


def size_on_disk(path: Path) -> int:
    """Bytes of a file, or of the files in a folder; 0 if it is gone."""
    try:
        return sum(file.stat().st_size for file in (path.iterdir() if path.is_dir() else (path,)))
    except OSError:
        return 0


def inflate(data: bytes, compression: str, size: int | None = None) -> bytes:
    """Decompressed data, which is of the stated `size` where one is stated.

    Raises:
        ValueError: it is damaged, not of that size, or of an unknown compression.
        RecordingTooLarge: it is larger than LARGEST_PIECE.
    """
    is_large = size is not None and size > LARGEST_PIECE
    most = LARGEST_PIECE if size is None or is_large else size
    # read one byte more than expected, to detect longer data
    found = _inflated(data, compression, most + 1)
    if len(found) > LARGEST_PIECE:
        raise RecordingTooLarge(f"it decompresses to more than {LARGEST_PIECE:,} bytes")
    if size is not None and len(found) != size:
        raise ValueError(f"{size:,} bytes are stated, and {len(found):,} or more are there")
    return found


def _inflated(data: bytes, compression: str, most: int) -> bytes:
    """The first bytes of the decompressed data. Raises ValueError: damaged, or not complete."""
    match compression:
        case "" | "none":
            return data
        case "zstd":
            import zstandard  # lazy in this module: one compression needs no other's library

            try:
                with zstandard.ZstdDecompressor().stream_reader(data, read_across_frames=True) as reader:
                    return reader.read(most)
            except zstandard.ZstdError as error:
                raise ValueError(str(error)) from None
        case "lz4":
            from lz4.frame import LZ4FrameDecompressor

            stream = LZ4FrameDecompressor()
        case "bz2":
            stream = bz2.BZ2Decompressor()
        case _:
            raise ValueError(f"the compression {compression!r} is not known")
    try:
        found: bytes = stream.decompress(data, max_length=most)
    except (RuntimeError, OSError, EOFError) as error:
        raise ValueError(f"{compression}: {error}") from None
    if not stream.eof and len(found) < most:
        raise ValueError(f"the {compression} data is not complete")
    return found
