"""Reads images as grey values."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kbot.text import KbotError
from kbot.text.files import read_bytes
from kbot.text.folders import names_in
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from PIL.Image import Image

MOST_PIXELS = 50_000_000
"""Most pixels of a map: 350 m by 350 m at 5 cm.

Reading as many takes 0.8 GB, and a small file can claim more.
"""
MOST_BYTES = 8 * MOST_PIXELS
"""Size of the largest file: a pixel has at most four channels of 16 bits."""
FORMATS = ("PNG", "PPM", "BMP", "JPEG", "TIFF", "GIF", "WEBP", "TGA")
"""Accepted formats (PPM includes PGM). Others are unsafe: Pillow runs a program to read EPS."""


def read_picture(
    path: str | Path, most_pixels: int = MOST_PIXELS
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Grey values from 0 (black) to 1 (white), and where the image is opaque. Rows start at the top.

    A grey value is the mean of the colours.

    Raises:
        KbotError: the file is missing, is not an image, or has too many pixels.
    """
    from PIL import Image, UnidentifiedImageError  # imported here for start-up time: few worlds have images

    file = Path(path)
    try:
        content = BytesIO(read_bytes(file, MOST_BYTES, from_pipe=False))
        with Image.open(content, formats=FORMATS) as image:
            if image.width * image.height > most_pixels:
                size = f"{image.width} x {image.height} pixels"
                raise KbotError(f"the image {file} has {size}, more than {most_pixels} pixels")
            return _greys(image)
    except FileNotFoundError:
        near = did_you_mean(file.name, names_in(file.parent))
        raise KbotError(f"the image {file} does not exist" + (f": {near}" if near else "")) from None
    except UnidentifiedImageError:
        raise KbotError(f"the image {file} has an unknown format: convert it to PNG or PGM") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or error
        raise KbotError(f"the image {file} cannot be read: {reason}") from None


def _greys(image: Image) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Convert in place and in single precision, because images are large. It represents 16 bits exactly."""
    if image.mode.startswith("I"):  # 16 bits
        grey = np.array(image, dtype=np.float32)
        grey /= np.float32(65535)
        return grey, np.ones(grey.shape, dtype=bool)
    if image.mode == "L" and "transparency" not in image.info:
        grey = np.array(image, dtype=np.float32)
        grey /= np.float32(255)
        return grey, np.ones(grey.shape, dtype=bool)
    pixels = np.asarray(image.convert("RGBA"))
    grey = pixels[..., :3].sum(axis=2, dtype=np.float32)
    grey /= np.float32(3 * 255)
    return grey, pixels[..., 3] == 255
