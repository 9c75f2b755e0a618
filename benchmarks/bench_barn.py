"""Goals without a map in the 200 worlds of the BARN challenge: success, contacts and the challenge's metric.

    python benchmarks/bench_barn.py [--robot jackal|kbot] [--processes N] [--paths FILE] [WORLD ...]

The challenge's Jackal starts at (-2.25, 3) and drives to a goal 10 m ahead, with its own lidar, wheel
odometry and IMU, at up to 2 m/s and 4 rad/s. It arrives within 1 m of the goal, as in the challenge. A world
succeeds if the robot arrives within 100 s and touches nothing. The metric of a world is the optimal time (the
published shortest path at 2 m/s) divided by the time, which counts as at least twice and at most eight times
the optimal time. It is 0 without success, and at most 0.5. The worlds and the robot are in the folder that
KBOT_SHARED names. With `--robot kbot`, the KBot robot with its lidar drives, at up to its 1 m/s.

The time of a control tick is processor time: the pose estimate, the grid, the cost-to-go and the samples.
`--paths` writes the paths that the robot drove, which docs/barn_pictures.py draws.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from kbot.learn.environments.tasks.barn_worlds import (
    ARRIVE,
    GOAL,
    MAX_SPEED,
    START,
    TIME_LIMIT,
    BarnWorld,
    barn_robot,
    metric,
    read_barn_worlds,
)
from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.navigation.without_map import go_to
from kbot.navigation.without_map.local_pilot import LocalPilot
from kbot.sim import Simulation
from kbot.xacro import Packages

BARN = Path(os.environ.get("KBOT_SHARED", "shared")) / "barn"
WORST = 10
TICK = 5
"""ms. The target for the time of a control tick on one core."""
SUCCESS, METRIC = 0.98, 0.45
"""The targets for all worlds. Exit status 1 if one is missed, or if the robot touches anything."""


@dataclass(frozen=True)
class Score:
    """How a world ended: the time in s from 0.1 m of movement to the goal, and the processor time in s."""

    world: str
    state: str
    reason: str
    collided: bool
    seconds: float | None
    optimal: float
    error: float
    processor: float
    ticks: tuple[float, ...]
    path: tuple[tuple[float, float], ...]

    @property
    def is_success(self) -> bool:
        return self.seconds is not None and self.seconds <= TIME_LIMIT and not self.collided

    @property
    def metric(self) -> float:
        return metric(self.optimal, self.seconds if self.is_success else None)


def load(robot: str) -> RobotModel:
    if robot == "kbot":
        return load_robot("kbot", {"lidar": "true"}).require()
    file, package = barn_robot(BARN)
    return load_robot(file, packages=Packages((package,))).require()


class TimedPilot(LocalPilot):
    """Measures the processor time of each control tick in s."""

    ticks: ClassVar[list[float]] = []

    def tick(self) -> None:
        begun = time.process_time()
        super().tick()
        self.ticks.append(time.process_time() - begun)


def drive(barn: BarnWorld, robot: str) -> Score:
    model = load(robot)
    begun = time.process_time()
    simulation = Simulation(model, barn.world, start=START)
    path: list[tuple[float, float]] = []

    def trace() -> None:
        pose = simulation.ground_truth.pose
        path.append((round(pose.x, 3), round(pose.y, 3)))

    simulation.clock.every(10.0, trace)
    go_to.LocalPilot = TimedPilot  # type: ignore[misc]  # a subclass that measures
    TimedPilot.ticks.clear()
    trip = go_to.go_to_without_map(
        simulation, GOAL, any_heading=True, arrive=ARRIVE, max_speed=MAX_SPEED, timeout=TIME_LIMIT
    )
    took = time.process_time() - begun
    status = trip.status
    return Score(
        barn.name,
        str(status.state),
        status.reason,
        trip.collided,
        trip.arrival,
        barn.optimal_time,
        trip.odometry_error,
        took,
        tuple(TimedPilot.ticks),
        tuple(path),
    )


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--robot", choices=("jackal", "kbot"), default="jackal")
    parser.add_argument("--paths", type=Path)
    parser.add_argument("worlds", nargs="*")
    options = parser.parse_args()
    file = BARN / "worlds.json"
    if not file.exists():
        print(f"no worlds in {file}: set KBOT_SHARED to the folder that holds barn")
        return 0
    worlds = read_barn_worlds(str(BARN))
    names = options.worlds or sorted(worlds, key=int)
    if unknown := [name for name in names if name not in worlds]:
        parser.error(f"there are no worlds {', '.join(unknown)}")
    with ProcessPoolExecutor(options.processes) as pool:
        running = [pool.submit(drive, worlds[name], options.robot) for name in names]
        scores = []
        for future in running:
            scores.append(future.result())
            print(line(scores[-1]), file=sys.stderr, flush=True)
    successes = sum(score.is_success for score in scores)
    share, contacts = successes / len(scores), sum(score.collided for score in scores)
    metric = statistics.mean(score.metric for score in scores)
    print(f"worlds           {len(scores)}")
    print(f"success          {100.0 * share:.1f} %  (target: {100.0 * SUCCESS:g})")
    print(f"contacts         {contacts}  (target: 0)")
    print(f"mean metric      {metric:.3f}  (target: {METRIC}; at most 0.5)")
    print(f"pose estimate    {statistics.median(s.error for s in scores):.3f} m off, median")
    ticks = np.array([tick for score in scores for tick in score.ticks]) * 1e3
    median, high = np.percentile(ticks, [50, 99])
    print(f"control tick     {median:.1f} ms, median; {high:.1f} ms, 99th percentile  (target: {TICK})")
    print(f"processor time   {sum(score.processor for score in scores):.0f} s")
    print("the worst worlds: metric, time of optimal time, processor time")
    for score in sorted(scores, key=lambda score: (score.metric, -(score.seconds or 0.0)))[:WORST]:
        print(line(score))
    if options.paths is not None:
        options.paths.write_text(json.dumps({score.world: [score.metric, score.path] for score in scores}))
    return 0 if share >= SUCCESS and metric >= METRIC and not contacts else 1


def line(score: Score) -> str:
    seconds = "      -" if score.seconds is None else f"{score.seconds:7.2f}"
    contact = "contact" if score.collided else ""
    return (
        f"{score.world:>4}  {score.metric:.3f}  {seconds} s of {score.optimal:5.2f}  {score.processor:5.1f} s"
        f"  {score.state:8s} {contact:8s}{score.reason}"
    )


if __name__ == "__main__":
    sys.exit(main())
