"""Pictures as grey values."""

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

MOST_PIXELS = 100_000_000
"""A picture of more is taken for a mistake."""


def read_picture(path: str | Path) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Greys from 0 black to 1 white, the mean of the colours (rows from the top, columns), and where the
    picture is opaque.

    Raises:
        KbotError: the file is missing, no picture, or far too large for one.
    """
    from PIL import Image, UnidentifiedImageError

    file = Path(path)
    try:
        check_regular(file)
        with Image.open(file) as image:
            if image.width * image.height > MOST_PIXELS:
                raise KbotError(f"the picture {file} has {image.width} x {image.height} pixels: too many")
            top = _white(image)
            pixels = np.asarray(image.convert("RGBA") if top == 255 else image, dtype=np.float64)
    except FileNotFoundError:
        siblings = [p.name for p in file.parent.iterdir()] if file.parent.is_dir() else []
        near = did_you_mean(file.name, siblings)
        raise KbotError(f"the picture {file} does not exist" + (f": {near}" if near else "")) from None
    except UnidentifiedImageError:
        raise KbotError(f"the picture {file} is of no kind that can be read: a PNG or a PGM is") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise KbotError(f"the picture {file} cannot be read: {error}") from None
    if pixels.ndim == 2:
        return pixels / top, np.ones(pixels.shape, dtype=bool)
    return pixels[..., :3].mean(axis=2) / top, pixels[..., 3] == top


def _white(image: Image) -> int:
    """The value that is white; pictures of 16 bits keep theirs."""
    return 65535 if image.mode.startswith("I") else 255
