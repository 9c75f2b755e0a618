"""The look of a picture: camera direction, size and colours."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.render.palette import Theme
from kbot.text import KbotError

MOST_PIXELS = 8192
FIELD_OF_VIEW = math.radians(32.0)
"""The vertical angle of the page's camera."""
_MARGIN = 1.35 * 1.05
"""How much farther off than a sphere that just fits, as in the page."""


@dataclass(frozen=True, slots=True)
class Look:
    """The camera looks from `azimuth` and `elevation` in degrees: 0, 0 is ahead of the robot (+x), azimuth 90
    its left side (+y), elevation 90 above it. `width` and `height` are in pixels."""

    width: int = 1280
    height: int = 720
    azimuth: float = 215.0
    elevation: float = 28.0
    transparent: bool = False
    theme: Theme = "dark"

    def __post_init__(self) -> None:
        if not (1 <= self.width <= MOST_PIXELS and 1 <= self.height <= MOST_PIXELS):
            raise KbotError(f"a picture has 1 to {MOST_PIXELS} pixels a side, not {self.width}x{self.height}")
        if not (math.isfinite(self.azimuth) and -90.0 <= self.elevation <= 90.0):
            raise KbotError("a picture is taken from any azimuth, and an elevation of -90 to 90 degrees")

    @property
    def aspect(self) -> float:
        return self.width / self.height

    def distance(self, radius: float) -> float:
        """How far from its centre a sphere of this radius fills most of the picture, in m."""
        return radius * _MARGIN / math.sin(FIELD_OF_VIEW / 2.0) / min(1.0, self.aspect)

    @property
    def towards_eye(self) -> NDArray[np.float64]:
        """The unit vector (3,) from what is looked at to the eye."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        return np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])

    @property
    def axes(self) -> NDArray[np.float64]:
        """Columns (3, 3): to the right in the picture, up in it, and towards the eye."""
        a = math.radians(self.azimuth)
        right = np.array([-math.sin(a), math.cos(a), 0.0])
        back = self.towards_eye
        return np.stack([right, np.cross(back, right), back], axis=1)
