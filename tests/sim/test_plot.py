"""The picture of a run: colours where the robot was."""

import numpy as np

from kbot.kinematics.odometry import PlanarPose
from kbot.sim.plot import END, ODOMETRY, SIZE, START, TRUTH, WALL, Canvas, draw
from kbot.world import World
from kbot.world.builders import box, floor


def where(pixels, colour):
    """Mean column and row of a colour."""
    rows, columns = np.nonzero((pixels == colour).all(axis=-1))
    return columns.mean(), rows.mean()


def test_a_polygon_covers_its_area():
    canvas = Canvas((0.0, 0.0), 9.0)
    canvas.fill([(1.0, 1.0), (4.0, 1.0), (4.0, 3.0), (1.0, 3.0)], WALL)
    assert (canvas.pixels == WALL).all(axis=-1).sum() == 300 * 200
    column, row = where(canvas.pixels, WALL)
    assert (column + 0.5, row + 0.5) == (250, SIZE - 200)


def test_the_way_leads_from_the_green_to_the_red_dot(monkeypatch):
    seen = []
    monkeypatch.setattr(Canvas, "png", lambda self: seen.append(self.pixels) or b"")
    truth = [PlanarPose(x / 10, 0.0, 0.0) for x in range(11)]
    odometry = [PlanarPose(x / 10, x / 20, 0.0) for x in range(11)]
    draw(truth, odometry, World("w", (floor(), box("b", (0.1, 0.2, 0.3), 0.5, -0.2))))
    start, end, wall = (where(seen[0], colour) for colour in (START, END, WALL))
    assert start[0] < wall[0] < end[0]
    assert abs(start[1] - end[1]) < 2 < wall[1] - start[1]
    assert where(seen[0], ODOMETRY)[1] < where(seen[0], TRUTH)[1]
