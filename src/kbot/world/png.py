"""PNG (ISO/IEC 15948) as grey values: eight and sixteen bits, not interlaced, of any colour type."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from kbot.text import KbotError

_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_LUMA = np.array([0.299, 0.587, 0.114])
MOST_PIXELS = 100_000_000


def read_png(path: str, data: bytes) -> NDArray[np.uint8]:
    """Grey values (rows, columns); what is see-through counts as white.

    Raises:
        KbotError: the file is broken, interlaced, or of fewer than eight bits a channel.
    """
    try:
        return _read(path, data)
    except (struct.error, zlib.error, ValueError, IndexError) as error:
        raise KbotError(f"the picture {path} is broken: {error}") from None


def _read(path: str, data: bytes) -> NDArray[np.uint8]:
    chunks = list(_chunks(data))
    width, height, depth, kind, _, _, interlaced = struct.unpack(">IIBBBBB", chunks[0][1])
    if depth not in (8, 16) or interlaced or kind not in _CHANNELS or width * height > MOST_PIXELS:
        raise KbotError(
            f"the picture {path} is a PNG of a kind that is not read: save it as 8 bit, not interlaced"
        )
    channels = _CHANNELS[kind]
    pixel = channels * depth // 8
    raw = zlib.decompress(b"".join(body for name, body in chunks if name == b"IDAT"))
    rows = _unfiltered(raw, height, width * pixel, pixel)
    values = rows.view(">u2").astype(np.float64) / 257.0 if depth == 16 else rows.astype(np.float64)
    values = values.reshape(height, width, channels)
    if kind == 3:
        palette = next(body for name, body in chunks if name == b"PLTE")
        colours = np.frombuffer(palette, dtype=np.uint8).reshape(-1, 3).astype(np.float64)
        values = colours[values[..., 0].astype(np.intp)]
    grey = values[..., :3] @ _LUMA if values.shape[2] >= 3 else values[..., 0]
    if kind in (4, 6):
        opaque = values[..., -1] / 255.0
        grey = grey * opaque + 255.0 * (1.0 - opaque)
    rounded: NDArray[np.uint8] = np.clip(np.round(grey), 0, 255).astype(np.uint8)
    return rounded


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 8
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        yield data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        at += 12 + length


def _unfiltered(raw: bytes, height: int, width: int, pixel: int) -> NDArray[np.uint8]:
    """Take back what each row was filtered by (section 9 of the standard)."""
    rows = np.frombuffer(raw, dtype=np.uint8)[: height * (width + 1)].reshape(height, width + 1)
    out = np.zeros((height, width), dtype=np.uint8)
    above = np.zeros(width, dtype=np.uint8)
    for index in range(height):
        kind, row = int(rows[index, 0]), rows[index, 1:]
        if kind == 0:
            above = row
        elif kind == 2:
            above = row + above
        elif kind == 1:
            steps = row.reshape(-1, pixel).astype(np.uint64)
            above = np.cumsum(steps, axis=0).astype(np.uint8).reshape(-1)
        else:
            above = _row_by_pixel(row.tolist(), above.tolist(), pixel, kind)
        out[index] = above
    return out


def _row_by_pixel(row: list[int], above: list[int], pixel: int, kind: int) -> NDArray[np.uint8]:
    """The filters that look left and up at once: average (3) and Paeth (4)."""
    done: list[int] = []
    for at, value in enumerate(row):
        left = done[at - pixel] if at >= pixel else 0
        up = above[at]
        if kind == 3:
            guess = (left + up) // 2
        else:
            corner = above[at - pixel] if at >= pixel else 0
            p = left + up - corner
            near = abs(p - left), abs(p - up), abs(p - corner)
            guess = (
                left if near[0] <= near[1] and near[0] <= near[2] else up if near[1] <= near[2] else corner
            )
        done.append((value + guess) & 255)
    return np.array(done, dtype=np.uint8)
