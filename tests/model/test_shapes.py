"""Shapes against closed formulas, and against points strewn in them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.model import Box, Capsule, Cylinder, Mesh, Sphere
from kbot.model.shapes import bounding_radius, bounds, solid, solid_inertia, span_along, volume
from kbot.text import Origin, Source

HERE = Origin(Source("", "").whole())
SHAPES = {
    "box": Box((0.3, 0.2, 0.1), HERE),
    "sphere": Sphere(0.2, HERE),
    "cylinder": Cylinder(0.1, 0.4, HERE),
    "capsule": Capsule(0.1, 0.3, HERE),
}


def inside(shape, p):
    """Which of the points (n, 3) are in the shape, from its definition."""
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
def test_volume_and_inertia_are_those_of_a_grid_of_points(name):
    shape = SHAPES[name]
    low, high = bounds(shape)
    n = 80
    steps = [low[i] + (high[i] - low[i]) * (np.arange(n) + 0.5) / n for i in range(3)]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    points = grid[inside(shape, grid)]
    cell = np.prod((high - low) / n)
    body = solid(shape)
    assert body.volume == pytest.approx(len(points) * cell, rel=0.01)
    x, y, z = points.T
    moments = np.array([(y * y + z * z).sum(), (x * x + z * z).sum(), (x * x + y * y).sum()]) * cell
    assert np.diag(body.inertia) == pytest.approx(moments, rel=0.02)


def test_known_moments():
    assert volume(SHAPES["cylinder"]) == pytest.approx(math.pi * 0.01 * 0.4)
    inertia = solid_inertia(Cylinder(0.035, 0.005, HERE), 10.0)
    assert inertia[2, 2] == pytest.approx(0.006125)
    assert inertia[0, 0] == pytest.approx(0.0030833333333333)
    assert np.diag(solid_inertia(Box((0.16, 0.16, 0.01), HERE), 10.0)) == pytest.approx(
        [0.0214166666, 0.0214166666, 0.0426666666]
    )


@pytest.mark.parametrize("name", SHAPES)
@given(
    direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: math.hypot(*d) > 0.1),
    about=st.tuples(*[st.floats(-1, 1)] * 3),
)
def test_reach_is_not_exceeded_and_is_met(name, direction, about):
    shape = SHAPES[name]
    unit = np.array(direction) / math.hypot(*direction)
    surface = {
        "box": lambda s: (
            np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * s.size / 2
        ),
        "sphere": lambda s: s.radius * _ball(),
        "cylinder": lambda s: np.concatenate([_ring(s.radius, s.length / 2), _ring(s.radius, -s.length / 2)]),
        "capsule": lambda s: np.concatenate([s.radius * _ball() + (0, 0, k * s.length / 2) for k in (-1, 1)]),
    }[name](shape)
    low, high = span_along(shape, unit)
    along = surface @ unit
    assert along.max() == pytest.approx(high, abs=2e-3)
    assert along.max() <= high + 1e-12
    assert along.min() == pytest.approx(low, abs=2e-3)
    farthest = np.linalg.norm(surface - about, axis=1).max()
    radius = bounding_radius(shape, about)
    assert farthest == pytest.approx(radius, abs=3e-3)
    assert farthest <= radius + 1e-12


def _ball():
    u = np.linspace(0, 2 * math.pi, 120)
    v = np.linspace(0, math.pi, 61)
    u, v = (a.ravel() for a in np.meshgrid(u, v))
    return np.column_stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])


def _ring(radius, z):
    u = np.linspace(0, 2 * math.pi, 400)
    return np.column_stack([radius * np.cos(u), radius * np.sin(u), np.full_like(u, z)])


def test_bounds_of_a_turned_box():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    low, high = bounds(SHAPES["box"], turn)
    assert high == pytest.approx([0.1, 0.15, 0.05])
    assert low == pytest.approx([-0.1, -0.15, -0.05])


def test_a_mesh_without_file_measures_nothing():
    mesh = Mesh("package://no/where.stl", None, (1.0, 1.0, 1.0), HERE)
    assert solid(mesh) is None
    assert bounds(mesh) is None
    assert bounding_radius(mesh) is None
