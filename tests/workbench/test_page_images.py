"""Camera images in every encoding that rviz shows, and compressed."""

from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image as Picture

from kbot.messages.sensing import Image
from kbot.messages.visualization import CompressedImage

from .conftest import until
from .displayed import WORLD, showing

OpenPage = Callable[..., Any]

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)
READ = "c => [...c.getContext('2d').getImageData(0, 0, c.width, c.height).data]"


def test_a_camera_image_is_shown_pixel_by_pixel(open_page: OpenPage) -> None:
    pixels = np.array([[RED, GREEN], [BLUE, (255, 255, 255)]], np.uint8)
    padded = np.zeros((2, 8), np.uint8)  # rows may be padded
    padded[:, :6] = pixels[..., ::-1].reshape(2, 6)
    with showing(open_page, {"/eye": Image}) as show:
        show.add("Image", "/eye")
        show.publish("Image", "/eye", Image(WORLD, 2, 2, "bgr8", 0, 8, padded.tobytes()))
        canvas = show.page.locator(".camera-view canvas")
        until(canvas.is_visible)
        until(lambda: np.array(canvas.evaluate(READ)).reshape(2, 2, 4)[..., :3].tolist() == pixels.tolist())
        depth = np.array([[1.0, 2.0], [3.0, np.nan]], np.float32)
        show.bus.publish("/eye", Image(WORLD, 2, 2, "32FC1", 0, 8, depth.tobytes()))
        until(lambda: canvas.evaluate(READ)[12:15] == [0, 0, 0])  # unknown values are black
        near, middle, far = np.array(canvas.evaluate(READ)).reshape(4, 4)[:3, :3].sum(axis=1)
        assert near > middle > far
        show.bus.publish("/eye", Image(WORLD, 2, 2, "yuv444", 0, 8, bytes(16)))
        until(lambda: "yuv444 is not supported" in show.status("Image"))


# two pixels with their own brightness that share blue and red: by ITU-R BT.601 red and a darker red
YUV = {"yuv422": (84, 76, 255, 40), "uyvy": (84, 76, 255, 40), "yuv422_yuy2": (76, 84, 40, 255)}


@pytest.mark.parametrize("encoding", YUV)
def test_webcam_images_are_shown(open_page: OpenPage, encoding: str) -> None:
    with showing(open_page, {"/eye": Image}) as show:
        show.add("Image", "/eye")
        show.publish("Image", "/eye", Image(WORLD, 1, 2, encoding, 0, 4, bytes(YUV[encoding])))
        canvas = show.page.locator(".camera-view canvas")
        until(canvas.is_visible)
        seen = np.array(canvas.evaluate(READ)).reshape(2, 4)[:, :3]
        assert np.abs(seen - [(254, 0, 0), (218, 0, 0)]).max() <= 2


@pytest.mark.parametrize("kind", ["png", "jpeg"])
def test_compressed_images_are_shown(open_page: OpenPage, kind: str) -> None:
    packed = BytesIO()
    Picture.new("RGB", (16, 8), (255, 0, 0)).save(packed, kind)
    with showing(open_page, {"/eye/compressed": CompressedImage}) as show:
        show.add("Image", "/eye/compressed")
        show.publish("Image", "/eye/compressed", CompressedImage(WORLD, f"rgb8; {kind}", packed.getvalue()))
        canvas = show.page.locator(".camera-view canvas")
        until(canvas.is_visible)
        assert (canvas.evaluate("c => c.width"), canvas.evaluate("c => c.height")) == (16, 8)
        assert np.abs(np.array(canvas.evaluate(READ)).reshape(-1, 4)[:, :3] - RED).max() <= 3
        show.bus.publish("/eye/compressed", CompressedImage(WORLD, kind, b"none"))
        until(lambda: "cannot decode the image" in show.status("Image"))
