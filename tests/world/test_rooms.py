"""The world `rooms`: a seed moves its doors and tables, and every room can be reached."""

import numpy as np
import pytest

from kbot.navigation.space.distance_field import inflate
from kbot.world import load_world
from kbot.world.occupancy import FREE_BELOW
from kbot.world.occupancy_of_world import world_grid


def places(text: str) -> dict[str, tuple[float, ...]]:
    found = load_world(text).bodies
    return {body.name: tuple((body.pose @ body.parts[0].pose).translation.round(9)) for body in found}


def test_a_seed_gives_the_same_rooms_again_and_another_one_others() -> None:
    assert places("rooms:seed=7") == places("rooms:seed=7")
    assert places("rooms:seed=7") != places("rooms:seed=8")
    assert places("rooms:seed=0") == places("rooms")


def test_without_a_seed_doors_are_in_the_middle() -> None:
    """A piece of a wall of 2 m with a door of 0.6 m is 0.7 m long: its middle is 0.65 m from the door."""
    found = places("rooms:columns=2,rows=1")
    assert found["wall_x1_0_a"][:2] == pytest.approx((1.0, -0.65))
    assert found["wall_x1_0_b"][:2] == pytest.approx((1.0, 0.65))


@pytest.mark.parametrize("seed", range(1, 21))
def test_a_small_robot_reaches_every_room(seed: int) -> None:
    """A disc with the radius of the KBot robot, 0.13 m, finds a way from the start to the middle of each door
    and to some place in each room."""
    grid = world_grid(load_world(f"rooms:seed={seed}"), 0.05, around=[(0.0, 0.0)], margin=0.5)
    free = ~inflate(grid.cells >= FREE_BELOW, 0.13 / grid.resolution + 0.5)
    reached = np.zeros_like(free)
    reached[grid.cell(0.0, 0.0)] = True
    while True:
        wider = reached.copy()
        for axis in (0, 1):
            for step in (-1, 1):
                wider |= np.roll(reached, step, axis)
        wider &= free
        if (wider == reached).all():
            break
        reached = wider
    for column in range(3):
        for row in range(2):
            centres = grid.centers(np.argwhere(reached)) - (2.0 * column, 2.0 * row)
            assert (np.abs(centres) < 0.9).all(axis=1).sum() > 200  # of 1300 cells


def test_small_rooms_have_their_tables_in_the_middle() -> None:
    found = places("rooms:columns=2,rows=1,size=0.9,door=0.5,seed=3")
    assert found["table_1_0"][:2] == pytest.approx((0.9, 0.0))
