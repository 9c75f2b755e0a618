"""The task of this example: drive to a goal in rooms, with a lidar and without a map."""

from typing import Any

import gymnasium

import kbot  # noqa: F401 - registers the environments

TRAINING_ROOMS = ((1, 16), (17, 32))
"""First and last seed of the rooms in which the policy is trained, for each environment."""
TEST_ROOMS = (1001, 1100)
"""First and last seed of the rooms in which it is tested, whose doors and tables are elsewhere."""
OPTIONS: dict[str, Any] = {
    "robot": "kbot",
    "properties": {"lidar": True},
    "world": "rooms:columns=2,rows=2,seed={seed}",
    "max_speed": (0.5, 2.0),  # m/s and rad/s
    "distance": (0.5, 4.0),  # m from the start to the goal, around the walls
    "rewards": {"progress": 5.0, "failure": -5.0},
}


def environment(rooms: tuple[int, int], time_limit: float, pose: str = "ground_truth") -> gymnasium.Env:
    """Episodes in random ones of these rooms, from a random place to a random goal."""
    return gymnasium.make("kbot/Goal-v0", world_seeds=rooms, time_limit=time_limit, pose=pose, **OPTIONS)
