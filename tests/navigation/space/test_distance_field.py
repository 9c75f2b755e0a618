"""Distances to occupied cells, and inflated obstacles, against a search over all cells."""

import numpy as np
import pytest

from kbot.navigation.space.distance_field import DistanceField, distances, inflate


def test_distances_are_those_of_a_search_over_all_cells():
    random = np.random.default_rng(3)
    occupied = random.random((40, 50)) < 0.01
    rows, columns = np.nonzero(occupied)
    r, c = np.mgrid[:40, :50]
    every = np.hypot(r[..., None] - rows, c[..., None] - columns).min(axis=-1)
    assert distances(occupied, 12) == pytest.approx(np.minimum(every, 12.0), abs=1e-5)
    assert distances(np.zeros((5, 5), dtype=bool), 7) == pytest.approx(np.full((5, 5), 7.0))


def test_a_field_is_read_in_metres_and_is_far_outside():
    occupied = np.zeros((20, 20), dtype=bool)
    occupied[10, 10] = True  # its middle is at (0.525, 0.525)
    field = DistanceField.of(occupied, (0.0, 0.0), 0.05, 0.3)
    found = field.at(np.array([0.525, 0.625, 0.02, 9.0]), np.array([0.525, 0.525, 0.02, 9.0]))
    assert found == pytest.approx([0.0, 0.1, 0.3, 0.3])


def test_inflation_is_the_distance_between_middles():
    random = np.random.default_rng(5)
    blocked = random.random((30, 41)) < 0.02
    at = np.argwhere(blocked)
    cells = np.argwhere(np.ones_like(blocked))
    distance = np.hypot(*(cells[:, None] - at[None]).transpose(2, 0, 1)).min(axis=1).reshape(blocked.shape)
    for radius in (0.0, 0.5, 1.0, 1.5, 3.2, 7.9, 60.0):
        assert np.array_equal(inflate(blocked, radius), blocked | (distance < radius)), radius
    assert not inflate(np.zeros((3, 4), dtype=bool), 2.0).any()
