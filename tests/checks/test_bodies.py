"""The volumes and moments of shapes, compared with formulas and with points inside the shapes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.checks.facts.bodies import LinkBody, body_of
from kbot.model import Box, Capsule, Collision, Cylinder, Geometry, Link, Pose, Sphere
from kbot.text import Origin, Source

HERE = Origin(Source("", "").whole())
SHAPES = {
    "box": Box((0.3, 0.2, 0.1), HERE),
    "sphere": Sphere(0.2, HERE),
    "cylinder": Cylinder(0.1, 0.4, HERE),
    "capsule": Capsule(0.1, 0.3, HERE),
}


def body(shape: Geometry) -> LinkBody:
    """The body of a link with one shape at its origin."""
    return body_of(Link("link", None, (), (Collision("", Pose(), shape, HERE),), HERE))


def inside(shape, p):
    """Which of the points (n, 3) are inside the shape, by its definition."""
    x, y, z = p.T
    match shape:
        case Box(size=(a, b, c)):
            return (abs(x) <= a / 2) & (abs(y) <= b / 2) & (abs(z) <= c / 2)
        case Sphere(radius=r):
            return x * x + y * y + z * z <= r * r
        case Cylinder(radius=r, length=h):
            return (x * x + y * y <= r * r) & (abs(z) <= h / 2)
        case Capsule(radius=r, length=h):
            rest = np.maximum(abs(z) - h / 2, 0)
            return x * x + y * y + rest * rest <= r * r
    raise AssertionError


@pytest.mark.parametrize("name", SHAPES)
def test_volume_and_inertia_agree_with_a_grid_of_points(name):
    shape = SHAPES[name]
    low, high = (np.array(end) for end in body(shape).ends)
    n = 80
    steps = [low[i] + (high[i] - low[i]) * (np.arange(n) + 0.5) / n for i in range(3)]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    points = grid[inside(shape, grid)]
    cell = np.prod((high - low) / n)
    filled = body(shape).solid
    assert filled.volume == pytest.approx(len(points) * cell, rel=0.01)
    x, y, z = points.T
    moments = np.array([(y * y + z * z).sum(), (x * x + z * z).sum(), (x * x + y * y).sum()]) * cell
    assert np.diag(filled.unit_tensor) * filled.volume == pytest.approx(moments, rel=0.02)


def test_moments_agree_with_published_formulas():
    """A thin disc and a plate of 10 kg, with the formulas of a table of moments of inertia."""
    disc, plate = body(Cylinder(0.035, 0.005, HERE)).solid, body(Box((0.16, 0.16, 0.01), HERE)).solid
    assert disc.volume == pytest.approx(math.pi * 0.035**2 * 0.005)
    of_disc, of_plate = (10.0 * np.array(solid.unit_tensor) for solid in (disc, plate))
    assert of_disc == pytest.approx(np.diag([0.00308333333, 0.00308333333, 0.006125]))
    assert of_plate == pytest.approx(np.diag([0.0214166666, 0.0214166666, 0.0426666666]))


@pytest.mark.parametrize("name", SHAPES)
@given(point=st.tuples(*[st.floats(-1, 1)] * 3))
def test_the_reach_is_the_distance_of_the_farthest_point(name, point):
    shape = SHAPES[name]
    reach = body(shape).reach(point)
    low, high = (np.array(end) for end in body(shape).ends)
    steps = [np.linspace(low[i], high[i], 41) for i in range(3)]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    farthest = np.linalg.norm(grid[inside(shape, grid)] - point, axis=1).max()
    assert farthest <= reach + 1e-12
    assert farthest == pytest.approx(reach, abs=0.02)
