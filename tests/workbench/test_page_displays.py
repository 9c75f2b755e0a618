"""Each display by its pixels: a message is drawn where it should be."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.messages import (
    Header,
    Odometry,
    Point,
    PoseWithCovariance,
    Twist,
    TwistStamped,
    Vector3,
)
from kbot.messages.navigation import (
    Path,
    PoseStamped,
    PoseWithCovarianceStamped,
)
from kbot.messages.sensing import LaserScan, Range, Wrench, WrenchStamped
from kbot.messages.visualization import Point32, PointStamped, Polygon, PolygonStamped, PoseArray

from .conftest import until
from .displayed import FROM_ABOVE, WORLD, Show, is_like, is_red, pose, showing
from .pictures import screenshot

OpenPage = Callable[..., Any]

RED, GREEN = (255, 0, 0), (0, 255, 0)


def covariance(x: float, y: float, yaw: float) -> tuple[float, ...]:
    """Return a 6x6 covariance with variances in the plane."""
    return tuple(np.diag([x, y, 0.0, 0.0, 0.0, yaw]).ravel().tolist())


def test_a_scanned_wall_is_drawn_at_its_place(open_page: OpenPage) -> None:
    # a straight wall at x = 1 m: the range of a beam at an angle is 1 / cos(angle)
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
        show.publish("LaserScan", "/laser", scan)
        seen = np.argwhere(show.mask(GREEN))
        low, high = show.pixels([(1.0, 1.0 * np.tan(0.6), 0.0), (1.0, -1.0 * np.tan(0.6), 0.0)])
        assert len(seen) > 500
        assert abs(seen[:, 1] - low[1]).max() <= 4  # one column: the points are 4 px wide
        assert abs(seen[:, 0].min() - low[0]) <= 4
        assert abs(seen[:, 0].max() - high[0]) <= 4
        # a beam is a faint line from the sensor to its point: here halfway along the outermost beam
        (row, column), = show.pixels([(0.5, -0.5 * np.tan(0.6), 0.0)])  # fmt: skip

        def greenness() -> int:
            show.page.evaluate("kbot.drawn()")
            around = screenshot(show.page)[row - 1 : row + 2, column - 1 : column + 2].astype(int)
            return int((around[..., 1] - around[..., 0]).max())

        without = greenness()
        show.field("LaserScan", "beams").check()
        show.publish("LaserScan", "/laser", scan)
        until(lambda: greenness() > without + 20)
        show.field("LaserScan", "beams").uncheck()
        until(lambda: greenness() == without)


def test_a_scan_is_drawn_in_its_own_frame(open_page: OpenPage) -> None:
    ranges = np.array([1.0], np.float32)
    scan = LaserScan(Header(frame_id="lidar_link"), range_max=8.0, ranges=ranges)
    with showing(open_page, {"/laser": LaserScan}, arguments={"lidar": "true"}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("LaserScan", "/laser")
        show.set("LaserScan", "colour", "#00ff00")
        show.publish("LaserScan", "/laser", scan)
        # its beams are 2 cm above the tops of the wheels, which are at 0.07 m
        middle = np.argwhere(show.mask(GREEN)).mean(axis=0)
        assert np.abs(middle - show.pixels([(1.0, 0.0, 0.09)])[0]).max() <= 3
        show.bus.publish("/laser", LaserScan(Header(frame_id="nowhere"), range_max=8.0, ranges=ranges))
        until(lambda: "frame nowhere does not exist" in show.status("LaserScan"))
        assert not show.mask(GREEN).any()


def test_a_path_is_a_line_through_its_poses(open_page: OpenPage) -> None:
    corners = [(-0.5, 0.0), (0.5, 0.0), (0.5, 0.6)]
    path = Path(WORLD, tuple(PoseStamped(WORLD, pose(*corner)) for corner in corners))
    with showing(open_page, {"/way": Path}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Path", "/way")
        show.set("Path", "width", "7")
        show.publish("Path", "/way", path)
        on = [(-0.4, 0.0, 0.0), (0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.5, 0.3, 0.0)]
        off = [(0.0, 0.1, 0.0), (0.3, 0.3, 0.0), (-0.6, 0.0, 0.0)]
        line = (25, 255, 0)
        assert is_like(show.colours(*on), line)
        assert not any(is_like(show.colours(place), line) for place in off)
        show.publish("Path", "/way", Path(WORLD))
        until(lambda: not show.mask(line).any())


def arrows_from(show: Show, colour: str, at: tuple[float, float], length: float, yaw: float) -> None:
    """Check by pixels that an arrow goes this far from a place in a direction, and not farther."""
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
        show.publish(kind, "/it", message)
        arrows_from(show, "#ff2000", (0.2, -0.3), 0.5, 0.8)
        if kind == "PoseArray":
            arrows_from(show, "#ff2000", (-0.6, 0.4), 0.5, 0.0)


def test_odometry_keeps_earlier_poses_and_shows_covariance(open_page: OpenPage) -> None:
    def odometry(x: float) -> Odometry:
        # one standard deviation: 0.2 m along x and 0.1 m along y
        return Odometry(WORLD, "base_link", PoseWithCovariance(pose(x), covariance(0.04, 0.01, 0.0)))

    with showing(open_page, {"/told": Odometry}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Odometry", "/told")
        show.set("Odometry", "colour", "#ff2000")
        show.set("Odometry", "length", "0.2")
        show.publish("Odometry", "/told", odometry(-0.8))
        show.publish("Odometry", "/told", odometry(-0.79))  # not far enough to be kept
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
        show.publish("Twist", "/speed", message)
        # a rotation about z of 2 rad/s is a ring of 0.3 m, open in its last quarter
        ring = show.colours((0.0, 0.3, 0.0), (-0.3, 0.0, 0.0))
        assert (ring[:, 2] > 120).all()
        assert (ring[:, 0] < 80).all()
        assert show.colours((0.24, -0.24, 0.0))[0, 2] < 90
        assert show.colours((0.45, 0.0, 0.0))[0, 0] > 120
        assert show.colours((0.55, 0.0, 0.0))[0, 0] < 90


def test_a_wrench_is_an_arrow_along_the_force_and_a_ring_around_the_torque(open_page: OpenPage) -> None:
    message = WrenchStamped(WORLD, Wrench(Vector3(10.0), Vector3(0.0, 0.0, 3.0)))
    with showing(open_page, {"/force": WrenchStamped}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Wrench", "/force")
        show.set("Wrench", "linear", "#ff2000")
        show.set("Wrench", "angular", "#0040ff")
        show.set("Wrench", "linear_scale", "0.06")
        show.set("Wrench", "angular_scale", "0.1")
        show.publish("Wrench", "/force", message)
        assert (show.colours((0.0, 0.3, 0.0), (-0.3, 0.0, 0.0))[:, 2] > 120).all()  # 3 Nm
        assert show.colours((0.55, 0.0, 0.0))[0, 0] > 120  # 10 N
        assert show.colours((0.65, 0.0, 0.0))[0, 0] < 90


def test_a_polygon_is_a_closed_line(open_page: OpenPage) -> None:
    corners = tuple(Point32(x, y) for x, y in ((-0.5, -0.3), (0.5, -0.3), (0.5, 0.3)))
    with showing(open_page, {"/footprint": PolygonStamped}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Polygon", "/footprint")
        show.set("Polygon", "colour", "#ff0000")
        show.set("Polygon", "width", "7")
        show.publish("Polygon", "/footprint", PolygonStamped(WORLD, Polygon(corners)))
        assert is_red(show.colours((0.0, -0.3, 0.0), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0))).all()
        assert not is_red(show.colours((0.2, 0.0, 0.0), (0.0, 0.3, 0.0))).any()


def test_a_path_has_the_requested_width_in_metres(open_page: OpenPage) -> None:
    way = Path(WORLD, (PoseStamped(WORLD, pose(-0.5)), PoseStamped(WORLD, pose(0.5))))
    with showing(open_page, {"/way": Path}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Path", "/way")
        show.set("Path", "colour", "#ff0000")
        show.set("Path", "style", "billboards")
        show.set("Path", "metres", "0.2")
        show.publish("Path", "/way", way)
        assert is_red(show.colours((0.0, 0.0, 0.0), (0.3, 0.09, 0.0), (-0.3, -0.09, 0.0))).all()
        assert not is_red(show.colours((0.0, 0.12, 0.0), (0.0, -0.12, 0.0))).any()


def test_a_range_is_a_cone_of_the_measured_length(open_page: OpenPage) -> None:
    def sonar(distance: float) -> Range:
        return Range(WORLD, field_of_view=0.6, min_range=0.02, max_range=2.0, range=distance)

    with showing(open_page, {"/sonar": Range}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Range", "/sonar")
        show.set("Range", "colour", "#ff0000")
        show.set("Range", "alpha", "1")
        show.publish("Range", "/sonar", sonar(0.8))
        found = show.extent(show.mask(RED, 12))
        wide = 0.8 * np.tan(0.3)
        # the edge of a flat cone is at its widest place, with half of its rim above the ground
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
        show.publish("PointStamped", "/clicked", PointStamped(WORLD, Point(0.4, 0.3)))
        assert is_red(show.colours((0.4, 0.3, 0.0), (0.47, 0.3, 0.0))).all()
        assert not is_red(show.colours((0.53, 0.3, 0.0))).any()
