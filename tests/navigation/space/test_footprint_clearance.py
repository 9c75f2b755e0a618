"""The distance between a robot's true outline and obstacles."""

import math

import numpy as np
import pytest

from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint import Outline
from kbot.navigation.space.footprint_clearance import FootprintClearance


def test_the_clearance_is_that_of_the_true_outline():
    footprint = FootprintClearance(Outline.rectangle(-0.2, 0.3, -0.15, 0.15), 0.05)
    occupied = np.zeros((120, 120), dtype=bool)
    occupied[60, 80] = True  # its middle is at (1.025, 0.025)
    field = DistanceField.of(occupied, (-3.0, -3.0), 0.05, 1.0)
    x, y, yaw = np.array([0.5, 0.5, 0.5]), np.array([0.025] * 3), np.array([0.0, math.pi / 2, math.pi])
    # ahead of it by 0.3 m, beside it by 0.15 m, behind it by 0.2 m
    assert footprint.of(field, x, y, yaw) == pytest.approx([0.225, 0.375, 0.325], abs=0.04)
    assert footprint.of(field, np.array([1.0]), np.array([0.0]), np.array([0.3]))[0] < 0.0


def test_the_clearance_of_a_concave_outline_is_that_of_its_pocket():
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    shape = Outline.around([square * (2.0, 0.3), square * (0.3, 2.0)])
    occupied = np.zeros((100, 100), dtype=bool)
    occupied[45, 45] = True  # its middle is at (1.1375, 1.1375)
    field = DistanceField.of(occupied, (0.0, 0.0), 0.025, 3.0)
    footprint = FootprintClearance(shape, 0.01)
    zero = np.zeros(1)
    assert footprint.of(field, zero, zero, zero)[0] == pytest.approx(1.1375 - 0.3, abs=0.03)
    assert FootprintClearance(Outline(shape.corners), 0.01).of(field, zero, zero, zero)[0] < 0.05


def test_a_post_inside_of_a_long_robot_is_a_collision():
    occupied = np.zeros((200, 200), dtype=bool)
    occupied[100, 130] = True
    field = DistanceField.of(occupied, (0.0, 0.0), 0.02, 3.0)
    long = FootprintClearance(Outline.rectangle(-2.0, 2.0, -0.5, 0.5), 0.03)
    x, y, yaw = np.array([2.01 - 1.0]), np.array([2.01]), np.zeros(1)
    assert long.of(field, x, y, yaw)[0] < 0.0
