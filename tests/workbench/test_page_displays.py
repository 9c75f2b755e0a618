"""Each display by its pixels: what a message says is drawn where it says."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.messages import (
    Header,
    Odometry,
    Point,
    PoseWithCovariance,
    Quaternion,
    TransformStamped,
    Twist,
    TwistStamped,
    Vector3,
)
from kbot.messages.navigation import (
    MapMetaData,
    OccupancyGrid,
    Path,
    PoseStamped,
    PoseWithCovarianceStamped,
)
from kbot.messages.sensing import Image, LaserScan, PointCloud2, PointField, Range
from kbot.messages.visualization import (
    DELETE,
    DELETE_ALL,
    ColorRGBA,
    Marker,
    MarkerArray,
    PointStamped,
    PoseArray,
)

from .conftest import until
from .displayed import FROM_ABOVE, WORLD, Show, is_like, pose, showing
from .pictures import screenshot

OpenPage = Callable[..., Any]

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)


def covariance(x: float, y: float, yaw: float) -> tuple[float, ...]:
    """6x6 of variances in the plane."""
    return tuple(np.diag([x, y, 0.0, 0.0, 0.0, yaw]).ravel().tolist())


def test_a_wall_a_lidar_sees_is_drawn_where_it_stands(open_page: OpenPage) -> None:
    # a straight wall at x = 1 m: a beam at an angle goes 1 / cos(angle) far
    angles = np.linspace(-0.6, 0.6, 121)
    scan = LaserScan(
        WORLD,
        -0.6,
        0.6,
        0.01,
        range_min=0.05,
        range_max=8.0,
        ranges=(1.0 / np.cos(angles)).astype(np.float32),
    )
    with showing(open_page, {"/laser": LaserScan}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("LaserScan", "/laser")
        show.set("LaserScan", "colour", "#00ff00")
        show.hear("LaserScan", "/laser", scan)
        seen = np.argwhere(show.mask(GREEN))
        low, high = show.pixels([(1.0, 1.0 * np.tan(0.6), 0.0), (1.0, -1.0 * np.tan(0.6), 0.0)])
        assert len(seen) > 500
        assert abs(seen[:, 1] - low[1]).max() <= 4  # one column: the points are 4 px wide
        assert abs(seen[:, 0].min() - low[0]) <= 4
        assert abs(seen[:, 0].max() - high[0]) <= 4


def test_a_scan_is_drawn_in_its_own_frame(open_page: OpenPage) -> None:
    ranges = np.array([1.0], np.float32)
    scan = LaserScan(Header(frame_id="lidar_link"), range_max=8.0, ranges=ranges)
    with showing(open_page, {"/laser": LaserScan}, arguments={"lidar": "true"}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("LaserScan", "/laser")
        show.set("LaserScan", "colour", "#00ff00")
        show.hear("LaserScan", "/laser", scan)
        # its beams are 2 cm above the tops of the wheels, which are at 0.07 m
        middle = np.argwhere(show.mask(GREEN)).mean(axis=0)
        assert np.abs(middle - show.pixels([(1.0, 0.0, 0.09)])[0]).max() <= 3
        show.bus.publish("/laser", LaserScan(Header(frame_id="nowhere"), range_max=8.0, ranges=ranges))
        until(lambda: "there is no frame nowhere" in show.status("LaserScan"))
        assert not show.mask(GREEN).any()


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
        show.hear("PointCloud2", "/cloud", cloud(places, [0xFF0000, 0x00FF00, 0x0000FF]))
        for place, rgb in zip(places, (RED, GREEN, BLUE), strict=True):
            assert is_like(show.colours(place), rgb), place


def test_a_path_is_a_line_through_its_poses(open_page: OpenPage) -> None:
    corners = [(-0.5, 0.0), (0.5, 0.0), (0.5, 0.6)]
    path = Path(WORLD, tuple(PoseStamped(WORLD, pose(*corner)) for corner in corners))
    with showing(open_page, {"/way": Path}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Path", "/way")
        show.set("Path", "width", "7")
        show.hear("Path", "/way", path)
        on = [(-0.4, 0.0, 0.0), (0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.5, 0.3, 0.0)]
        off = [(0.0, 0.1, 0.0), (0.3, 0.3, 0.0), (-0.6, 0.0, 0.0)]
        line = (25, 255, 0)
        assert is_like(show.colours(*on), line)
        assert not any(is_like(show.colours(place), line) for place in off)
        show.hear("Path", "/way", Path(WORLD))
        until(lambda: not show.mask(line).any())


def arrows_from(show: Show, colour: str, at: tuple[float, float], length: float, yaw: float) -> None:
    """Check by pixels that an arrow goes from a place so far in a direction, and no farther."""
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    along = np.array([0.3, 0.6, 0.9, 1.08, -0.1]) * length
    image = show.colours(*[(at[0] + np.cos(yaw) * d, at[1] + np.sin(yaw) * d, 0.0) for d in along])
    hue = (image * rgb).sum(axis=1) / np.linalg.norm(image, axis=1) / np.linalg.norm(rgb)
    lit = image.max(axis=1) > 90
    assert (hue[:3] > 0.93).all(), hue
    assert lit[:3].all()
    assert not (lit[3:] & (hue[3:] > 0.93)).any(), (hue, image)


@pytest.mark.parametrize("kind", ["Pose", "PoseWithCovariance", "PoseArray"])
def test_a_pose_is_an_arrow(open_page: OpenPage, kind: str) -> None:
    where = pose(0.2, -0.3, 0.0, 0.8)
    messages = {
        "Pose": PoseStamped(WORLD, where),
        "PoseWithCovariance": PoseWithCovarianceStamped(WORLD, PoseWithCovariance(where)),
        "PoseArray": PoseArray(WORLD, (where, pose(-0.6, 0.4))),
    }
    message = messages[kind]
    with showing(open_page, {"/it": type(message)}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add(kind, "/it")
        show.set(kind, "colour", "#ff2000")
        show.set(kind, "length", "0.5")
        show.hear(kind, "/it", message)
        arrows_from(show, "#ff2000", (0.2, -0.3), 0.5, 0.8)
        if kind == "PoseArray":
            arrows_from(show, "#ff2000", (-0.6, 0.4), 0.5, 0.0)


def test_odometry_keeps_where_it_was_and_shows_how_sure_it_is(open_page: OpenPage) -> None:
    def odometry(x: float) -> Odometry:
        # one standard deviation: 0.2 m along x and 0.1 m along y
        return Odometry(WORLD, "base_link", PoseWithCovariance(pose(x), covariance(0.04, 0.01, 0.0)))

    with showing(open_page, {"/told": Odometry}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Odometry", "/told")
        show.set("Odometry", "colour", "#ff2000")
        show.set("Odometry", "length", "0.2")
        show.hear("Odometry", "/told", odometry(-0.8))
        show.hear("Odometry", "/told", odometry(-0.79))  # not far enough to be kept
        for x in (-0.4, 0.0):
            show.bus.publish("/told", odometry(x))
            ((row, column),) = show.pixels([(x + 0.06, 0.0, 0.0)])
            until(lambda row=row, column=column: show.mask((255, 32, 0), 110)[row, column])
        for x in (-0.8, -0.4, 0.0):
            arrows_from(show, "#ff2000", (x, 0.0), 0.2, 0.0)
        plain = screenshot(show.page)
        show.row("Odometry").get_by_label("Covariance of Odometry").check()
        show.set("Odometry", "covariance_alpha", "1")
        until(lambda: (screenshot(show.page) != plain).any())
        found = show.extent(show.mask((255, 32, 0), 12))
        top, bottom, left, right = show.pixels(
            [(0.0, 0.1, 0.0), (0.0, -0.1, 0.0), (-0.2, 0.0, 0.0), (0.2, 0.0, 0.0)]
        )
        assert np.abs(found[:, 0] - (top[0], bottom[0])).max() <= 4
        assert np.abs(found[:, 1] - (left[1], right[1])).max() <= 4


def test_a_twist_is_an_arrow_and_a_ring(open_page: OpenPage) -> None:
    message = TwistStamped(WORLD, Twist(Vector3(0.5), Vector3(0.0, 0.0, 2.0)))
    with showing(open_page, {"/speed": TwistStamped}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Twist", "/speed")
        show.set("Twist", "linear", "#ff2000")
        show.set("Twist", "angular", "#0040ff")
        show.set("Twist", "linear_scale", "1")
        show.set("Twist", "angular_scale", "0.15")
        show.hear("Twist", "/speed", message)
        # a turn about z of 2 rad/s is a ring of 0.3 m, open in its last quarter
        ring = show.colours((0.0, 0.3, 0.0), (-0.3, 0.0, 0.0))
        assert (ring[:, 2] > 120).all()
        assert (ring[:, 0] < 80).all()
        assert show.colours((0.24, -0.24, 0.0))[0, 2] < 90
        assert show.colours((0.45, 0.0, 0.0))[0, 0] > 120
        assert show.colours((0.55, 0.0, 0.0))[0, 0] < 90


def test_a_map_is_drawn_cell_by_cell(open_page: OpenPage) -> None:
    # two rows of three cells of 0.2 m, the first row along x from (-0.3, -0.2), turned by 90 degrees
    cells = np.array([[0, 100, 0], [-1, 0, 100]], np.int8)
    grid = OccupancyGrid(
        WORLD,
        MapMetaData(resolution=0.2, width=3, height=2, origin=pose(0.2, -0.3, 0.0, np.pi / 2)),
        cells.ravel(),
    )
    with showing(open_page, {"/cells": OccupancyGrid}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Map", "/cells")
        show.set("Map", "alpha", "1")
        show.hear("Map", "/cells", grid)
        expected = {0: (255, 255, 255), 100: (0, 0, 0), -1: (112, 137, 134)}
        for row in range(2):
            for column in range(3):
                # x of the grid is up in the world, its y to the left
                place = (0.2 - 0.2 * (row + 0.5), -0.3 + 0.2 * (column + 0.5), 0.0)
                assert is_like(show.colours(place), expected[int(cells[row, column])], 12), (row, column)
        show.bus.publish(
            "/cells", OccupancyGrid(WORLD, MapMetaData(resolution=0.2, width=3, height=3), cells.ravel())
        )
        until(lambda: "3 by 3 cells, but 6 values" in show.status("Map"))


def marker(kind: int, **fields: Any) -> Marker:
    fields.setdefault("scale", Vector3(0.3, 0.3, 0.3))
    fields.setdefault("color", ColorRGBA(1.0, 0.0, 0.0, 1.0))
    return Marker(WORLD, "test", fields.pop("id", 0), kind, **fields)


SQUARE = tuple(Point(x, y) for x, y in ((-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)))
PAINTED = tuple(ColorRGBA(*rgb, 1.0) for rgb in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)))
# by type: a marker, places on it and places beside it
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
}


def is_red(colours: np.ndarray) -> np.ndarray:
    result: np.ndarray = (colours[:, 0] > 70) & (colours[:, 0] > 1.6 * colours[:, 1:].max(axis=1))
    return result


def red_at(show: Show, places: list[tuple[float, float]]) -> np.ndarray:
    return is_red(show.colours(*[(x, y, 0.0) for x, y in places]))


def test_markers_of_every_shape(open_page: OpenPage) -> None:
    with showing(open_page, {"/marks": MarkerArray}) as show:
        show.page.evaluate("kbot.look([0, -0.001, 9], [0, 0, 0])")
        show.add("Marker", "/marks")
        for one, on, beside in MARKERS.values():
            clear = Marker(action=DELETE_ALL)
            show.hear("Marker", "/marks", MarkerArray((clear, one)))
            # the one before may still be there
            until(lambda on=on, beside=beside: red_at(show, on).all() and not red_at(show, beside).any())


def test_markers_have_colours_a_point_text_lives_and_namespaces(open_page: OpenPage) -> None:
    with showing(open_page, {"/mark": Marker}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Marker", "/mark")
        show.hear("Marker", "/mark", marker(7, id=1, points=SQUARE, colors=PAINTED))
        for point, rgb in zip(SQUARE, (RED, GREEN, BLUE, (255, 255, 0)), strict=True):
            colour = show.colours((point.x, point.y, 0.0))[0]
            assert [part > 90 for part in colour] == [part > 0 for part in rgb], rgb
        show.bus.publish("/mark", marker(0, id=1, action=DELETE))
        until(lambda: not show.mask(RED, 90).any())
        show.hear("Marker", "/mark", marker(9, id=2, text="KBot", scale=Vector3(0.0, 0.0, 0.2)))
        until(
            lambda: is_red(show.colours((0.0, 0.0, 0.0)).reshape(-1, 3)).any() or show.mask(RED).sum() > 100
        )
        rows = show.extent(show.mask(RED, 90))[:, 0]
        tall = np.diff(show.pixels([(0.0, 0.2, 0.0), (0.0, 0.0, 0.0)])[:, 0])[0]
        assert abs(np.diff(rows)[0] - tall) < 0.2 * tall  # an upper-case letter is as tall as the scale's z
        show.set("Marker", "namespaces", "other")
        until(lambda: not show.mask(RED, 90).any())
        show.bus.publish("/mark", marker(3, id=3, color=ColorRGBA(1.0, 0.0, 0.0, 0.0)))
        until(lambda: "its colour's a is 0" in show.status("Marker"))


def test_a_camera_picture_is_shown_pixel_by_pixel(open_page: OpenPage) -> None:
    pixels = np.array([[RED, GREEN], [BLUE, (255, 255, 255)]], np.uint8)
    padded = np.zeros((2, 8), np.uint8)  # rows may be longer than their pixels
    padded[:, :6] = pixels[..., ::-1].reshape(2, 6)
    with showing(open_page, {"/eye": Image}) as show:
        show.add("Image", "/eye")
        show.hear("Image", "/eye", Image(WORLD, 2, 2, "bgr8", 0, 8, padded.tobytes()))
        canvas = show.page.locator(".camera-view canvas")
        until(canvas.is_visible)
        read = "c => [...c.getContext('2d').getImageData(0, 0, 2, 2).data]"
        until(lambda: np.array(canvas.evaluate(read)).reshape(2, 2, 4)[..., :3].tolist() == pixels.tolist())
        depth = np.array([[1.0, 2.0], [3.0, np.nan]], np.float32)
        show.bus.publish("/eye", Image(WORLD, 2, 2, "32FC1", 0, 8, depth.tobytes()))
        until(lambda: canvas.evaluate(read)[12:15] == [0, 0, 0])  # what is not known is black
        near, middle, far = np.array(canvas.evaluate(read)).reshape(4, 4)[:3, :3].sum(axis=1)
        assert near > middle > far
        show.bus.publish("/eye", Image(WORLD, 2, 2, "yuv422", 0, 8, bytes(16)))
        until(lambda: "yuv422 are not shown" in show.status("Image"))


def test_a_range_is_a_cone_as_long_as_what_was_met(open_page: OpenPage) -> None:
    def sonar(distance: float) -> Range:
        return Range(WORLD, field_of_view=0.6, min_range=0.02, max_range=2.0, range=distance)

    with showing(open_page, {"/sonar": Range}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Range", "/sonar")
        show.set("Range", "colour", "#ff0000")
        show.set("Range", "alpha", "1")
        show.hear("Range", "/sonar", sonar(0.8))
        found = show.extent(show.mask(RED, 12))
        wide = 0.8 * np.tan(0.3)
        # the edge of a cone that lies flat is where it is widest, its rim half above the ground
        tip, end, edge = show.pixels([(0.0, 0.0, 0.0), (0.8, 0.0, 0.0), (0.8, wide, 0.0)])
        assert abs(found[0, 1] - tip[1]) <= 4
        assert end[1] <= found[1, 1] <= end[1] + 0.15 * (end[1] - tip[1])
        assert abs(found[0, 0] - edge[0]) <= 4
        show.bus.publish("/sonar", sonar(float("inf")))
        until(lambda: "nothing within 2 m" in show.status("Range"))
        assert not show.mask(RED, 12).any()


def test_a_point_is_a_ball(open_page: OpenPage) -> None:
    with showing(open_page, {"/clicked": PointStamped}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("PointStamped", "/clicked")
        show.set("PointStamped", "colour", "#ff0000")
        show.set("PointStamped", "radius", "0.1")
        show.hear("PointStamped", "/clicked", PointStamped(WORLD, Point(0.4, 0.3)))
        assert is_red(show.colours((0.4, 0.3, 0.0), (0.47, 0.3, 0.0))).all()
        assert not is_red(show.colours((0.53, 0.3, 0.0))).any()


def test_axes_stand_in_their_frame(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Axes")
        show.set("Axes", "length", "0.5")
        until(lambda: (show.colours((0.4, 0.0, 0.0)) @ (1.0, -1.5, 0.0) > 0).all())  # red along x
        until(lambda: (show.colours((0.0, 0.4, 0.0)) @ (-1.5, 1.0, 0.0) > 0).all())  # green along y
        show.set("Axes", "frame", "left_wheel")
        # the wheel stands at (0, 0.087); its x axis goes ahead too
        until(lambda: show.colours((0.4, 0.087, 0.035))[0, 0] > 120)
        assert show.colours((0.4, 0.0, 0.0))[0, 0] < 90


def test_a_grid_has_as_many_cells_as_it_is_given(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Grid")
        for name, value in (("cell", "0.25"), ("count", "4"), ("colour", "#ff0000")):
            show.set("Grid", name, value)
        until(lambda: show.mask(RED, 90).any())
        found = show.extent(show.mask(RED, 90))
        (top, left), (bottom, right) = show.pixels([(-0.5, 0.5, 0.0), (0.5, -0.5, 0.0)])
        assert np.abs(found - [[top, left], [bottom, right]]).max() <= 2
        row = is_red(screenshot(show.page)[show.pixels([(0.0, 0.12, 0.0)])[0, 0]].astype(int))
        assert np.count_nonzero(np.diff(np.flatnonzero(row)) > 2) == 4  # five lines


def test_the_force_of_the_ground_is_the_weight_of_the_robot(open_page: OpenPage) -> None:
    from kbot.sim import Simulation
    from kbot.workbench.contact_forces import ContactForces

    simulation = Simulation("kbot")
    contacts = ContactForces(simulation)
    simulation.run(1.0)
    mass = sum(link.inertial.mass for link in simulation.robot.links.values() if link.inertial)
    total = sum(force for _, force in contacts.forces())
    assert np.allclose(total, (0.0, 0.0, mass * 9.81), atol=1e-3)
    with showing(open_page, {}) as show:
        show.look((0.0, -0.8, 0.1), (0.0, 0.0, 0.05))
        show.add("Contacts")
        show.set("Contacts", "scale", "0.5")
        show.set("Contacts", "colour", "#ff0000")
        show.page.get_by_role("button", name="Go on").click()
        until(lambda: reds(show).sum() > 100)
        # the right wheel, nearest to the eye, bears 4.258 N of 11.28 N: 0.189 m of 0.5 m; a tip is thin
        (tip,) = show.pixels([(0.0, -0.087, 0.189)])
        until(lambda: abs(show.extent(reds(show))[0, 0] - tip[0]) <= 10)


def reds(show: Show) -> np.ndarray:
    """Where the picture is of any red, (height, width)."""
    image = screenshot(show.page).astype(int)
    return is_red(image.reshape(-1, 3)).reshape(image.shape[:2])


def test_inertia_is_a_box_or_an_ellipsoid_and_parts_can_be_faded(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        page = show.page
        show.look((0.0, -0.001, 0.8), (0.0, 0.0, 0.0))
        page.get_by_label("Show RobotModel", exact=True).check()
        show.row("RobotModel").locator(".head").click()
        blue = (show.mask((20, 20, 190), 60)).sum()
        assert blue > 1000
        show.set("RobotModel", "alpha", "0.3")
        until(lambda: show.mask((20, 20, 190), 60).sum() < 0.1 * blue)
        show.set("RobotModel", "alpha", "1")
        until(lambda: show.mask((20, 20, 190), 60).sum() == blue)
        show.row("RobotModel").get_by_text("Links", exact=True).click()
        page.get_by_label("Show of base_link").uncheck()
        until(lambda: show.mask((20, 20, 190), 60).sum() == 0)
        show.field("RobotModel", "visual").uncheck()
        page.get_by_label("Show of base_link").check()
        show.field("RobotModel", "inertia").check()
        until(lambda: violet(show).sum() > 500)
        box = violet(show).sum()
        show.set("RobotModel", "inertia_shape", "ellipsoid")
        # from above, a rectangle a b against an ellipse with half axes sqrt(5/12) of the sides
        until(lambda: abs(violet(show).sum() / box - np.pi * 5 / 12) < 0.12)


def violet(show: Show) -> np.ndarray:
    """Where an inertia is."""
    r, g, b = np.moveaxis(screenshot(show.page).astype(int), 2, 0)
    result: np.ndarray = (b > 70) & (b > 1.35 * g) & (r > 1.1 * g)
    return result


def test_the_fixed_frame_stands_still(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        page = show.page
        page.get_by_role("button", name="Global options").click()
        chooser = page.get_by_label("Fixed frame of the picture")
        assert set(chooser.locator("option").all_inner_texts()) >= {"world", "map", "odom", "left_wheel"}
        page.get_by_label("Show RobotModel", exact=True).check()
        chooser.select_option("left_wheel")
        page.evaluate("kbot.look([0, -1, 0.5], [0, 0, 0])")
        page.evaluate("kbot.drawn()")
        wheel = page.evaluate("kbot.where('left_wheel')")
        box = page.locator(".picture canvas").first.bounding_box()
        # in its own frame the wheel is at the origin, which is looked at
        assert abs(wheel["x"] - box["x"] - box["width"] / 2) < 1.5
        assert abs(wheel["y"] - box["y"] - box["height"] / 2) < 1.5
        page.get_by_label("Background of the picture", exact=True).fill("#ff0000")
        page.get_by_label("Floor of the picture").uncheck()
        until(lambda: show.mask(RED, 6).mean() > 0.5)


def test_frames_that_tf_tells_of_are_drawn(open_page: OpenPage) -> None:
    from kbot.messages import TFMessage
    from kbot.messages import Transform as TransformMessage

    marker_frame = TransformStamped(
        Header(frame_id="map"), "beacon", TransformMessage(Vector3(0.6, 0.4), Quaternion())
    )
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.row("TF").locator(".head").click()
        show.field("TF", "axes").check()
        show.set("TF", "length", "0.5")
        show.set("TF", "filter", "beacon")
        show.bus.publish("/tf", TFMessage((marker_frame,)))
        show.page.get_by_role("button", name="Step").click()
        until(lambda: show.colours((0.7, 0.4, 0.0))[0, 0] > 150)
        assert show.colours((0.6, 0.5, 0.0))[0, 1] > 120
        assert show.colours((0.1, 0.0, 0.0))[0, 0] < 90  # the filter leaves others out
        show.row("TF").get_by_text("Tree").click()
        until(lambda: show.row("TF").locator(".frames li li", has_text="beacon").count())
        arrows = (232, 111, 197)
        assert not show.mask(arrows, 30).any()
        show.field("TF", "arrows").check()
        until(lambda: show.mask(arrows, 30).any())
