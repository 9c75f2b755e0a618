"""Convex hulls in the plane, by hand."""

import pytest

from kbot.kinematics.planar import convex_hull, twice_area


def test_a_square_with_points_inside_and_on_its_sides():
    square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
    assert convex_hull([(1.0, 1.0), (1.0, 0.0), (2.0, 0.0), *square]) == square


@pytest.mark.parametrize("points", [[], [(1.0, 2.0)], [(0.0, 0.0), (1.0, 2.0)]])
def test_fewer_than_three_points_are_their_own_hull(points):
    assert convex_hull(points + points) == points


def test_points_that_rounding_takes_off_their_line():
    points = [(0.1, 0.3), (0.2, 0.6), (0.3, 0.9)]
    assert convex_hull(points, tolerance=1e-12) == [points[0], points[-1]]


def test_the_sign_of_an_area_is_the_sense_of_its_corners():
    assert twice_area((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)) == 1.0
    assert twice_area((0.0, 0.0), (0.0, 1.0), (1.0, 0.0)) == -1.0
