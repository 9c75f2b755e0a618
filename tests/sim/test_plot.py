"""The plot of a run has its colours where the robot was."""

import io

import numpy as np
import pytest
from PIL import Image, ImageDraw

from kbot.kinematics.planar_pose import PlanarPose
from kbot.render.path_plot import END, LEFT, ODOMETRY, SIZE, START, TOP, TRUTH, WALL, draw
from kbot.world import World
from kbot.world.builders import box, floor


def pixels(picture):
    """The pixels of the plane, without the labels around it."""
    whole = np.asarray(Image.open(io.BytesIO(picture)))
    return whole[TOP : TOP + SIZE, LEFT : LEFT + SIZE]


def where(pixels, colour):
    """The mean column and row of a colour."""
    rows, columns = np.nonzero((pixels == colour).all(axis=-1))
    return columns.mean(), rows.mean()


def test_wall_covers_its_area():
    # the plot is 8.5 m wide with a margin of 0.25 m: 100 pixels per metre, lower left corner at -1, -4.5
    way = [PlanarPose(-0.75, 0.0, 0.0), PlanarPose(7.75, 0.0, 0.0)]
    seen = pixels(draw(way, way, World("w", (floor(), box("b", (3.0, 2.0, 0.3), 3.0, 2.0))), "t"))
    covered = (seen == WALL).all(axis=-1).sum()
    assert covered == pytest.approx(300 * 200, abs=2 * (300 + 200))  # its edges are drawn completely
    assert where(seen, WALL) == pytest.approx((400, SIZE - 650), abs=1.0)


def test_path_leads_from_the_green_to_the_red_dot():
    truth = [PlanarPose(x / 10, 0.0, 0.0) for x in range(11)]
    odometry = [PlanarPose(x / 10, x / 20, 0.0) for x in range(11)]
    seen = pixels(draw(truth, odometry, World("w", (floor(), box("b", (0.1, 0.2, 0.3), 0.5, -0.2))), "t"))
    start, end, wall = (where(seen, colour) for colour in (START, END, WALL))
    assert start[0] < wall[0] < end[0]
    assert abs(start[1] - end[1]) < 2 < wall[1] - start[1]
    assert where(seen, ODOMETRY)[1] < where(seen, TRUTH)[1]


def test_plot_has_a_legend_and_a_scale(monkeypatch):
    texts = {}

    def text(self, at, words, *rest):
        texts[words] = at

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", text)
    # 9.5 m with margins: a grid of 0.5 m that starts at -0.75
    truth = [PlanarPose(-0.5, 0.0, 0.0), PlanarPose(8.5, 0.0, 0.0)]
    odometry = [PlanarPose(-0.5, 0.0, 0.0), PlanarPose(8.5, 0.3, np.pi / 2)]
    draw(truth, odometry, World("w", (floor(),)), "kbot in w, 9.00 s")
    assert {"kbot in w, 9.00 s", "x [m]", "y [m]", "start", "end"} <= texts.keys()
    assert "truth: ends at x 8.500 m, y 0.000 m, yaw 0.0°" in texts
    believed = "odometry: ends at x 8.500 m, y 0.300 m, yaw 90.0°, 300.0 mm off"
    assert believed in texts
    at = texts["8.5"][0]  # only the line along x is labelled
    assert at == pytest.approx(LEFT + (8.5 + 0.75) / 9.5 * SIZE)
