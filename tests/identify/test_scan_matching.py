"""Tests scan matching with scans of a rectangular room."""

import numpy as np
import pytest

from kbot.identify.nominal import read_nominal
from kbot.identify.scan_matching import Scan, matched_poses
from kbot.text import KbotError

NOMINAL = read_nominal("kbot", {"lidar": "true"}, {}, (), None)
TIMES = np.arange(0.0, 18.0, 0.1)
SPEED = 0.2
WHEELS = TIMES, np.column_stack([SPEED * TIMES / 0.035] * 2)


def scan(time: float, *, is_blind: bool) -> Scan:
    """A scan of a room of 5 m by 4 m, from a lidar on its centre line that drives along it."""
    angles = np.arange(360) * 2.0 * np.pi / 360.0 + 1e-3
    x, cos, sin = SPEED * time - 1.8, np.cos(angles), np.sin(angles)
    ranges = np.minimum(np.where(cos > 0, 2.5 - x, -2.5 - x) / cos, 2.0 / np.abs(sin))
    points = ranges[:, None] * np.column_stack([cos, sin])
    return Scan(time, (np.nan * points if is_blind else points).astype(np.float32))


def test_scans_after_a_gap_begin_a_new_chain():
    scans = [scan(time, is_blind=6.0 < time < 11.0) for time in TIMES]
    with pytest.warns(UserWarning, match=r"run.mcap: \d+ s of /scan are not used"):
        times, poses, is_first = matched_poses("run.mcap", "/scan", scans, WHEELS, NOMINAL)
    assert times[-1] > 16.0
    moved, lasted = np.diff(poses[:, 0]), np.diff(times)
    matched = ~is_first[1:]
    np.testing.assert_allclose(moved[matched], SPEED * lasted[matched], atol=2e-3)
    assert 5.0 < lasted[~matched].sum() < 8.0


def test_scans_without_points_are_one_error():
    scans = [scan(time, is_blind=True) for time in TIMES]
    with pytest.raises(KbotError, match="the scans of /scan cannot be matched"):
        matched_poses("run.mcap", "/scan", scans, WHEELS, NOMINAL)
