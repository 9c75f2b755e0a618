"""Reeds-Shepp paths end exactly at the goal, and no other path of the family is shorter."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.kinematics import PlanarPose
from kbot.navigation.planning.reeds_shepp import distances, path_between, paths

COORDINATE = st.floats(-8.0, 8.0)
YAW = st.floats(-math.pi, math.pi)


def _distance(x, y, yaw):
    return float(distances(np.array([x]), np.array([y]), np.array([yaw]))[0])


@given(COORDINATE, COORDINATE, YAW)
def test_every_word_ends_at_the_goal_and_the_shortest_has_the_distance(x, y, yaw):
    words = paths(x, y, yaw)
    for word in words:
        end_x, end_y, end_yaw = word.sample(PlanarPose(), 1.0, 0.5)[-1]
        assert (end_x, end_y) == pytest.approx((x, y), abs=1e-6)
        assert math.remainder(end_yaw - yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert words[0].length == pytest.approx(_distance(x, y, yaw), abs=1e-6)


@given(COORDINATE, COORDINATE, YAW)
def test_the_distance_is_the_same_mirrored_backwards_and_reversed(x, y, yaw):
    distance = _distance(x, y, yaw)
    back = PlanarPose(x, y, yaw).inverse()
    for other in ((x, -y, -yaw), (-x, y, -yaw), (back.x, back.y, back.yaw)):
        assert _distance(*other) == pytest.approx(distance, abs=1e-6)


@given(COORDINATE, COORDINATE, YAW)
def test_no_path_is_shorter_than_the_straight_line_or_than_the_turn(x, y, yaw):
    assert _distance(x, y, yaw) >= max(math.hypot(x, y), abs(yaw)) - 1e-9


@given(COORDINATE, COORDINATE, YAW, COORDINATE, COORDINATE, YAW)
def test_a_detour_is_not_shorter(x, y, yaw, via_x, via_y, via_yaw):
    via = PlanarPose(via_x, via_y, via_yaw)
    rest = via.inverse() @ PlanarPose(x, y, yaw)
    detour = _distance(via_x, via_y, via_yaw) + _distance(rest.x, rest.y, rest.yaw)
    assert _distance(x, y, yaw) <= detour + 1e-6


@pytest.mark.parametrize(
    ("goal", "turns", "length"),
    [
        ((3.0, 0.0, 0.0), "S", 3.0),
        ((-2.0, 0.0, 0.0), "S", 2.0),
        ((1.0, 1.0, math.pi / 2), "L", math.pi / 2),
        ((-1.0, 1.0, -math.pi / 2), "L", math.pi / 2),
        # half a turn on the spot: three curves of 60 degrees
        ((0.0, 0.0, math.pi), "LRL", math.pi),
        # a parallel curve to the left of a quarter turn, a straight line, and another quarter
        ((0.0, 5.0, math.pi), "LSL", 3.0 + math.pi),
    ],
)
def test_simple_paths_are_those_computed_by_hand(goal, turns, length):
    best = paths(*goal)[0]
    assert best.length == pytest.approx(length)
    assert len(best.turns) == len(turns)
    assert best.turns in (turns, turns.translate(str.maketrans("LR", "RL")))


def test_cusps_are_counted_and_curves_are_as_wide_as_the_radius():
    path = path_between(PlanarPose(1.0, 2.0, 0.3), PlanarPose(1.0, 2.0, 0.3 + math.pi), 2.0)[0]
    assert path.cusps == 2
    poses = path.sample(PlanarPose(1.0, 2.0, 0.3), 2.0, 0.05)
    x, y, turn = np.diff(poses, axis=0).T
    chord = 2.0 * 2.0 * np.sin(np.abs(turn) / 2.0)
    assert np.hypot(x, y) == pytest.approx(chord, abs=1e-9)
    assert poses[-1] == pytest.approx([1.0, 2.0, 0.3 + math.pi], abs=1e-9) or poses[-1] == pytest.approx(
        [1.0, 2.0, 0.3 - math.pi], abs=1e-9
    )
