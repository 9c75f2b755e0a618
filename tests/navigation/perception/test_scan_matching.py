"""Matched scans show how the robot moved, and whether it is where it was."""

import itertools
import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose
from kbot.navigation.perception.scan_matching import ScanMatcher

WALLS = [((-2.0, -1.5), (3.0, -1.5)), ((3.0, -1.5), (3.0, 1.5)), ((3.0, 1.5), (-2.0, 1.5)),
         ((-2.0, 1.5), (-2.0, -1.5)), ((1.0, -1.5), (1.0, -0.9))]  # fmt: skip
CORRIDOR = [((-50.0, 1.0), (50.0, 1.0)), ((-50.0, -1.0), (50.0, -1.0))]


def _scan(pose, walls=WALLS, noise=0.005, seed=0, most=8.0):
    """The points in the robot's frame at which 360 beams end."""
    angles = np.radians(np.arange(-180.0, 180.0))
    rays = np.stack([np.cos(pose.yaw + angles), np.sin(pose.yaw + angles)])
    nearest = np.full(len(angles), math.inf)
    for start, end in walls:
        along, to = np.subtract(end, start), np.subtract(start, (pose.x, pose.y))
        with np.errstate(divide="ignore", invalid="ignore"):
            across = rays[0] * along[1] - rays[1] * along[0]
            distance = (to[0] * along[1] - to[1] * along[0]) / across
            share = (to[0] * rays[1] - to[1] * rays[0]) / across
        hit = (distance > 0.0) & (share >= 0.0) & (share <= 1.0)
        nearest[hit] = np.minimum(nearest[hit], distance[hit])
    seen = nearest < most
    ranges = (nearest + noise * np.random.default_rng(seed).standard_normal(len(angles)))[seen]
    return np.stack([ranges * np.cos(angles[seen]), ranges * np.sin(angles[seen])], axis=1)


def _match(true, predicted, walls=WALLS, has_gyro=False):
    matcher = ScanMatcher()
    assert matcher.match(_scan(PlanarPose(), walls), PlanarPose(), has_gyro) is None
    return matcher.match(_scan(true, walls, seed=1), predicted, has_gyro)


@pytest.mark.parametrize("predicted", [PlanarPose(0.1, 0.0, 0.05), PlanarPose(0.05, 0.03, 0.0)])
def test_a_match_shows_the_true_motion(predicted):
    true = PlanarPose(0.08, 0.02, 0.03)
    match = _match(true, predicted)
    assert match.is_good
    assert (match.pose.x, match.pose.y) == pytest.approx((true.x, true.y), abs=0.005)
    assert match.pose.yaw == pytest.approx(true.yaw, abs=0.005)


def test_along_a_corridor_the_prediction_decides():
    match = _match(PlanarPose(0.2, 0.0, 0.0), PlanarPose(0.1, 0.02, 0.0), CORRIDOR)
    assert match.pose.x == pytest.approx(0.1, abs=0.02)
    assert match.pose.y == pytest.approx(0.0, abs=0.005)


def _post(x, y, radius, sides=180):
    corners = [
        (x + radius * math.cos(a), y + radius * math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, sides)
    ]
    return list(itertools.pairwise(corners))


def test_around_a_single_post_the_prediction_decides():
    post = _post(0.8, -0.4, 0.2)
    matcher, estimate, true = ScanMatcher(), PlanarPose(), PlanarPose()
    for number in range(40):  # past the post, with exact wheels
        points = _scan(true, post, noise=0.0, seed=number)
        match = matcher.match(points, estimate, False)
        if match is not None:
            estimate = match.pose
            matcher.renew(points, match)
        true, estimate = true @ PlanarPose(0.04, 0.0, 0.0), estimate @ PlanarPose(0.04, 0.0, 0.0)
    assert math.hypot(estimate.x - true.x, estimate.y - true.y) < 0.02
    assert estimate.yaw == pytest.approx(true.yaw, abs=0.02)


def test_a_single_post_shows_a_motion_towards_it():
    match = _match(PlanarPose(0.05, 0.0, 0.0), PlanarPose(0.03, 0.0, 0.0), _post(0.8, 0.0, 0.2))
    assert match.pose.x == pytest.approx(0.05, abs=0.005)


def test_a_push_is_found_in_a_wider_range():
    true = PlanarPose(0.1, 0.25, 0.3)
    match = _match(true, PlanarPose(0.02, 0.0, 0.0))
    assert match.is_good
    assert (match.pose.x, match.pose.y) == pytest.approx((true.x, true.y), abs=0.01)


def test_a_scan_of_another_place_does_not_fit():
    match = _match(PlanarPose(2.2, -1.0, 2.0), PlanarPose(0.05, 0.0, 0.0))
    assert not match.fits


def test_errors_stay_small_over_many_references():
    matcher, estimate, true = ScanMatcher(), PlanarPose(-1.0, 0.0, 0.0), PlanarPose(-1.0, 0.0, 0.0)
    for number in range(60):
        points = _scan(true, seed=number)
        match = matcher.match(points, estimate, False)
        if match is not None:
            assert match.fits
            estimate = match.pose
            matcher.renew(points, match)
        step = PlanarPose(0.04, 0.0, 0.02)
        true = true @ step
        estimate = estimate @ PlanarPose(1.1 * step.x, 0.0, step.yaw)  # wheels 10 % too large
    assert math.hypot(estimate.x - true.x, estimate.y - true.y) < 0.03


def test_a_few_points_are_not_matched():
    matcher = ScanMatcher()
    few = np.array([[1.0, 0.0], [1.0, 0.1]])
    assert matcher.match(few, PlanarPose(), False) is None
    assert matcher.match(few, PlanarPose(), False) is None
