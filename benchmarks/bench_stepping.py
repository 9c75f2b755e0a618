"""Speed of stepping through Python, as a share of MuJoCo's C loop with the same motion.

    python benchmarks/bench_stepping.py [--seconds 20]

The C loop gets the recorded wheel commands of the simulation, so that both compute the same physics. The
medians of alternating runs are compared.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from math import sin

import mujoco

import kbot
from kbot.kinematics.drive.drive import find_drive
from kbot.sim.engine.assembly import compile_model
from kbot.sim.engine.robot_builder import RobotPlan
from kbot.sim.recipe import Contacts
from kbot.world import load_world

REPEATS = 9
STEP = 0.002


def engine(robot: kbot.Robot) -> tuple[mujoco.MjModel, list[float]]:
    """The same compiled model without KBot's code around it, and its controls for an arc."""
    drive = find_drive(robot)
    plan = RobotPlan(robot.name, robot, drive, Contacts.RECIPE, kbot.Transform.identity(), others=False)
    model, _ = compile_model(load_world("empty"), [plan], STEP)
    controls = [0.0] * model.nu
    for names, speed in zip(drive.sides.values(), drive.wheel_speeds(0.2, 0.5), strict=True):
        for name in names:
            controls[model.actuator(f"{robot.name}/{name}").id] = speed * drive.forward[name]
    return model, controls


def weaving(index: int) -> tuple[float, float]:
    """A command that changes every time."""
    return 0.2 + 0.05 * sin(0.05 * index), 0.5 * sin(0.02 * index)


def recorded(sim: kbot.Simulation, steps: int) -> list[tuple[float, ...]]:
    """The wheel commands of `weaving`, one for every five steps."""
    sim.reset()
    found = []
    for index in range(steps // 10):
        sim.cmd_vel(*weaving(index))
        for _ in range(2):
            sim.step(5)
            found.append(tuple(sim.engine.data.ctrl))
    return found


def timed(function: Callable[[], None]) -> float:
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated seconds per run")
    steps = round(parser.parse_args().seconds / STEP / 10) * 10
    robot = kbot.load("kbot")
    model, controls = engine(robot)
    sim = kbot.Simulation(robot)
    data = mujoco.MjData(model)

    def in_c() -> None:
        mujoco.mj_resetData(model, data)
        data.ctrl[:] = controls
        mujoco.mj_step(model, data, nstep=steps)

    commands = recorded(sim, steps)

    def in_c_changing() -> None:
        mujoco.mj_resetData(model, data)
        for pair in commands:
            data.ctrl[:] = pair
            mujoco.mj_step(model, data, nstep=5)

    def constant() -> None:
        sim.reset()
        for _ in range(steps // 10):
            sim.cmd_vel(0.2, 0.5)
            sim.step(10)

    def changing() -> None:
        sim.reset()
        for index in range(steps // 10):
            sim.cmd_vel(*weaving(index))
            sim.step(10)

    def one_by_one() -> None:
        sim.reset()
        sim.cmd_vel(0.2, 0.5)
        for _ in range(steps):
            sim.step()
            sim.joint_positions  # noqa: B018 - read in every step, as a controller would

    def in_one() -> None:
        sim.reset()
        sim.cmd_vel(0.2, 0.5)
        sim.step(steps)

    ways = {
        "one call for all steps": in_one,
        "50 Hz, the same command": constant,
        "50 Hz, a new command": changing,
        "one call per step, joints read": one_by_one,
    }
    shares: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(REPEATS):
        for name, way in ways.items():
            peer = in_c_changing if way is changing else in_c
            shares[name].append(timed(peer) / timed(way))
    print(f"MuJoCo's C loop over {steps} steps of {STEP} s is 1.00")
    for name, found in shares.items():
        print(f"{name:32}{statistics.median(found):6.2f}")


if __name__ == "__main__":
    main()
