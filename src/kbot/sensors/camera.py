"""Cameras: colour and depth images of an ideal pinhole camera."""

from __future__ import annotations

import math
from contextlib import ExitStack
from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.messages.sensing import CameraInfo, Image
from kbot.render.camera_scene import PictureModel
from kbot.render.offscreen import Canvas
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError


@dataclass(frozen=True, kw_only=True, repr=False)
class Camera(Spec):
    """A camera that looks along x of `pose`, with z up.

    `fov` is the horizontal field of view in rad. `near` and `far` (m) are the clipping planes. `noise` is
    added to colours from 0 to 1. Pictures are published on `topic`, intrinsics on `info_topic` (by default
    `camera_info` beside `topic`). With `depth`, depth images are published on `depth_topic` (by default in
    `depth/` beside `topic`). `frame` should name an optical frame (REP 103).
    """

    kind: ClassVar[str] = "camera"
    width: int = 640
    height: int = 480
    fov: float = math.radians(60)
    near: float = 0.02
    far: float = 50.0
    depth: bool = False
    noise: Noise = NONE
    info_topic: str = ""
    depth_topic: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (1 <= self.width <= 8192 and 1 <= self.height <= 8192):
            raise KbotError(
                f"{self.label}: width and height must be 1 to 8192 pixels, not {self.width} and {self.height}"
            )
        if not 0.0 < self.fov < math.pi:
            raise KbotError(f"{self.label}: fov must be above 0 and below pi rad, not {self.fov}")
        if not 0.0 < self.near < self.far < math.inf:
            raise KbotError(
                f"{self.label}: the near plane must be above 0 m and nearer than the far plane,"
                f" not {self.near} to {self.far} m"
            )

    @property
    def focal_length(self) -> float:
        """The focal length in pixels, the same in both directions."""
        return self.width / 2.0 / math.tan(self.fov / 2.0)

    @property
    def topics(self) -> tuple[str, ...]:
        return (self.topic or f"{self.label}/image_raw", *filter(None, (self.info_topic, self.depth_topic)))

    def mount(self, simulation: Simulation) -> CameraSensor:
        return CameraSensor(simulation, self)


class CameraSensor(Sensor[Image]):
    """Publishes an Image (rgb8), its CameraInfo, and with `depth` an Image of depths in m (32FC1)."""

    message_type = Image
    spec: Camera

    def __init__(self, simulation: Simulation, spec: Camera) -> None:
        """Raises KbotError: no offscreen OpenGL (the message says what to install), or as `Sensor`."""
        super().__init__(simulation, spec)
        beside, _, leaf = self.topic.rpartition("/")
        beside = f"{beside}/" if beside else ""
        infos = self._beside(spec.info_topic, f"{beside}camera_info")
        depths = self._beside(spec.depth_topic, f"{beside}depth/{leaf}")
        with ExitStack() as undo:
            undo.callback(super().close)
            self._infos = self._advertise(infos, CameraInfo)
            undo.callback(self._infos.close)
            self._depths = self._advertise(depths, Image) if spec.depth else None
            undo.pop_all()
        self._noise = self._noise_of(spec.noise, "colour", spec.width * spec.height * 3)
        self._latest_depth: Image | None = None

    def _bind(self, model: mujoco.MjModel) -> None:
        super()._bind(model)
        spec = self.spec
        fovy = 2.0 * math.atan(spec.height / 2.0 / spec.focal_length)
        size = spec.width, spec.height
        self._scene = PictureModel(self.simulation, fovy, size, spec.near, spec.far)
        self._canvas = Canvas(self._scene.model, *size)

    def _beside(self, own: str, default: str) -> str:
        return self.simulation.robots.named(self.owner).naming.topic(own) if own else default

    def close(self) -> None:
        super().close()
        for beside in (self._infos, self._depths):
            if beside is not None:
                beside.close()

    @property
    def has_subscribers(self) -> bool:
        beside = self._infos.has_subscribers or (self._depths is not None and self._depths.has_subscribers)
        return beside or super().has_subscribers

    @property
    def latest_depth(self) -> Image:
        """The newest image of depths in m (32FC1).

        Raises:
            KbotError: the camera measures no depths, or there is no reading yet.
        """
        if self._depths is None:
            raise KbotError(f"{self.spec.label} has no depth image: declare it with Camera(depth=True)")
        if not self.has_reading or self._latest_depth is None:
            raise KbotError(self._why_no_reading())
        return self._latest_depth

    def draw(self) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
        """The current colours (height, width, 3) and depths (height, width) in m.

        A depth is +inf if there is nothing nearer than `far`.
        """
        _, _, place, axes = self._place()
        self._scene.place(place, axes)
        return self._canvas.draw(self._scene.data)

    def measure(self, sample: int | None = None) -> Image:
        colours, depths = self.draw()
        if sample is not None:
            if not self.spec.noise.is_none:
                noisy = self._noise.apply(colours.reshape(-1) / 255.0, sample) * 255.0
                colours = np.clip(np.rint(noisy), 0, 255).astype(np.uint8).reshape(colours.shape)
            self._publish_info_and_depth(depths)
        return self._image("rgb8", 3, colours.tobytes())

    def info(self) -> CameraInfo:
        """The intrinsics of an ideal pinhole camera."""
        spec, f = self.spec, self.spec.focal_length
        x, y = spec.width / 2.0, spec.height / 2.0
        return CameraInfo(
            self._header(),
            spec.height,
            spec.width,
            k=(f, 0.0, x, 0.0, f, y, 0.0, 0.0, 1.0),
            p=(f, 0.0, x, 0.0, 0.0, f, y, 0.0, 0.0, 0.0, 1.0, 0.0),
        )

    def _publish_info_and_depth(self, depths: NDArray[np.float64]) -> None:
        if self._infos.has_subscribers:
            self._infos.publish_plain(self.info())
        if self._depths is not None:
            self._latest_depth = self._image("32FC1", 4, depths.astype("<f4").tobytes())
            if self._depths.has_subscribers:
                self._depths.publish_plain(self._latest_depth)

    def _image(self, encoding: str, size: int, data: bytes) -> Image:
        spec = self.spec
        return Image(self._header(), spec.height, spec.width, encoding, 0, size * spec.width, data)
