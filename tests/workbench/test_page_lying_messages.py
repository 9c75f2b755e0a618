"""Inconsistent messages: displays report what is wrong, and the page keeps working."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kbot.messages import Point, Quaternion, Vector3
from kbot.messages.navigation import MapMetaData, OccupancyGrid, Path, PoseStamped
from kbot.messages.sensing import Image, PointCloud2, PointField
from kbot.messages.visualization import ColorRGBA, Marker, MarkerArray

from .conftest import until
from .displayed import FROM_ABOVE, WORLD, is_like, pose, showing
from .test_page_points import cloud

OpenPage = Callable[..., Any]

WHOLE = cloud([(0.0, 0.0, 0.0)] * 4, [0xFF0000] * 4)
X, Y, Z, RGB = WHOLE.fields
FOUR_BILLION = 4_000_000_000

CLOUDS = {
    "fewer bytes than its rows need": (
        replace(WHOLE, width=FOUR_BILLION),
        replace(WHOLE, width=FOUR_BILLION, row_step=0),
        replace(WHOLE, height=FOUR_BILLION),
        replace(WHOLE, data=b""),
    ),
    "row_step is less than width * point_step": (
        replace(WHOLE, height=FOUR_BILLION, row_step=0),
        replace(WHOLE, height=2, width=4, row_step=40),
    ),
    "x does not fit into point_step": (
        replace(WHOLE, width=FOUR_BILLION, point_step=0, row_step=0),
        replace(WHOLE, fields=(PointField("x", 18), Y, Z)),
    ),
    "rgb does not fit into point_step": (replace(WHOLE, fields=(X, Y, Z, PointField("rgb", 18, 6))),),
    "z has the unknown datatype 0": (replace(WHOLE, fields=(X, Y, PointField("z", 12, 0))),),
}


def test_an_inconsistent_cloud_is_reported(open_page: OpenPage) -> None:
    with showing(open_page, {"/cloud": PointCloud2}) as show:
        show.add("PointCloud2", "/cloud")
        show.publish("PointCloud2", "/cloud", replace(WHOLE, width=0, data=b""))
        for words, clouds in CLOUDS.items():
            for entry in clouds:
                show.bus.publish("/cloud", WHOLE)
                until(lambda: "points" not in show.status("PointCloud2"))
                show.bus.publish("/cloud", entry)
                until(lambda words=words: words in show.status("PointCloud2"))


def test_an_invalid_value_does_not_change_the_colours_of_others(open_page: OpenPage) -> None:
    rows = np.zeros(3, np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")]))
    rows["x"], rows["intensity"] = (-0.4, 0.0, 0.4), (0.0, 1.0, np.nan)
    fields = tuple(PointField(name, 4 * i) for i, name in enumerate(("x", "y", "z", "intensity")))
    received = PointCloud2(WORLD, 1, 3, fields, False, 16, 48, rows.tobytes())
    with showing(open_page, {"/cloud": PointCloud2}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("PointCloud2", "/cloud")
        show.set("PointCloud2", "by", "intensity")
        show.set("PointCloud2", "size", "9")
        show.publish("PointCloud2", "/cloud", received)
        # the ends of viridis
        assert is_like(show.colours((-0.4, 0.0, 0.0)), (68, 1, 84))
        assert is_like(show.colours((0.0, 0.0, 0.0)), (253, 231, 37))


@pytest.mark.parametrize(
    ("picture", "words"),
    [
        (Image(WORLD, 2, 4, "rgb8", 0, 8, bytes(16)), "step is 8 bytes, but 4 pixels of rgb8 need 12"),
        (Image(WORLD, 1, FOUR_BILLION, "rgb8", 0, 0, b"1"), f"{FOUR_BILLION} pixels of rgb8 need"),
        (Image(WORLD, FOUR_BILLION, 1, "32FC1", 0, 0, b"1"), "step is 0 bytes"),
        (Image(WORLD, 1, 4, "yuyv", 0, 4, bytes(4)), "4 pixels of yuyv need 8"),
        (Image(WORLD, 2, 2, "bgr8", 0, 6, bytes(11)), "2 by 2 pixels, but 11 bytes"),
    ],
    ids=["short rows", "wide", "high", "yuyv", "short"],
)
def test_an_inconsistent_image_is_reported(open_page: OpenPage, picture: Image, words: str) -> None:
    with showing(open_page, {"/eye": Image}) as show:
        show.add("Image", "/eye")
        show.publish("Image", "/eye", Image(WORLD, 1, 1, "mono8", 0, 1, b"\xff"))
        show.bus.publish("/eye", picture)
        until(lambda: words in show.status("Image"))
        show.bus.publish("/eye", Image(WORLD, 1, 1, "mono8", 0, 1, b"\xff"))
        until(lambda: "bytes" not in show.status("Image"))


def marker(number: int, kind: int, x: float, **fields: Any) -> Marker:
    return Marker(
        WORLD,
        id=number,
        type=kind,
        pose=pose(x),
        **{"scale": Vector3(0.3, 0.3, 0.3), "color": ColorRGBA(1.0, 0.0, 1.0, 1.0), **fields},
    )


def test_invalid_numbers_are_reported_and_not_drawn_as_zero(open_page: OpenPage) -> None:
    nan = float("nan")
    with showing(open_page, {"/marks": MarkerArray, "/plan": Path}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("MarkerArray", "/marks")
        entry, other = marker(1, 1, nan), marker(2, 1, 0.6)
        show.publish("MarkerArray", "/marks", MarkerArray((entry, other)))
        assert "marker 1 contains numbers that are NaN" in show.status("MarkerArray")
        assert is_like(show.colours((0.6, 0.0, 0.0)), (255, 0, 255), 140)
        assert not is_like(show.colours((0.0, 0.0, 0.0)), (255, 0, 255), 140)
        show.add("Path", "/plan")
        at = replace(pose(), position=Point(nan, 0.0, 0.0), orientation=Quaternion(0.0, 0.0, 0.0, 1.0))
        show.publish("Path", "/plan", Path(WORLD, (PoseStamped(WORLD, at), PoseStamped(WORLD, pose()))))
        assert "numbers that are NaN" in show.status("Path")


def test_markers_of_one_point_or_none_are_invisible(open_page: OpenPage) -> None:
    points = ((), (Point(0.1, 0.0, 0.0),))
    odd = [marker(10 * kind + len(some), kind, 0.0, points=some) for kind in range(4, 13) for some in points]
    text = marker(500, 9, 0.0, text="wide " * 20000)
    with showing(open_page, {"/marks": MarkerArray}) as show:
        show.add("MarkerArray", "/marks")
        show.publish(
            "MarkerArray", "/marks", MarkerArray((*odd, text, marker(1, -1, 0.0), marker(2, 1, 0.4)))
        )
        assert "unknown type -1" in show.status("MarkerArray")


@pytest.mark.parametrize("metres", [0.0, -0.1, float("nan")])
def test_a_map_with_cells_of_zero_size_is_reported(open_page: OpenPage, metres: float) -> None:
    info = MapMetaData(resolution=metres, width=2, height=2, origin=pose())
    with showing(open_page, {"/chart": OccupancyGrid}) as show:
        show.add("Map", "/chart")
        show.publish("Map", "/chart", OccupancyGrid(WORLD, info, np.zeros(4, np.int8)))
        assert ("NaN" if np.isnan(metres) else f"resolution is {metres:g} m") in show.status("Map")
