"""Two hundred wheels, each simulated: which is the smallest that climbs the stairs?

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
    """What became of one wheel: metres that the robot went on the level and up the stairs, how high it
    came, and how far odometry is off on the level, in %."""

    wheel_radius: float
    level: float
    stairs: float
    climbed: float
    odometry_off: float


def trial(wheel_radius: float, robot: str, seconds: float, height: float) -> Trial:
    """Drive one robot ahead, on the level and at two steps that are each `height` m high."""
    with warnings.catch_warnings():
        # sizes that the description tells twice, and differently, would falsify the comparison
        warnings.simplefilter("error", kbot.DescriptionWarning)
        model = kbot.load(robot, wheel_radius=wheel_radius)
    level = kbot.Simulation(model)
    stairs = kbot.Simulation(model, world=f"stairs:steps=2,height={height}")
    start = stairs.link_pose(model.root).translation[2]
    for sim in (level, stairs):
        sim.cmd_vel(0.3, 0.0)
        sim.run(seconds)
    gone, told = level.ground_truth.pose.x, level.odometry.pose.x
    climbed = stairs.link_pose(model.root).translation[2] - start
    return Trial(wheel_radius, gone, stairs.ground_truth.pose.x, climbed, 100.0 * (told / gone - 1.0))


def sweep(
    count: int, robot: str = "kbot", seconds: float = 6.0, height: float = 0.014, jobs: int | None = None
) -> list[Trial]:
    """`count` radii from 20 to 50 mm, on all processors; the same trials whatever their number."""
    radii = [0.020 + 0.030 * i / max(1, count - 1) for i in range(count)]
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(partial(trial, robot=robot, seconds=seconds, height=height), radii))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", default="kbot", help="a description with an argument 'wheel_radius'")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--height", type=float, default=0.014, help="of a step, in m")
    parser.add_argument("--jobs", type=int, help="processes at once; all processors by default")
    parser.add_argument("--csv", help="write all trials to this file")
    asked = parser.parse_args()
    try:
        trials = sweep(asked.count, asked.robot, asked.seconds, asked.height, asked.jobs)
    except (kbot.KbotError, kbot.DescriptionWarning) as error:
        sys.exit(str(error))
    if asked.csv:
        with Path(asked.csv).open("w", newline="") as file:
            rows = csv.DictWriter(file, list(asdict(trials[0])))
            rows.writeheader()
            rows.writerows(asdict(t) for t in trials)
    climbers = [t for t in trials if t.climbed > 1.5 * asked.height]
    if climbers:
        smallest = min(climbers, key=lambda t: t.wheel_radius)
        print(f"{len(climbers)} of {len(trials)} wheels climb both steps of {asked.height * 1000:g} mm;")
        print(f"the smallest has a radius of {smallest.wheel_radius * 1000:.1f} mm")
    else:
        print(f"none of {len(trials)} wheels climbs two steps of {asked.height * 1000:g} mm")
    print(f"odometry on the level is at most {max(abs(t.odometry_off) for t in trials):.3f} % off")


if __name__ == "__main__":
    main()
