"""Line sensors: the brightness of the floor under a row of detectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.messages.sensing import Float32MultiArray, MultiArrayDimension, MultiArrayLayout
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import Plane, World
from kbot.world.footprints import footprint, top
from kbot.world.world import FURTHEST

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Luminance of red, green and blue (ITU-R BT.709)."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Line(Spec):
    """A row of `eyes` along y, `spacing` m apart, the first on the left.

    Each reads 0 (black) to 1 (white).
    """

    kind: ClassVar[str] = "line"
    rate: float = 50.0
    eyes: int = 5
    spacing: float = 0.01
    noise: Noise = NONE

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= self.eyes <= 1000 or not self.spacing >= 0.0:
            raise KbotError(
                f"{self.label}: a line sensor must have 1 to 1000 eyes and a spacing of at least 0 m,"
                f" not {self.eyes} eyes and {self.spacing} m"
            )

    def mount(self, simulation: Simulation) -> LineSensor:
        return LineSensor(simulation, self)


@dataclass(frozen=True, slots=True)
class _Surface:
    corners: NDArray[np.float64]
    height: float
    brightness: float


class LineSensor(Sensor[Float32MultiArray]):
    """Publishes a Float32MultiArray. It sees static bodies from above, painted or solid."""

    message_type = Float32MultiArray
    spec: Line

    def __init__(self, simulation: Simulation, spec: Line) -> None:
        super().__init__(simulation, spec)
        across = (np.arange(spec.eyes) - (spec.eyes - 1) / 2.0) * -spec.spacing
        self._eyes = np.stack([0.0 * across, across, 0.0 * across], axis=1)
        self._noise = self._noise_of(spec.noise, "eyes", spec.eyes)
        size = MultiArrayDimension("eyes", spec.eyes, spec.eyes)
        self._layout = MultiArrayLayout((size,))

    def _bind(self, model: mujoco.MjModel) -> None:
        super()._bind(model)
        self._surfaces, self._floor = _surfaces(self.simulation.world)
        corners = [surface.corners for surface in self._surfaces]
        self._low = np.array([c.min(axis=0) for c in corners]).reshape(-1, 2)
        self._high = np.array([c.max(axis=0) for c in corners]).reshape(-1, 2)

    def measure(self, sample: int | None = None) -> Float32MultiArray:
        _, _, place, axes = self._place()
        points = place + self._eyes @ axes.T
        seen = np.full(len(points), self._floor)
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        near = np.all((self._low <= high) & (self._high >= low), axis=1)  # most surfaces are far away
        for index in np.flatnonzero(near):
            surface = self._surfaces[index]
            inside = _holds(surface.corners, points[:, :2]) & (points[:, 2] >= surface.height)
            seen[inside] = surface.brightness
        if sample is not None:
            seen = np.clip(self._noise.apply(seen, sample), 0.0, 1.0)
        return Float32MultiArray(self._layout, tuple(seen.tolist()))


def _surfaces(world: World) -> tuple[list[_Surface], float]:
    """The surfaces on the floor, the highest last, and the floor's brightness."""
    found, floor = [], 1.0
    for body in world.bodies:
        if not body.is_static:
            continue
        for part in body.parts:
            brightness = float(_LUMINANCE @ part.rgba[:3])
            if isinstance(part.shape, Plane):
                floor = brightness
                continue
            pose = body.pose @ part.pose
            corners = footprint(part.shape, pose, -FURTHEST, FURTHEST)
            if corners is not None and len(corners) > 2:
                found.append(_Surface(corners, top(part.shape, pose), brightness))
    return sorted(found, key=lambda surface: surface.height), floor


def _holds(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points (n, 2) are inside a convex, counter-clockwise outline."""
    along = np.roll(corners, -1, axis=0) - corners
    off = points[:, None] - corners[None]
    left = along[None, :, 0] * off[..., 1] - along[None, :, 1] * off[..., 0]
    inside: NDArray[np.bool_] = np.all(left >= 0.0, axis=1)
    return inside
