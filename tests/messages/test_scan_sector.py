"""A sector of a laser scan: its beams, its order, and values that were not measured."""

import math
from dataclasses import replace

import numpy as np
import pytest

from kbot.messages.sensing import LaserScan
from kbot.text import KbotError

FULL = LaserScan(
    angle_min=-math.pi,
    angle_max=math.pi,
    angle_increment=math.radians(10.0),
    range_min=0.12,
    range_max=400.0,
    ranges=np.arange(-180.0, 181.0, 10.0, dtype=np.float32) + 190.0,
)
"""A beam every 10 degrees from -180 to 180, both included. Its range is its angle in degrees plus 190."""


def angles(scan: LaserScan, start: float, end: float) -> list[float]:
    """The angles in degrees of the beams in a sector, which is also given in degrees."""
    return [float(distance) - 190.0 for distance in scan.sector(math.radians(start), math.radians(end))]


def test_angles_are_in_radians() -> None:
    """0.5 rad are 28.6 degrees, and 2 pi is a whole turn."""
    assert [float(distance) - 190.0 for distance in FULL.sector(-0.5, 0.5)] == [-20, -10, 0, 10, 20]
    assert len(FULL.sector(0.0, 2.0 * math.pi)) == 37


@pytest.mark.parametrize(("start", "end"), [(-30, 30), (0, 90), (-6.4, 0)])
def test_angles_beyond_a_full_turn_are_taken_for_degrees(start: float, end: float) -> None:
    advice = f"sector(math.radians({start:g}), math.radians({end:g}))"
    with pytest.raises(KbotError, match="angles in rad from -2 pi to 2 pi") as caught:
        FULL.sector(start, end)
    assert advice in str(caught.value)


def test_a_sector_has_the_beams_between_its_angles_from_right_to_left() -> None:
    assert angles(FULL, -30, 30) == [-30, -20, -10, 0, 10, 20, 30]
    assert angles(FULL, 60, 120) == [60, 70, 80, 90, 100, 110, 120]
    assert angles(FULL, 61, 79) == [70]
    assert angles(FULL, 90, 90) == [90]


def test_a_sector_may_cross_the_rear() -> None:
    """The scan has two beams to the rear, at -180 and 180 degrees."""
    assert sorted(angles(FULL, 160, -160)) == [-180, -170, -160, 160, 170, 180]
    assert angles(FULL, 150, -170) == [150, 160, 170, -180, 180, -170]
    assert angles(FULL, 150, 190) == angles(FULL, 150, -170) == angles(FULL, -210, -170)


@pytest.mark.parametrize(("start", "end"), [(0, 360), (-180, 180), (-270, 270)])
def test_a_whole_turn_has_every_beam(start: float, end: float) -> None:
    assert len(angles(FULL, start, end)) == 37


def test_a_scan_from_left_to_right_has_the_same_sectors() -> None:
    reverse = replace(
        FULL,
        angle_min=math.pi,
        angle_max=-math.pi,
        angle_increment=-FULL.angle_increment,
        ranges=FULL.ranges[::-1],
    )
    assert angles(reverse, -30, 30) == [-30, -20, -10, 0, 10, 20, 30]


def test_the_minimum_is_infinite_if_nothing_is_seen() -> None:
    empty = replace(FULL, ranges=np.full(37, np.inf, dtype=np.float32))
    assert min(empty.sector(-0.5, 0.5)) == math.inf


def test_values_that_were_not_measured_are_infinite() -> None:
    """Outside its limits a range is to be discarded (sensor_msgs/LaserScan); -inf is too close (REP 117)."""
    ranges = np.full(37, 1.0, dtype=np.float32)
    ranges[15:22] = np.nan, 0.0, 0.12, 400.0, 401.0, -np.inf, np.inf
    scan = replace(FULL, ranges=ranges)
    assert scan.sector(-0.55, 0.55).tolist() == pytest.approx(
        [math.inf, math.inf, 0.12, 400.0, math.inf, -math.inf, math.inf]
    )
    assert min(scan.sector(-0.55, 0.55)) == -math.inf


def test_a_sector_without_a_beam_is_an_error() -> None:
    ahead = replace(
        FULL, angle_min=math.radians(-90), angle_max=math.radians(90), ranges=np.ones(19, dtype=np.float32)
    )
    assert len(angles(ahead, -90, 90)) == 19
    with pytest.raises(KbotError, match=r"no beam from 2 to 3 rad: it has 19 beams from -1\.571 to 1\.57"):
        ahead.sector(2, 3)
    with pytest.raises(KbotError, match=r"no beam from 0\.05 to 0\.08 rad"):
        FULL.sector(0.05, 0.08)
    with pytest.raises(KbotError, match="no beam"):
        LaserScan().sector(-0.5, 0.5)
    with pytest.raises(KbotError, match="two finite angles in rad"):
        FULL.sector(math.nan, 3)


def test_a_sector_changes_nothing_in_the_scan() -> None:
    before = FULL.ranges.copy()
    FULL.sector(-0.5, 0.5)[:] = 0.0
    assert np.array_equal(FULL.ranges, before)
