"""The outline of a robot, its margin and its pockets."""

import math

import numpy as np
import pytest

from kbot.model.load import load_robot
from kbot.navigation.space.footprint import Outline, outline, turning_radius


def test_the_outline_of_kbot_is_that_of_its_plate_and_wheels():
    robot = load_robot("kbot").require()
    # the plate reaches from 0.10 m behind the axle to 0.06 m ahead and 0.08 m to each side;
    # the wheels are 0.07 m long and reach 0.0895 m to each side
    half = [(-0.10, 0.08), (-0.035, 0.0895), (0.035, 0.0895), (0.06, 0.08)]
    expected = sorted([*half, *((x, -y) for x, y in half)])
    corners = outline(robot, "base_footprint").corners.round(9).tolist()
    assert np.array(sorted(corners)) == pytest.approx(np.array(expected))


def test_an_outline_grows_by_its_margin():
    box = Outline.rectangle(-0.1, 0.2, -0.05, 0.05).grown(0.01)
    points = np.array(
        [(0.205, 0.0), (0.215, 0.0), (0.0, 0.059), (0.0, 0.061), (-0.105, -0.055), (-0.12, 0.0)]
    )
    assert box.holds(points).tolist() == [True, False, True, False, True, False]
    assert box.reach == pytest.approx(math.hypot(0.2, 0.05) + 0.01)


def test_kbots_radius_is_its_plates_far_corner():
    # the plate is 0.16 m square, its middle 0.02 m behind the axle's: hypot(0.10, 0.08)
    robot = load_robot("kbot").require()
    assert turning_radius(robot, "base_footprint") == pytest.approx(math.hypot(0.10, 0.08))


def test_an_outline_is_convex_unless_it_has_a_large_pocket():
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    assert not Outline.around([square, square + np.array([0.9, 0.0])]).pieces
    shape = Outline.around([square * (2.0, 0.3), square * (0.3, 2.0)])
    assert len(shape.pieces) == 2
    assert shape.holds(np.array([(1.9, 0.1), (0.1, 1.9), (0.8, 0.8)])).tolist() == [True, True, False]
    # shapes that are apart: what is between them is unknown
    assert not Outline.around([square, square + np.array([5.0, 5.0])]).pieces
