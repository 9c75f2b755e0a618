"""Accuracy of the drive: odometry compared with ground truth.

    python benchmarks/bench_drive.py

Exit status 1 if an error exceeds its limit.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import degrees, hypot, pi

import kbot


@dataclass(frozen=True)
class Figure:
    name: str
    distance: str
    error: float
    limit: float
    unit: str


def stop(sim: kbot.Simulation) -> None:
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)


def errors(sim: kbot.Simulation) -> tuple[float, float]:
    """Difference between odometry and ground truth, in millimetres and degrees."""
    odometry, truth = sim.odometry, sim.ground_truth
    off = hypot(odometry.pose.x - truth.pose.x, odometry.pose.y - truth.pose.y)
    return 1e3 * off, abs(degrees(odometry.unwrapped_yaw - truth.unwrapped_yaw))


def straight(sim: kbot.Simulation) -> Figure:
    sim.cmd_vel(0.2, 0.0)
    sim.run(10.0)
    stop(sim)
    return Figure("straight 2 m", f"{sim.ground_truth.pose.x:.5f} m", errors(sim)[0], 0.01, "mm")


def turns(sim: kbot.Simulation) -> Figure:
    sim.cmd_vel(0.0, 1.0)
    sim.run(20 * pi)
    stop(sim)
    turned = sim.ground_truth.unwrapped_yaw / (2 * pi)
    return Figure("ten turns on the spot", f"{turned:.5f} turns", errors(sim)[1], 0.01, "deg")


def square(side: float) -> Callable[[kbot.Simulation], Figure]:
    def drive(sim: kbot.Simulation) -> Figure:
        way = 0.0
        for _ in range(4):
            before = sim.ground_truth.pose
            sim.cmd_vel(0.2, 0.0)
            sim.run(5.0)
            stop(sim)
            after = sim.ground_truth.pose
            way += hypot(after.x - before.x, after.y - before.y)
            sim.cmd_vel(0.0, side)
            sim.run(pi / 2)
            stop(sim)
        name = "1 m square to the " + ("left" if side > 0 else "right")
        return Figure(name, f"{way:.5f} m in four sides", errors(sim)[0], 0.01, "mm")

    return drive


def figure_of_eight(sim: kbot.Simulation) -> Figure:
    way, last = 0.0, sim.ground_truth.pose
    for turn in (0.5, -0.5):
        sim.cmd_vel(0.2, turn)
        for _ in range(round(4 * pi / 0.02)):
            sim.run(0.02)
            here = sim.ground_truth.pose
            way, last = way + hypot(here.x - last.x, here.y - last.y), here
    stop(sim)
    return Figure("figure of eight", f"{way:.4f} m", errors(sim)[0], 0.01, "mm")


def standing(sim: kbot.Simulation) -> Figure:
    sim.run(1.0)
    before = sim.ground_truth.pose
    sim.run(60.0)
    after = sim.ground_truth.pose
    moved = 1e3 * hypot(after.x - before.x, after.y - before.y)
    return Figure("standing still 60 s", "0 m", moved, 0.001, "mm")


def on_a_slope(sim: kbot.Simulation) -> Figure:
    sim.cmd_vel(0.2, 0.0)
    sim.run(5.0)
    stop(sim)
    before = sim.link_pose("base_footprint").translation
    sim.run(60.0)
    after = sim.link_pose("base_footprint").translation
    moved = 1e3 * float(hypot(*(after - before)))
    return Figure("a minute on a 10 degree slope", f"{before[2]:.3f} m up", moved, 0.1, "mm")


def main() -> int:
    robot = kbot.load("kbot")
    sim = kbot.Simulation(robot)
    figures = []
    for drive in (straight, turns, square(1.0), square(-1.0), figure_of_eight, standing):
        sim.reset()
        figures.append(drive(sim))
    figures.append(on_a_slope(kbot.Simulation(robot, world="ramp:angle=10")))
    for f in figures:
        verdict = "" if f.error < f.limit else "   EXCEEDED"
        print(f"{f.name:32}{f.distance:26}{f.error:10.6f} {f.unit:4} limit {f.limit:g}{verdict}")
    return int(any(f.error >= f.limit for f in figures))


if __name__ == "__main__":
    sys.exit(main())
