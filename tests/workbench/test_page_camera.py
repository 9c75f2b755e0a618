"""The scene from a camera's viewpoint: placed by its intrinsics, with its image behind and above."""

import base64
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from kbot.messages import Point
from kbot.messages.sensing import CameraInfo, Image
from kbot.messages.visualization import PointStamped

from .conftest import until
from .displayed import WORLD, Show, showing
from .pictures import decode_png

OpenPage = Callable[..., Any]

WIDTH, HEIGHT = 200, 150
FX, FY, CX, CY = 180.0, 160.0, 90.0, 80.0
GREEN = (0, 200, 0)
SEEN = (0.3, -0.2, 2.0)
"""A point in the camera's frame: x right, y down, z ahead (REP 103). That frame is the world here."""


@pytest.fixture
def show(open_page: OpenPage) -> Iterator[Show]:
    """A camera with an all-green image, and a red ball that is not in the image."""
    topics = {"/eye/image_raw": Image, "/eye/camera_info": CameraInfo, "/ball": PointStamped}
    with showing(open_page, topics) as entry:
        entry.add("PointStamped", "/ball")
        entry.set("PointStamped", "radius", "0.1")
        entry.set("PointStamped", "colour", "#ff0000")
        entry.publish("PointStamped", "/ball", PointStamped(WORLD, Point(*SEEN)))
        entry.add("Camera", "/eye/image_raw")
        entry.set("Camera", "rendering", "background")
        yield entry


def take(show: Show, cx: float = CX, tx: float = 0.0) -> None:
    """Publish the image and its camera_info until the page shows the scene over it."""
    green = np.full((HEIGHT, WIDTH, 3), GREEN, np.uint8)

    def is_shown() -> bool:
        k = (FX, 0.0, cx, 0.0, FY, CY, 0.0, 0.0, 1.0)
        p = (FX, 0.0, cx, tx, 0.0, FY, CY, 0.0, 0.0, 0.0, 1.0, 0.0)
        show.bus.publish("/eye/camera_info", CameraInfo(WORLD, HEIGHT, WIDTH, k=k, p=p))
        show.bus.publish("/eye/image_raw", Image(WORLD, HEIGHT, WIDTH, "rgb8", 0, 3 * WIDTH, green.tobytes()))
        return show.status("Camera").startswith("fine: /eye")

    until(is_shown)


def pixels(show: Show) -> np.ndarray:
    """Return the pixels of the window, (height, width, 3)."""
    show.page.evaluate("kbot.drawn()")
    address = show.page.locator(".camera-view canvas").evaluate("canvas => canvas.toDataURL()")
    return decode_png(base64.b64decode(address.partition(",")[2])).astype(int)


def ball(show: Show) -> tuple[float, float]:
    """Return the centre of the red area in the window: column and row of pixel edges, as intrinsics count
    them.

    It is nan while there is little red.
    """
    image = pixels(show)
    rows, columns = np.nonzero((image[..., 0] > image[..., 1] + 30) & (image[..., 0] > image[..., 2] + 30))
    if image.shape[:2] != (HEIGHT, WIDTH) or len(rows) <= 50:
        return np.nan, np.nan
    return float(columns.mean()) + 0.5, float(rows.mean()) + 0.5


def test_the_intrinsics_place_the_scene_over_the_image(show: Show) -> None:
    take(show)
    x, y, z = SEEN
    expected = (FX * x / z + CX, FY * y / z + CY)
    until(lambda: np.allclose(ball(show), expected, atol=0.7))
    assert not np.allclose(ball(show), (FX * x / z + WIDTH / 2, FY * y / z + HEIGHT / 2), atol=2.0)
    take(show, cx=CX + 20.0)
    until(lambda: np.allclose(ball(show), (expected[0] + 20.0, expected[1]), atol=0.7))
    take(show, tx=-FX * 0.1)  # the right camera of a pair, 0.1 m beside the frame
    until(lambda: np.allclose(ball(show), (FX * (x - 0.1) / z + CX, expected[1]), atol=0.7))


def test_zoom_enlarges_the_scene_about_its_centre(show: Show) -> None:
    take(show)
    show.set("Camera", "zoom", "2")
    x, y, z = SEEN
    until(lambda: np.allclose(ball(show), (2 * FX * x / z + CX, 2 * FY * y / z + CY), atol=0.7))


def test_the_image_is_behind_the_scene_over_it_or_both(show: Show) -> None:
    take(show)
    x, y, z = SEEN
    row, column = round(FY * y / z + CY), round(FX * x / z + CX)

    def colours() -> tuple[np.ndarray, np.ndarray]:
        image = pixels(show)
        return image[row, column], image[10, 10]

    until(lambda: colours()[0][1] < 40 and np.abs(colours()[1] - GREEN).max() < 6)
    alone = colours()[0]
    show.set("Camera", "rendering", "background and overlay")
    show.set("Camera", "alpha", "0.25")
    mixed = 0.75 * alone + 0.25 * np.array(GREEN)
    until(lambda: np.abs(colours()[0] - mixed).max() < 6 and np.abs(colours()[1] - GREEN).max() < 6)
    show.set("Camera", "rendering", "overlay")
    until(lambda: np.abs(colours()[0] - mixed).max() < 6)
    beside = colours()[1]
    assert beside[1] < 100  # a quarter of green over the background
    show.set("Camera", "alpha", "1")
    until(lambda: np.abs(colours()[0] - GREEN).max() < 3)


def test_a_camera_shows_the_selected_displays(show: Show) -> None:
    take(show)
    until(lambda: np.isfinite(ball(show)).all())
    show.row("Camera").get_by_text("Visibility").click()
    seen = show.row("Camera").get_by_label("PointStamped of Camera")
    seen.uncheck()
    until(lambda: np.isnan(ball(show)).all())
    # the main picture still shows it
    show.look((0.0, -1.0, 3.0), SEEN)
    until(lambda: show.mask((255, 0, 0), 90).any())
    head = show.row("PointStamped").locator(".head")
    head.press("F2")
    show.page.get_by_label("Name of PointStamped").fill("Ball")
    show.page.keyboard.press("Enter")
    row = show.row("Camera").get_by_label("Ball of Camera")
    until(lambda: row.count() == 1 and not row.is_checked())
    row.check()
    until(lambda: np.isfinite(ball(show)).all())


def test_a_camera_without_intrinsics_is_reported(show: Show) -> None:
    picture = Image(WORLD, 2, 2, "rgb8", 0, 6, bytes(12))

    def reason(publish_info: bool) -> str:
        if publish_info:
            show.bus.publish("/eye/camera_info", CameraInfo(WORLD, 2, 2))
        show.bus.publish("/eye/image_raw", picture)
        return show.status("Camera")

    until(lambda: "no CameraInfo received on /eye/camera_info" in reason(False))
    assert not show.page.locator(".camera-view").is_visible()
    until(lambda: "the CameraInfo on /eye/camera_info has no valid projection" in reason(True))
    assert not show.page.locator(".camera-view").is_visible()
