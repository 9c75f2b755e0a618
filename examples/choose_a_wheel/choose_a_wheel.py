"""Simulate two hundred wheel sizes, and find the smallest wheel that climbs the stairs.

python examples/choose_a_wheel/choose_a_wheel.py
python examples/choose_a_wheel/choose_a_wheel.py --count 20 --csv wheels.csv
"""

from __future__ import annotations

import argparse
import csv
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import kbot


@dataclass(frozen=True)
class Trial:
    """The result for one wheel: the distance in m on level ground and on the stairs, the height climbed in m,
    and the error of odometry on level ground in %."""

    wheel_radius: float
    level: float
    stairs: float
    climbed: float
    odometry_off: float


def trial(wheel_radius: float, robot: str, seconds: float, height: float) -> Trial:
    """Drive a robot straight ahead: on level ground, and up two steps that are each `height` m high."""
    with warnings.catch_warnings():
        # two different wheel radii in one description would make the comparison invalid
        warnings.simplefilter("error", kbot.DescriptionWarning)
        model = kbot.load(robot, wheel_radius=wheel_radius)
    level = kbot.Simulation(model)
    stairs = kbot.Simulation(model, world=f"stairs:steps=2,height={height}")
    start = stairs.link_pose(model.root).translation[2]
    for sim in (level, stairs):
        sim.cmd_vel(0.3, 0.0)
        sim.run(seconds)
    distance, odometry = level.ground_truth.pose.x, level.odometry.pose.x
    climbed = stairs.link_pose(model.root).translation[2] - start
    return Trial(
        wheel_radius, distance, stairs.ground_truth.pose.x, climbed, 100.0 * (odometry / distance - 1.0)
    )


def sweep(
    count: int, robot: str = "kbot", seconds: float = 6.0, height: float = 0.014, jobs: int | None = None
) -> list[Trial]:
    """Try `count` radii from 20 to 50 mm. The results do not depend on the number of processes."""
    radii = [0.020 + 0.030 * i / max(1, count - 1) for i in range(count)]
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(partial(trial, robot=robot, seconds=seconds, height=height), radii))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", default="kbot", help="robot description with an argument 'wheel_radius'")
    parser.add_argument("--count", type=int, default=200, help="number of radii")
    parser.add_argument("--seconds", type=float, default=6.0, help="duration of each drive, in s")
    parser.add_argument("--height", type=float, default=0.014, help="height of a step, in m")
    parser.add_argument("--jobs", type=int, help="number of processes (default: one per processor)")
    parser.add_argument("--csv", help="file to write all results to")
    options = parser.parse_args()
    try:
        trials = sweep(options.count, options.robot, options.seconds, options.height, options.jobs)
    except (kbot.KbotError, kbot.DescriptionWarning) as error:
        sys.exit(str(error))
    if options.csv:
        with Path(options.csv).open("w", newline="") as file:
            rows = csv.DictWriter(file, list(asdict(trials[0])))
            rows.writeheader()
            rows.writerows(asdict(t) for t in trials)
    climbers = [t for t in trials if t.climbed > 1.5 * options.height]
    if climbers:
        smallest = min(climbers, key=lambda t: t.wheel_radius)
        print(f"{len(climbers)} of {len(trials)} wheels climb both steps of {options.height * 1000:g} mm;")
        print(f"the smallest has a radius of {smallest.wheel_radius * 1000:.1f} mm")
    else:
        print(f"none of {len(trials)} wheels climbs two steps of {options.height * 1000:g} mm")
    print(f"odometry on the level is at most {max(abs(t.odometry_off) for t in trials):.3f} % off")


if __name__ == "__main__":
    main()
