"""Tests the share of variance that a dimension explains, against known functions."""

import math

import numpy as np
import pytest

from kbot.sweep.report.sensitivity import effect


def uniform(count: int, dimensions: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-math.pi, math.pi, (dimensions, count))


def test_shares_of_a_linear_function() -> None:
    """Var(2a + b) = 4 Var(a) + Var(b)."""
    a, b, c = uniform(5000, 3)
    y = list(2 * a - b)
    assert effect(list(a), y).share == pytest.approx(0.8, abs=0.02)
    assert effect(list(b), y).share == pytest.approx(0.2, abs=0.03)
    assert effect(list(c), y).share == pytest.approx(0.0, abs=0.01)
    assert [effect(list(each), y).direction for each in (a, b, c)] == [1, -1, 0]


def test_shares_of_the_ishigami_function() -> None:
    """The indices are known: Saltelli et al. 2008, section 4.4, with a = 7 and b = 0.1."""
    a, b, c = uniform(20000, 3)
    y = list(np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a))
    # 27 groups lose 0.008 of the share of b, and the standard error of 20,000 samples is 0.007
    shares = [effect(list(each), y).share for each in (a, b, c)]
    assert shares == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)


def test_a_full_grid_is_an_analysis_of_variance() -> None:
    """By hand: the means of the rows are 1 and 3, within each row ±1: epsilon² = 1 - (4/2) / (8/3) = 0.25."""
    assert effect(["x", "x", "y", "y"], [0.0, 2.0, 2.0, 4.0]).share == pytest.approx(0.25)


def test_too_few_designs_have_no_share() -> None:
    assert math.isnan(effect([1, 2, 3], [1.0, 2.0, 3.0]).share)
    assert math.isnan(effect([], []).share)
    assert math.isnan(effect([1, 1, 1], [1.0, 2.0, 3.0]).share)
    assert effect([1, 1, 2, 2], [3.0, 3.0, 3.0, 3.0]).share == 0.0
