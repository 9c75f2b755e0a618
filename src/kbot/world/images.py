"""Reads pictures as grey values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kbot.text import KbotError
from kbot.text.files import check_regular
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from PIL.Image import Image

MOST_PIXELS = 50_000_000
"""Of a map: 350 m by 350 m at 5 cm. A few bytes may claim more, and one of so many takes 0.8 GB to read."""
FORMATS = ("PNG", "PPM", "BMP", "JPEG", "TIFF", "GIF", "WEBP", "TGA")
"""PGM is a PPM. Others are not looked at: Pillow runs a program to read EPS."""


def read_picture(
    path: str | Path, most_pixels: int = MOST_PIXELS
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Greys from 0 black to 1 white, the mean of the colours (rows from the top, columns), and where the
    picture is opaque.

    Raises:
        KbotError: the file is missing, not a picture, or far too large for one.
    """
    from PIL import Image, UnidentifiedImageError  # few worlds have pictures: start-up time

    file = Path(path)
    try:
        check_regular(file)
        with Image.open(file, formats=FORMATS) as image:
            if image.width * image.height > most_pixels:
                size = f"{image.width} x {image.height} pixels"
                raise KbotError(f"the picture {file} has {size}: more than {most_pixels}")
            return _greys(image)
    except FileNotFoundError:
        siblings = [p.name for p in file.parent.iterdir()] if file.parent.is_dir() else []
        near = did_you_mean(file.name, siblings)
        raise KbotError(f"the picture {file} does not exist" + (f": {near}" if near else "")) from None
    except UnidentifiedImageError:
        raise KbotError(f"the picture {file} is of no kind that can be read: a PNG or a PGM is") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise KbotError(f"the picture {file} cannot be read: {error}") from None


def _greys(image: Image) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The work is done in place and in single precision, which holds 16 bits: pictures are large."""
    if image.mode.startswith("I"):  # of 16 bits
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
