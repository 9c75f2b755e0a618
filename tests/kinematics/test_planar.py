"""Convex hulls in the plane, compared with results computed by hand."""

import pytest

from kbot.kinematics.planar import convex_hull, twice_area


def test_a_square_with_points_inside_and_on_its_sides():
    square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
    assert convex_hull([(1.0, 1.0), (1.0, 0.0), (2.0, 0.0), *square]) == square


@pytest.mark.parametrize("points", [[], [(1.0, 2.0)], [(0.0, 0.0), (1.0, 2.0)]])
def test_the_hull_of_fewer_than_three_points_is_the_points(points):
    assert convex_hull(points + points) == points


def test_points_on_a_line_have_two_corners_in_spite_of_rounding():
    points = [(0.1, 0.3), (0.2, 0.6), (0.3, 0.9)]
    assert convex_hull(points, tolerance=1e-12) == [points[0], points[-1]]


def test_the_area_is_positive_for_counter_clockwise_corners():
    assert twice_area((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)) == 1.0
    assert twice_area((0.0, 0.0), (0.0, 1.0), (1.0, 0.0)) == -1.0
