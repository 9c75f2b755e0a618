"""Compares the extents of shapes with points on their surfaces."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.model import Box, Capsule, Cylinder, Mesh, Sphere
from kbot.model.shapes import bounds, span_along
from kbot.text import Origin, Source

HERE = Origin(Source("", "").whole())
SHAPES = {
    "box": Box((0.3, 0.2, 0.1), HERE),
    "sphere": Sphere(0.2, HERE),
    "cylinder": Cylinder(0.1, 0.4, HERE),
    "capsule": Capsule(0.1, 0.3, HERE),
}


@pytest.mark.parametrize("name", SHAPES)
@given(direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: math.hypot(*d) > 0.1))
def test_spans_are_exact(name, direction):
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


def _ball():
    u = np.linspace(0, 2 * math.pi, 120)
    v = np.linspace(0, math.pi, 61)
    u, v = (a.ravel() for a in np.meshgrid(u, v))
    return np.column_stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])


def _ring(radius, z):
    u = np.linspace(0, 2 * math.pi, 400)
    return np.column_stack([radius * np.cos(u), radius * np.sin(u), np.full_like(u, z)])


def test_bounds_of_a_rotated_box():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    low, high = bounds(SHAPES["box"], turn)
    assert high == pytest.approx([0.1, 0.15, 0.05])
    assert low == pytest.approx([-0.1, -0.15, -0.05])


def test_a_mesh_without_a_file_has_no_bounds():
    mesh = Mesh("package://no/where.stl", None, (1.0, 1.0, 1.0), HERE)
    assert bounds(mesh) is None
