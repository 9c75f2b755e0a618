"""The cost-to-go is the length of the shortest way, and tells where there is none."""

import math

import numpy as np

from kbot.navigation.space.cost_to_go import Sweeping, halved, weights

RESOLUTION = 0.1


def _solve(weight, goal, radius=0.0):
    sweeping = Sweeping(weight, (0.0, 0.0), RESOLUTION, goal, radius)
    while not sweeping.is_done:
        sweeping.sweep()
    return sweeping.result()


def _at(field, x, y):
    return float(field.at(np.array([x]), np.array([y]))[0])


def test_in_the_open_it_is_the_distance():
    field = _solve(np.ones((60, 60)), (3.05, 3.05))
    for angle in np.linspace(0.0, 2.0 * math.pi, 17):
        x, y = 3.05 + 2.5 * math.cos(angle), 3.05 + 2.5 * math.sin(angle)
        assert 2.48 < _at(field, x, y) < 2.5 * 1.03 + 0.01  # sixteen directions are at most 2.8 % longer


def test_it_leads_around_a_wall():
    occupied = np.zeros((60, 60), dtype=bool)
    occupied[:50, 30] = True  # open above row 50
    field = _solve(weights(occupied, RESOLUTION, 0.15, 0.01), (4.55, 0.55))
    # by hand: up past the end of the wall at (3.05, 4.95), two cells from it, and down again
    by_hand = math.hypot(1.3, 4.6) + 0.4 + math.hypot(1.3, 4.6)
    assert 0.99 * by_hand < _at(field, 1.55, 0.55) < 1.03 * by_hand


def test_a_winding_way_needs_more_sweeps_and_is_found():
    occupied = np.zeros((60, 60), dtype=bool)
    for number, column in enumerate(range(10, 60, 10)):
        occupied[:, column] = True
        gap = slice(0, 6) if number % 2 else slice(-6, None)
        occupied[gap, column] = False
    field = _solve(weights(occupied, RESOLUTION, 0.15, 0.01), (5.55, 3.05))
    assert not field.is_blocked(0.5, 3.0, 0.1)
    assert 20.0 < _at(field, 0.55, 3.05) < 30.0


def test_an_enclosed_goal_is_blocked():
    occupied = np.zeros((60, 60), dtype=bool)
    occupied[20:41, [20, 40]] = occupied[[20, 40], 20:41] = True
    field = _solve(weights(occupied, RESOLUTION, 0.15, 0.3), (3.05, 3.05))
    assert field.is_blocked(0.5, 0.5, 0.2)
    assert not field.is_blocked(2.7, 3.0, 0.2)


def test_a_goal_inside_an_obstacle_is_reached_within_its_radius():
    occupied = np.zeros((60, 60), dtype=bool)
    occupied[28:33, 28:33] = True
    weight = weights(occupied, RESOLUTION, 0.15, 0.3)
    assert _solve(weight, (3.05, 3.05), 0.1).is_blocked(0.5, 3.0, 0.2)
    assert not _solve(weight, (3.05, 3.05), 0.6).is_blocked(0.5, 3.0, 0.2)


def test_a_goal_outside_of_the_grid_is_a_straight_line_away():
    field = _solve(np.ones((60, 60)), (12.05, 3.05))
    assert 8.99 < _at(field, 3.05, 3.05) < 9.0 * 1.03
    occupied = np.zeros((60, 60), dtype=bool)
    occupied[:, 59] = True
    occupied[50:, 59] = False
    detour = _solve(weights(occupied, RESOLUTION, 0.15, 0.01), (12.05, 3.05))
    assert _at(detour, 3.05, 3.05) > 9.3


def test_weights_grow_beside_obstacles_and_narrow_passages_survive_halving():
    occupied = np.zeros((21, 21), dtype=bool)
    occupied[:, 10] = True
    weight = weights(occupied, RESOLUTION, 0.15, 0.4)
    assert weight[5, 10] == weight[5, 11] == 1e4
    assert np.all(np.diff(weight[5, 12:]) <= 0.0)
    assert weight[5, 20] == 1.0
    assert halved(weight).shape == (10, 10)
    assert halved(weight)[2, 4] == weight[5, 8]
