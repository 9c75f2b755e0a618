"""The page's colours (`web/src/view/palette.ts`), in 0..1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Theme = Literal["dark", "light"]
Colour = NDArray[np.float64]


def _rgb(code: int) -> Colour:
    return np.array([code >> 16 & 255, code >> 8 & 255, code & 255]) / 255.0


@dataclass(frozen=True, slots=True, eq=False)
class Palette:
    """The colours of one theme.

    `shadow` is how dark the floor is under the robot, in 0..1. `mark` is the colour of a path on the floor.
    """

    background: Colour
    floor: Colour
    line: Colour
    major_line: Colour
    mark: Colour
    shadow: float


PALETTES: dict[Theme, Palette] = {
    "dark": Palette(_rgb(0x0F1318), _rgb(0x1B222B), _rgb(0x2A333F), _rgb(0x3D4A5A), _rgb(0x5AA9FF), 0.5),
    "light": Palette(_rgb(0xEEF1F5), _rgb(0xFBFCFD), _rgb(0xDDE2E9), _rgb(0xBCC5D0), _rgb(0x0A66C8), 0.22),
}
UNPAINTED = (0.72, 0.74, 0.78, 1.0)
"""The colour of a shape without a material, in pictures and in the page."""
AXIS_X, AXIS_Y = _rgb(0xE5484D), _rgb(0x46A758)
