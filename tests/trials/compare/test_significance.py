"""Which differences count: floors, relative floors, and the spread between seeds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kbot.trials import TrialResult
from kbot.trials.compare.significance import COMPLETED, Difference, differences
from kbot.trials.scans import Scans


def _results(*values: float, error: str = "", measure: str = "final_left") -> list[TrialResult]:
    return [
        TrialResult("straight", seed, error=error, all_values={measure: value})
        for seed, value in enumerate(values)
    ]


def _change(before: list[TrialResult], after: list[TrialResult]) -> Difference:
    completed, change = differences(before, after)
    assert not completed.is_significant
    return change


@pytest.mark.parametrize(
    ("before", "after", "is_significant"),
    [
        (0.0, 0.0009, False),  # the floor of lengths is 1 mm
        (0.0, 0.0011, True),
        (2.0, 2.019, False),  # 1 % of 2 m is more than 1 mm
        (2.0, 2.021, True),
        (math.nan, math.nan, False),
        (math.nan, 1.0, True),
        (1.0, math.nan, True),
        (1.0, math.inf, True),
    ],
)
def test_a_difference_counts_beyond_its_floor(before: float, after: float, is_significant: bool) -> None:
    assert _change(_results(before), _results(after)).is_significant is is_significant


def test_a_difference_counts_beyond_its_spread_between_seeds() -> None:
    # mean 0.02 m with a standard deviation of 0.02 m over four seeds: the standard error is 0.01 m
    spread = [0.0, 0.0, 0.04, 0.04]
    change = _change(_results(0.0, 0.0, 0.0, 0.0), _results(*spread))
    assert change.threshold == pytest.approx(2.0 * math.sqrt(4 * 0.02**2 / 3 / 4))
    assert not change.is_significant
    # worlds may differ between seeds, as long as the difference does not
    assert _change(_results(1.0, 5.0, 9.0), _results(1.1, 5.1, 9.1)).is_significant


def test_a_run_that_ends_early_is_a_change() -> None:
    (change,) = differences(_results(1.0), _results(math.nan, error="the simulation diverged"))
    assert change.measure == COMPLETED
    assert change.is_significant
    assert change.size == math.inf
    assert change.to_json()["after"] == 0.0


def test_json_has_no_numbers_that_are_not_finite() -> None:
    assert _change(_results(1.0), _results(math.nan)).to_json() == {
        "scenario": "straight",
        "measure": "final_left",
        "unit": "m",
        "before": 1.0,
        "after": None,
        "significant": True,
    }


def test_the_difference_of_scans_is_a_measure_of_each_lidar() -> None:
    def scanned(*ranges: float) -> list[TrialResult]:
        beam = np.array([[1.0, 0.0, 0.0]])
        scans = (Scans(beam, 8.0, np.array([[each]], dtype=np.float32)) for each in ranges)
        return [TrialResult("maze", seed, scans={"scan": each}) for seed, each in enumerate(scans)]

    _, apart, share = differences(scanned(1.0, 2.0), scanned(1.5, 2.5))
    assert (apart.measure, apart.unit, apart.before) == ("scan_difference/scan", "m", 0.0)
    assert apart.after == pytest.approx(0.5)
    assert apart.is_significant
    assert (share.measure, share.after) == ("scan_share/scan", 1.0)
    # 0.4 and 0.6 m: the mean is 0.5 m, and twice the standard error 2 * 0.1 * sqrt(2) / sqrt(2)
    _, apart, _ = differences(scanned(1.0, 1.0), scanned(1.4, 1.6))
    assert apart.threshold == pytest.approx(0.2, rel=1e-5)
    # a lidar that sees nothing
    _, apart, share = differences(scanned(math.inf), scanned(math.inf))
    assert not apart.is_significant
    assert apart.to_json()["before"] is apart.to_json()["after"] is None
