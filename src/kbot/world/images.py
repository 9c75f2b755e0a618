"""Pictures as grey values: PGM and PNG."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kbot.text import KbotError
from kbot.text.files import check_regular

Grey = NDArray[np.uint8]
_HEADER = re.compile(rb"(P[25])\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s")


def read_grey(path: str) -> Grey:
    """Grey values (rows, columns), 0 black to 255 white, the first row on top.

    Raises:
        KbotError: the file is missing, or no picture of a kind that is read.
    """
    try:
        check_regular(path)
        data = Path(path).read_bytes()
    except OSError as error:
        raise KbotError(f"the picture {path} cannot be read: {error.strerror}") from None
    if data[:2] in (b"P2", b"P5"):
        return _pgm(path, data)
    if data[:8] == b"\x89PNG\r\n\x1a\n":
        from kbot.world.png import read_png

        return read_png(path, data)
    raise KbotError(f"the picture {path} is neither PGM nor PNG")


def _pgm(path: str, data: bytes) -> Grey:
    header = _HEADER.match(data)
    if header is None:
        raise KbotError(f"the picture {path} is no PGM")
    width, height, most = (int(header[i]) for i in (2, 3, 4))
    if not (0 < width <= 20_000 and 0 < height <= 20_000 and 0 < most < 65536):
        raise KbotError(f"the picture {path} has no sensible size")
    count, body = width * height, data[header.end() :]
    if header[1] == b"P2":
        words = body.split()
        values = np.array([int(w) for w in words[:count] if w.isdigit()], dtype=np.float64)
    else:
        kind = np.dtype(">u2") if most > 255 else np.dtype("u1")
        values = np.frombuffer(body[: count * kind.itemsize], dtype=kind).astype(np.float64)
    if len(values) < count:
        raise KbotError(f"the picture {path} is cut short")
    return np.round(values.reshape(height, width) * (255.0 / most)).astype(np.uint8)
