"""Maps by their pixels: cells, partial updates, and what is in front of them."""

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.messages import Point
from kbot.messages.navigation import MapMetaData, OccupancyGrid, OccupancyGridUpdate
from kbot.messages.visualization import PointStamped

from .conftest import until
from .displayed import FROM_ABOVE, WORLD, is_like, is_red, pose, showing

OpenPage = Callable[..., Any]


def test_a_map_is_drawn_cell_by_cell(open_page: OpenPage) -> None:
    # two rows of three cells of 0.2 m, the first row along x from (-0.3, -0.2), turned by 90 degrees
    cells = np.array([[0, 100, 0], [-1, 0, 100]], np.int8)
    grid = OccupancyGrid(
        WORLD,
        MapMetaData(resolution=0.2, width=3, height=2, origin=pose(0.2, -0.3, 0.0, np.pi / 2)),
        cells.ravel(),
    )
    topics = {"/cells": OccupancyGrid, "/cells_updates": OccupancyGridUpdate}
    with showing(open_page, topics) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Map", "/cells")
        show.set("Map", "alpha", "1")
        show.publish("Map", "/cells", grid)
        expected = {0: (255, 255, 255), 100: (0, 0, 0), -1: (112, 137, 134)}
        for row in range(2):
            for column in range(3):
                # the grid's x axis points up in the picture, its y axis to the left
                place = (0.2 - 0.2 * (row + 0.5), -0.3 + 0.2 * (column + 0.5), 0.0)
                assert is_like(show.colours(place), expected[int(cells[row, column])], 12), (row, column)
        part = OccupancyGridUpdate(WORLD, 1, 1, 2, 1, np.array([100, 0], np.int8))
        show.bus.publish("/cells_updates", part)
        until(lambda: is_like(show.colours((-0.1, 0.0, 0.0)), expected[100], 12))
        assert is_like(show.colours((-0.1, 0.2, 0.0), (0.1, -0.2, 0.0)), expected[0], 12)
        show.bus.publish(
            "/cells", OccupancyGrid(WORLD, MapMetaData(resolution=0.2, width=3, height=3), cells.ravel())
        )
        until(lambda: "3 by 3 cells, but 6 values" in show.status("Map"))


def test_a_map_can_be_drawn_behind_everything_else(open_page: OpenPage) -> None:
    cells = np.full(100, 100, np.int8)
    info = MapMetaData(resolution=0.1, width=10, height=10, origin=pose(-0.5, -0.5, 0.2))
    grid = OccupancyGrid(WORLD, info, cells)
    red = PointStamped(WORLD, Point())
    with showing(open_page, {"/cells": OccupancyGrid, "/clicked": PointStamped}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("PointStamped", "/clicked")
        show.set("PointStamped", "colour", "#ff0000")
        show.set("PointStamped", "radius", "0.1")
        show.publish("PointStamped", "/clicked", red)
        show.add("Map", "/cells")
        show.set("Map", "alpha", "1")
        show.publish("Map", "/cells", grid)
        assert is_like(show.colours((0.0, 0.0, 0.0), (0.3, 0.0, 0.2)), (0, 0, 0), 12)
        show.field("Map", "behind").check()
        until(lambda: is_red(show.colours((0.0, 0.0, 0.0))).all())
        assert is_like(show.colours((0.3, 0.0, 0.2)), (0, 0, 0), 12)
