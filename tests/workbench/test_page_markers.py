"""Markers by their pixels: every shape, colours, text, namespaces."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from kbot.messages import Point, Vector3
from kbot.messages.visualization import DELETE, DELETE_ALL, ColorRGBA, Marker, MarkerArray

from .conftest import until
from .displayed import FROM_ABOVE, WORLD, Show, is_red, pose, showing

OpenPage = Callable[..., Any]

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)


def marker(kind: int, **fields: Any) -> Marker:
    fields.setdefault("scale", Vector3(0.3, 0.3, 0.3))
    fields.setdefault("color", ColorRGBA(1.0, 0.0, 0.0, 1.0))
    return Marker(WORLD, "test", fields.pop("id", 0), kind, **fields)


SQUARE = tuple(Point(x, y) for x, y in ((-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)))
PAINTED = tuple(ColorRGBA(*rgb, 1.0) for rgb in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)))
# by type: a marker, places on it and places next to it
MARKERS = {
    0: (marker(0, scale=Vector3(0.6, 0.1, 0.1)), [(0.1, 0), (0.4, 0)], [(-0.1, 0), (0.7, 0)]),
    1: (marker(1, pose=pose(yaw=np.pi / 4)), [(0, 0), (0.19, 0)], [(0.14, 0.14), (0.24, 0)]),
    2: (marker(2, scale=Vector3(0.6, 0.2, 0.2)), [(0.27, 0), (0, 0.08)], [(0.25, 0.08), (0.34, 0)]),
    3: (marker(3), [(0.14, 0), (0, -0.14)], [(0.13, 0.13)]),
    4: (marker(4, points=SQUARE, scale=Vector3(0.06)), [(0, -0.4), (0.4, 0), (0, 0.4)], [(-0.4, 0), (0, 0)]),
    5: (marker(5, points=SQUARE, scale=Vector3(0.06)), [(0, -0.4), (0, 0.4)], [(0.4, 0), (0, 0)]),
    6: (marker(6, points=SQUARE), [(0.3, 0.3), (-0.5, 0.5)], [(0, 0), (0.2, 0.4)]),
    7: (marker(7, points=SQUARE), [(0.4, 0.4), (-0.4, 0.28)], [(0.52, 0.52), (0, 0)]),
    8: (
        marker(8, points=SQUARE, scale=Vector3(0.1, 0.1)),
        [(0.4, 0.4), (-0.4, -0.37)],
        [(0.4, 0.32), (0, 0)],
    ),
    11: (
        marker(11, points=SQUARE[:3], scale=Vector3(1, 1, 1)),
        [(0.3, 0), (0.2, -0.2)],
        [(-0.2, 0.2), (0, 0.3)],
    ),
    12: (
        marker(12, points=SQUARE[:3], scale=Vector3(0.06, 0.12, 0.2)),
        [(-0.2, -0.4), (0.15, -0.4), (0.4, 0.0), (0.4, 0.3)],
        [(0, 0), (-0.4, 0.4), (0, 0.4)],
    ),
}


def red_at(show: Show, places: list[tuple[float, float]]) -> np.ndarray:
    return is_red(show.colours(*[(x, y, 0.0) for x, y in places]))


def test_markers_of_every_shape_are_drawn(open_page: OpenPage) -> None:
    with showing(open_page, {"/marks": MarkerArray}) as show:
        show.page.evaluate("kbot.look([0, -0.001, 9], [0, 0, 0])")
        show.add("MarkerArray", "/marks")
        for entry, on, beside in MARKERS.values():
            clear = Marker(action=DELETE_ALL)
            show.publish("MarkerArray", "/marks", MarkerArray((clear, entry)))
            # the previous marker may still be there
            until(lambda on=on, beside=beside: red_at(show, on).all() and not red_at(show, beside).any())


def test_markers_have_point_colours_text_lifetimes_and_namespaces(open_page: OpenPage) -> None:
    with showing(open_page, {"/mark": Marker}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Marker", "/mark")
        show.publish("Marker", "/mark", marker(7, id=1, points=SQUARE, colors=PAINTED))
        for point, rgb in zip(SQUARE, (RED, GREEN, BLUE, (255, 255, 0)), strict=True):
            colour = show.colours((point.x, point.y, 0.0))[0]
            assert [part > 90 for part in colour] == [part > 0 for part in rgb], rgb
        show.bus.publish("/mark", marker(0, id=1, action=DELETE))
        until(lambda: not show.mask(RED, 90).any())
        show.publish("Marker", "/mark", marker(9, id=2, text="KBot", scale=Vector3(0.0, 0.0, 0.2)))
        until(
            lambda: is_red(show.colours((0.0, 0.0, 0.0)).reshape(-1, 3)).any() or show.mask(RED).sum() > 100
        )
        rows = show.extent(show.mask(RED, 90))[:, 0]
        tall = np.diff(show.pixels([(0.0, 0.2, 0.0), (0.0, 0.0, 0.0)])[:, 0])[0]
        assert abs(np.diff(rows)[0] - tall) < 0.2 * tall  # an upper-case letter is as tall as the scale's z
        row = show.row("Marker")
        row.get_by_text("Namespaces").click()
        row.get_by_label("test of Marker").uncheck()
        until(lambda: not show.mask(RED, 90).any())
        show.bus.publish("/mark", replace(marker(1, id=4), ns="other"))
        until(lambda: row.get_by_label("other of Marker").count())
        until(lambda: is_red(show.colours((0.1, 0.1, 0.0))).all())
        show.bus.publish("/mark", replace(marker(0, id=4, action=DELETE), ns="other"))
        show.bus.publish("/mark", marker(3, id=3, color=ColorRGBA(1.0, 0.0, 0.0, 0.0)))
        until(lambda: "color.a is 0" in show.status("Marker"))
