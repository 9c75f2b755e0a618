"""The same minute of driving in KBot and in other simulators.

    python -m pip install -e .[bench]
    python benchmarks/bench_peers.py [--seconds 60]

Each engine simulates KBot on a plane with steps of 2 ms, 0.2 m/s and 0.5 rad/s, and a command every 20 ms.
KBot's run also computes odometry and joint states. Times are multiples of KBot's, the medians of alternating
runs. A peer that is not installed is named and left out.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import hypot
from pathlib import Path
from typing import Any

import mujoco
from bench_stepping import engine

import kbot
from kbot.model.writer import to_urdf

REPEATS = 7
STEP = 0.002
STEPS_A_COMMAND = 10
LINEAR, ANGULAR = 0.2, 0.5

Run = Callable[[int], float]
"""Drives a number of steps from the start, and returns the final distance from the start in m."""


def by_kbot(robot: kbot.Robot) -> Run:
    sim = kbot.Simulation(robot)

    def run(steps: int) -> float:
        sim.reset()
        for _ in range(steps // STEPS_A_COMMAND):
            sim.cmd_vel(LINEAR, ANGULAR)
            sim.step(STEPS_A_COMMAND)
            sim.odometry, sim.joint_states  # noqa: B018 - computed as a robot's driver would
        return hypot(sim.ground_truth.pose.x, sim.ground_truth.pose.y)

    return run


def by_mujoco(robot: kbot.Robot) -> Run:
    """MuJoCo's own loop in C, with the model that KBot compiled."""
    model, speeds = engine(robot)
    data = mujoco.MjData(model)

    def run(steps: int) -> float:
        mujoco.mj_resetData(model, data)
        data.ctrl[:] = speeds
        mujoco.mj_step(model, data, nstep=steps)
        return hypot(data.qpos[0], data.qpos[1])

    return run


def by_pybullet(robot: kbot.Robot) -> Run:
    with quiet():
        import pybullet as p

    client = p.connect(p.DIRECT)
    speeds = _wheel_speeds(robot)
    with tempfile.TemporaryDirectory() as folder:
        path = _urdf(robot, folder)

        def start() -> tuple[int, list[int], list[float]]:
            p.resetSimulation(client)
            p.setGravity(0.0, 0.0, -9.81)
            p.setTimeStep(STEP)
            ground = p.createCollisionShape(p.GEOM_PLANE)
            p.createMultiBody(0.0, ground)
            body = p.loadURDF(path)
            names = {p.getJointInfo(body, i)[1].decode(): i for i in range(p.getNumJoints(body))}
            return body, [names[name] for name in speeds], list(speeds.values())

        with quiet():
            ready = [start()]

    def run(steps: int) -> float:
        body, joints, wanted = ready[0]
        p.resetBasePositionAndOrientation(body, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        for _ in range(steps // STEPS_A_COMMAND):
            p.setJointMotorControlArray(body, joints, p.VELOCITY_CONTROL, targetVelocities=wanted)
            for _ in range(STEPS_A_COMMAND):
                p.stepSimulation()
        x, y, _ = p.getBasePositionAndOrientation(body)[0]
        return hypot(x, y)

    return run


@contextmanager
def quiet() -> Iterator[None]:
    """Discard the output of an engine."""
    sys.stdout.flush()
    kept = os.dup(1), os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        for stream in (1, 2):
            os.dup2(nowhere.fileno(), stream)
        try:
            yield
        finally:
            for stream, old in zip((1, 2), kept, strict=True):
                os.dup2(old, stream)
                os.close(old)


def by_dart(robot: kbot.Robot) -> Run:
    import dartpy as dart

    speeds = _wheel_speeds(robot)
    with tempfile.TemporaryDirectory() as folder:
        body = dart.utils.DartLoader().parseSkeleton(_urdf(robot, folder))
    world = dart.simulation.World()
    world.setTimeStep(STEP)
    world.setGravity([0.0, 0.0, -9.81])
    world.addSkeleton(body)
    world.addSkeleton(_dart_ground(dart))
    joints = [body.getJoint(name) for name in speeds]
    for joint in joints:
        joint.setActuatorType(dart.dynamics.ActuatorType.VELOCITY)
    start = body.getPositions()

    def run(steps: int) -> float:
        body.setPositions(start)
        body.setVelocities(start * 0.0)
        for _ in range(steps // STEPS_A_COMMAND):
            for joint, speed in zip(joints, speeds.values(), strict=True):
                joint.setCommand(0, speed)
            for _ in range(STEPS_A_COMMAND):
                world.step(False)  # False: keep the command
        x, y = body.getRootBodyNode().getWorldTransform().translation()[:2]
        return hypot(x, y)

    return run


def _dart_ground(dart: Any) -> Any:  # noqa: ANN401 - DART has no types
    ground = dart.dynamics.Skeleton("ground")
    _, body = ground.createWeldJointAndBodyNodePair()
    shape = body.createShapeNode(dart.dynamics.BoxShape([100.0, 100.0, 0.2]))
    shape.createCollisionAspect()
    shape.createDynamicsAspect()
    shape.setRelativeTranslation([0.0, 0.0, -0.1])
    return ground


def _urdf(robot: kbot.Robot, folder: str) -> str:
    path = Path(folder) / "kbot.urdf"
    path.write_text(to_urdf(robot))
    return str(path)


def _wheel_speeds(robot: kbot.Robot) -> dict[str, float]:
    """Wheel speeds in rad/s, by joint."""
    drive = kbot.Simulation(robot).robots.first.drive
    left, right = drive.wheel_speeds(LINEAR, ANGULAR)
    sides = dict.fromkeys(drive.left, left) | dict.fromkeys(drive.right, right)
    return {name: speed * drive.forward[name] for name, speed in sides.items()}


def timed(function: Run, steps: int) -> tuple[float, float]:
    start = time.perf_counter()
    distance = function(steps)
    return time.perf_counter() - start, distance


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=60.0, help="simulated seconds per run")
    steps = round(parser.parse_args().seconds / STEP / STEPS_A_COMMAND) * STEPS_A_COMMAND
    robot = kbot.load("kbot")
    runs = {"KBot": by_kbot(robot), "MuJoCo's loop in C": by_mujoco(robot)}
    for module, name, make in (("pybullet", "PyBullet", by_pybullet), ("dartpy", "DART", by_dart)):
        if importlib.util.find_spec(module) is None:
            print(f"{name} is not installed: pip install -e .[bench]")
        else:
            runs[name] = make(robot)
    taken: dict[str, list[float]] = {name: [] for name in runs}
    distances: dict[str, float] = {}
    for _ in range(REPEATS):
        for name, run in runs.items():
            seconds, distances[name] = timed(run, steps)
            taken[name].append(seconds)
    own = statistics.median(taken["KBot"])
    print(f"{steps * STEP:g} s on the plane, as a multiple of KBot's time; final distance from the start")
    for name, seconds in taken.items():
        print(f"{name:24}{statistics.median(seconds) / own:6.2f}   {distances[name]:.3f} m")


if __name__ == "__main__":
    main()
