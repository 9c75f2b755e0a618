"""What a screenshot shows: a PNG as an array, and where a colour is in it."""

import struct
import zlib
from typing import Any

import numpy as np


def screenshot(page: Any) -> np.ndarray:
    """The canvas as a person sees it, (height, width, 3) in 0..255."""
    page.evaluate("kbot.drawn()")
    return decode_png(page.locator(".picture").screenshot())


def decode_png(data: bytes) -> np.ndarray:
    """An 8-bit RGB or RGBA PNG without interlacing, as browsers write them; (height, width, 3)."""
    at, packed, width, height, channels = 8, b"", 0, 0, 0
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert depth == 8
            channels = {2: 3, 6: 4}[colour]
        elif kind == b"IDAT":
            packed += body
        at += length + 12
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * channels)
    image = np.zeros((height, width * channels), np.uint8)
    above = np.zeros(width * channels, np.uint8)
    for row in range(height):
        above = image[row] = _unfilter(int(rows[row, 0]), rows[row, 1:], above, channels)
    return image.reshape(height, width, channels)[..., :3]


def _unfilter(kind: int, line: np.ndarray, above: np.ndarray, step: int) -> np.ndarray:
    if kind == 0:
        return line
    if kind == 2:
        return line + above
    out, up, raw = [0] * step + line.tolist(), [0] * step + above.tolist(), line.tolist()
    for i, value in enumerate(raw, start=step):
        left, top, corner = out[i - step], up[i], up[i - step]
        if kind == 1:
            guess = left
        elif kind == 3:
            guess = (left + top) // 2
        else:
            away = [abs(top - corner), abs(left - corner), abs(left + top - 2 * corner)]
            guess = (left, top, corner)[away.index(min(away))]
        out[i] = (value + guess) & 255
    return np.array(out[step:], np.uint8)


def blue(image: np.ndarray) -> np.ndarray:
    """Where the picture is as blue as KBot's plate, (height, width)."""
    r, g, b = (image[..., i].astype(int) for i in range(3))
    return (b > 90) & (r < b // 2) & (g < b // 2)


def middle(mask: np.ndarray) -> tuple[float, float]:
    """Mean column and row of a mask."""
    rows, columns = np.nonzero(mask)
    return float(columns.mean()), float(rows.mean())


def id_image(page: Any) -> tuple[np.ndarray, list[str]]:
    """Index of the link at each pixel by the page's own buffer, (height, width), -1 for none; the links."""
    seen = page.evaluate("kbot.ids()")
    runs = np.array(seen["runs"]).reshape(-1, 2)
    return np.repeat(runs[:, 0], runs[:, 1]).reshape(seen["height"], seen["width"]), seen["links"]


def pixels_per_metre(page: Any) -> float:
    """How large a metre on the ground is in the middle of the picture."""
    camera = page.evaluate("kbot.camera()")
    clip = np.array(camera["clipFromWorld"]).reshape(4, 4)
    ends = []
    for x in (-0.05, 0.05):
        seen = clip @ (x, 0.0, 0.0, 1.0)
        ends.append(seen[:2] / seen[3] * (camera["width"] / 2, camera["height"] / 2))
    return float(np.linalg.norm(ends[1] - ends[0]) / 0.1)
