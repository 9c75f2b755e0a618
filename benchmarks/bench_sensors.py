"""Time of a lidar scan and a camera picture, compared with the ray casting of MuJoCo and PyBullet.

    python benchmarks/bench_sensors.py

Times are medians of alternating runs in processor time. The ratio is the median of the ratios of each round.
The camera is measured in wall-clock time. PyBullet is measured if it is installed (`pip install pybullet`).
"""

from __future__ import annotations

import importlib.util
import math
import statistics
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from kbot.kinematics import Transform
from kbot.model.load import load_robot
from kbot.sensors import Camera, Lidar
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import Box, World, load_world
from kbot.world.builders import box, floor

POSE = Transform.from_xyz_rpy((0.0, 0.0, 0.06), (0.0, 0.0, 0.0))
ROUNDS, CALLS = 25, 40


def walls(count: int) -> World:
    """Straight walls at random places in 10 x 10 m, none at the robot."""
    random = np.random.default_rng(1)
    bodies = [floor()]
    while len(bodies) <= count:
        x, y = random.uniform(-5, 5, 2)
        if math.hypot(x, y) > 0.7:
            yaw = float(random.choice([0.0, math.pi / 2]))
            bodies.append(box(f"wall{len(bodies)}", (0.6, 0.02, 0.25), float(x), float(y), yaw=yaw))
    return World("walls", tuple(bodies))


WORLDS = {"empty": load_world("empty"), "30 boxes": load_world("boxes:count=30"), "200 walls": walls(200)}


def microseconds(work: Callable[[], Any]) -> float:
    begun = time.process_time()
    for _ in range(CALLS):
        work()
    return 1e6 * (time.process_time() - begun) / CALLS


def engine_rays(simulation: Simulation, lidar: Any) -> Callable[[], Any]:  # noqa: ANN401 - either of two lidars
    """MuJoCo's ray casting alone, excluding the robot's body."""
    model, data = simulation.engine.current()
    pose = simulation.link_pose("base_link") @ POSE
    place, flat = pose.translation.copy(), (lidar.spec.directions @ pose.rotation.T).reshape(-1)
    geometry, distance = np.empty(360, dtype=np.int32), np.empty(360)
    body = model.body("kbot/base_link").id
    return lambda: mujoco.mj_multiRay(
        model, data, place, flat, None, True, body, geometry, distance, None, 360, 10.0
    )


def pybullet_rays(world: World) -> Callable[[], Any] | None:
    if importlib.util.find_spec("pybullet") is None:
        return None
    import pybullet as bullet  # type: ignore[import-not-found] - measured if it is installed

    client = bullet.connect(bullet.DIRECT)
    for body in world.bodies:
        for part in body.parts:
            if isinstance(part.shape, Box):
                half = [v / 2 for v in part.shape.size]
                shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
                pose = body.pose @ part.pose
                place, turn = pose.translation.tolist(), pose.quaternion_xyzw
                bullet.createMultiBody(0, shape, -1, place, turn, physicsClientId=client)
    angles = np.linspace(-math.pi, math.pi, 360)
    ends = np.stack([10 * np.cos(angles), 10 * np.sin(angles), 0.1 + 0 * angles], axis=1).tolist()
    starts = [[0.0, 0.0, 0.1]] * 360
    return lambda: bullet.rayTestBatch(starts, ends, physicsClientId=client)


def lidar_table() -> None:
    robot = load_robot("kbot").require()
    print("360 beams    lidar us  with LaserScan us  mj_multiRay us  ratio  PyBullet us  ratio")
    for name, world in WORLDS.items():
        simulation = Simulation(robot, world)
        lidar = simulation.add_sensor(Lidar(link="base_link", pose=POSE))
        works = [lidar.distances, lidar.measure, engine_rays(simulation, lidar), pybullet_rays(world)]
        rounds = [[microseconds(w) if w else math.nan for w in works] for _ in range(ROUNDS)]
        ours, message, engine, bullet = (statistics.median(column) for column in zip(*rounds, strict=True))
        ratio, other = (statistics.median(r[0] / r[at] for r in rounds) for at in (2, 3))
        print(
            f"{name:10s} {ours:10.0f} {message:17.0f} {engine:15.0f} {ratio:6.2f} {bullet:12.0f} {other:6.2f}"
        )


def camera_table() -> None:
    simulation = Simulation(load_robot("kbot").require(), WORLDS["200 walls"])
    try:
        camera = simulation.add_sensor(Camera(link="base_link", pose=POSE, depth=True))
    except KbotError as error:
        print(error)
        return
    camera.draw()
    times = []
    for _ in range(30):
        begun = time.perf_counter()
        camera.draw()
        times.append(1e3 * (time.perf_counter() - begun))
    middle, least = statistics.median(times), min(times)
    print(f"camera 640 x 480, colour and depth, 200 walls: median {middle:.1f} ms, best {least:.1f} ms")


if __name__ == "__main__":
    lidar_table()
    print()
    camera_table()
