"""Points of clouds and scans: their shapes, sizes and colours."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.messages import Header, Time
from kbot.messages.sensing import LaserScan, PointCloud2, PointField

from .conftest import until
from .displayed import FROM_ABOVE, WORLD, Show, is_like, showing

OpenPage = Callable[..., Any]

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)


def cloud(points: list[tuple[float, float, float]], rgb: list[int]) -> PointCloud2:
    rows = np.zeros(
        len(points), np.dtype([("x", "<f4"), ("y", "<f4"), ("pad", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    )
    rows["x"], rows["y"], rows["z"] = np.array(points).T
    rows["rgb"] = rgb
    fields = (
        PointField("x", 0),
        PointField("y", 4),
        PointField("z", 12),
        PointField("rgb", 16, 6),
    )
    return PointCloud2(WORLD, 1, len(points), fields, False, 20, 20 * len(points), rows.tobytes())


def test_points_of_a_cloud_have_their_places_and_colours(open_page: OpenPage) -> None:
    places = [(0.5, 0.5, 0.0), (-0.5, 0.5, 0.3), (0.0, -0.5, 0.6)]
    with showing(open_page, {"/cloud": PointCloud2}) as show:
        show.look((0.0, -2.5, 2.0), (0.0, 0.0, 0.2))
        show.add("PointCloud2", "/cloud")
        show.set("PointCloud2", "by", "rgb")
        show.set("PointCloud2", "size", "9")
        show.publish("PointCloud2", "/cloud", cloud(places, [0xFF0000, 0x00FF00, 0x0000FF]))
        for place, rgb in zip(places, (RED, GREEN, BLUE), strict=True):
            assert is_like(show.colours(place), rgb), place


def extent_at(show: Show, place: tuple[float, float, float], metres: float) -> np.ndarray:
    """Return rows and columns, lowest and highest, (2, 2), of a square of this size in m around a place."""
    x, y, z = place
    half = metres / 2
    corners = show.pixels([(x + i * half, y + j * half, z) for i in (-1, 1) for j in (-1, 1)])
    return np.array([corners.min(axis=0), corners.max(axis=0)])


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("style", ["squares", "spheres", "boxes"])
def test_points_can_have_a_size_in_metres(open_page: OpenPage, style: str, flat: bool) -> None:
    place = (0.4, 0.2, 0.0)
    with showing(open_page, {"/cloud": PointCloud2}) as show:
        show.page.evaluate(FROM_ABOVE)
        if flat:
            show.page.keyboard.press("o")
        show.add("PointCloud2", "/cloud")
        show.set("PointCloud2", "by", "colour")
        show.set("PointCloud2", "colour", "#ff00ff")
        show.set("PointCloud2", "style", style)
        show.set("PointCloud2", "metres", "0.3")
        show.publish("PointCloud2", "/cloud", cloud([place], [0]))
        image = show.mask((255, 0, 255), 140)[:300]  # without the bar at the bottom
        # the top of a box is closer to the eye, which is 3 m above
        seen = 0.3 * (3.0 / 2.85 if style == "boxes" and not flat else 1.0)
        assert np.abs(show.extent(image) - extent_at(show, place, seen)).max() <= 4
        # a ball covers pi / 4 of the area of a square
        share = image.sum() / np.prod(np.ptp(show.extent(image), axis=0) + 1)
        assert share == pytest.approx(np.pi / 4 if style == "spheres" else 1.0, abs=0.06)


def test_colours_span_the_configured_range(open_page: OpenPage) -> None:
    rows = np.zeros(3, np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("ring", "<u2")]))
    rows["x"], rows["ring"] = (-0.4, 0.0, 0.4), (0, 5, 10)
    fields = tuple(PointField(name, 4 * i) for i, name in enumerate("xyz"))
    message = PointCloud2(WORLD, 1, 3, (*fields, PointField("ring", 12, 4)), False, 14, 42, rows.tobytes())
    # viridis at 0, 1/4, 1/2 and 1
    start, quarter, half, end = (68, 1, 84), (59, 82, 139), (33, 145, 140), (253, 231, 37)
    places = [(x, 0.0, 0.0) for x in (-0.4, 0.0, 0.4)]
    with showing(open_page, {"/cloud": PointCloud2}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("PointCloud2", "/cloud")
        show.set("PointCloud2", "size", "12")
        show.set("PointCloud2", "by", "intensity")
        show.publish("PointCloud2", "/cloud", message)
        assert "the points have no intensity" in show.status("PointCloud2")
        show.set("PointCloud2", "channel", "ring")
        show.bus.publish("/cloud", message)
        until(lambda: "warning" not in show.status("PointCloud2"))
        for place, rgb in zip(places, (start, half, end), strict=True):
            assert is_like(show.colours(place), rgb, 12)
        show.field("PointCloud2", "auto").uncheck()
        show.set("PointCloud2", "high", "20")
        for place, rgb in zip(places, (start, quarter, half), strict=True):
            assert is_like(show.colours(place), rgb, 12)


def test_older_points_are_recoloured(open_page: OpenPage) -> None:
    def beam(second: int, metres: float) -> LaserScan:
        return LaserScan(Header(Time(second), "world"), range_max=8.0, ranges=np.array([metres], np.float32))

    with showing(open_page, {"/laser": LaserScan}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("LaserScan", "/laser")
        show.set("LaserScan", "size", "12")
        show.set("LaserScan", "decay", "100")
        show.set("LaserScan", "colour", "#ff0000")
        show.publish("LaserScan", "/laser", beam(1, 0.4))
        show.bus.publish("/laser", beam(2, 0.8))
        until(lambda: is_like(show.colours((0.4, 0.0, 0.0), (0.8, 0.0, 0.0)), RED))
        show.set("LaserScan", "colour", "#00ff00")
        until(lambda: is_like(show.colours((0.4, 0.0, 0.0), (0.8, 0.0, 0.0)), GREEN))
