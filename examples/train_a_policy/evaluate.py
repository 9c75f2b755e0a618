"""Compare a policy with a straight line, in rooms that it has not seen in training.

python evaluate.py policy.onnx --episodes 100
"""

import argparse
import math
from collections import Counter
from collections.abc import Callable

import gymnasium
import numpy as np
import task
from numpy.typing import NDArray

from kbot.learn import Policy, PolicyInterface

Vector = NDArray[np.float32]
Drive = Callable[[Vector], Vector]


class StraightLine:
    """Turns to the goal, drives straight to it, and stops before obstacles."""

    aimed = math.radians(15)
    """With a larger bearing to the goal, it turns on the spot."""
    ahead, beside = 0.25, 0.14
    """m. It stops for an obstacle in this rectangle. The robot reaches 0.06 m ahead and 0.09 m aside."""

    def __init__(self, interface: PolicyInterface) -> None:
        self._turn_bound = interface.angular[1]
        sectors = interface.lidar
        assert sectors is not None, "the robot has a lidar"
        edges = np.linspace(sectors.start, sectors.end, sectors.count + 1)
        self._angles = (edges[:-1] + edges[1:]) / 2

    def __call__(self, seen: Vector) -> Vector:
        bearing = math.atan2(seen[2], seen[1])
        turn = np.clip(4.0 * bearing / self._turn_bound, -1.0, 1.0)
        nearest = seen[-len(self._angles) :]
        x, y = nearest * np.cos(self._angles), nearest * np.sin(self._angles)
        is_free = not ((x > 0.0) & (x < self.ahead) & (np.abs(y) < self.beside)).any()
        return np.array([1.0 if is_free and abs(bearing) < self.aimed else -1.0, turn], dtype=np.float32)


def run(environment: gymnasium.Env, drive: Drive, seed: int) -> tuple[str, float, float]:
    """An episode. Returns how it ended, its time in s, and the length of the shortest way in m."""
    seen, start = environment.reset(seed=seed)
    while True:
        seen, _, is_over, is_late, info = environment.step(drive(seen))
        if is_over or is_late:
            return info["outcome"], info["time"], start["way"]


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("policy")
    words.add_argument("--episodes", type=int, default=100)
    given = words.parse_args()
    policy = Policy.read(given.policy)
    environment = task.environment(task.TEST_ROOMS, time_limit=30.0, pose="odometry")
    straight = StraightLine(environment.get_wrapper_attr("interface"))
    drivers: dict[str, Drive] = {"straight line": straight, "policy": policy.act}
    print("| driver | arrived | collided | out of time | mean speed along the way |")
    print("| --- | --- | --- | --- | --- |")
    for name, drive in drivers.items():
        runs = [run(environment, drive, seed) for seed in range(given.episodes)]
        count = Counter(outcome for outcome, _, _ in runs)
        arrived = [(time, way) for outcome, time, way in runs if outcome == "arrived"]
        speed = (
            f"{sum(way for _, way in arrived) / sum(time for time, _ in arrived):.2f} m/s" if arrived else "-"
        )
        shares = [f"{count[each] / len(runs):.0%}" for each in ("arrived", "collided", "time limit")]
        print(f"| {name} | {' | '.join(shares)} | {speed} |", flush=True)


if __name__ == "__main__":
    main()
