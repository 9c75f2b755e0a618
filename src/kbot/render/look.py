"""The look of a picture: camera direction, size and colours."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.render.palette import Theme
from kbot.text import KbotError

MOST_PIXELS = 8192
"""The longest side of a picture in pixels."""
FIELD_OF_VIEW = math.radians(32.0)
"""The vertical field of view of the page's camera."""
_MARGIN = 1.35 * 1.05
"""How many times farther than a sphere just fits: 1.35 (`stage.ts`) times 1.05 (`viewpoint.ts`)."""


@dataclass(frozen=True, slots=True)
class Look:
    """The camera looks at the robot from `azimuth` and `elevation`, in degrees.

    0, 0 is in front of the robot (+x), azimuth 90 its left side (+y), elevation 90 above it. `width` and
    `height` are in pixels.
    """

    width: int = 1280
    height: int = 720
    azimuth: float = 215.0
    elevation: float = 28.0
    transparent: bool = False
    theme: Theme = "dark"

    def __post_init__(self) -> None:
        if not (1 <= self.width <= MOST_PIXELS and 1 <= self.height <= MOST_PIXELS):
            raise KbotError(
                f"picture size {self.width}x{self.height}: width and height must be 1 to {MOST_PIXELS} pixels"
            )
        if not (math.isfinite(self.azimuth) and -90.0 <= self.elevation <= 90.0):
            raise KbotError("the azimuth must be finite and the elevation within -90 to 90 degrees")

    @property
    def aspect(self) -> float:
        return self.width / self.height

    def distance(self, radius: float) -> float:
        """Return the camera distance in m at which a sphere of this radius fills most of the picture."""
        return radius * _MARGIN / math.sin(FIELD_OF_VIEW / 2.0) / min(1.0, self.aspect)

    @property
    def towards_eye(self) -> NDArray[np.float64]:
        """The unit vector (3,) from the centre of the view to the eye."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        return np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])

    @property
    def axes(self) -> NDArray[np.float64]:
        """Columns (3, 3): right in the picture, up in it, and towards the eye."""
        a = math.radians(self.azimuth)
        right = np.array([-math.sin(a), math.cos(a), 0.0])
        back = self.towards_eye
        return np.stack([right, np.cross(back, right), back], axis=1)
