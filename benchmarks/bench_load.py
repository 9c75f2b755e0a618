"""Cost of many robots, many boxes and a long run, compared with one robot on an empty floor, and of reading
large files, compared with plain parsers.

    python benchmarks/bench_load.py [--hours 1]

The time per step is a multiple of that of one robot on a plane. All robots drive. For the long run, the
benchmark measures the memory (resident set) after a minute and at the end, and the final odometry error.

A URDF of 9,000 links is read and checked as multiples of the time that expat takes to parse it. A map of 49
million pixels is read as a multiple of the time that PIL takes to decode its image.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import product
from math import hypot
from pathlib import Path
from statistics import median
from xml.etree import ElementTree

import numpy as np
from PIL import Image

import kbot
from kbot.checks import check_file
from kbot.cli.progress import loading
from kbot.model.load import load_robot
from kbot.world import Body, Box, Part, World
from kbot.world.builders import at, floor
from kbot.world.occupancy_files import read_map
from kbot.xacro import clear_cache

SECONDS = 1.0
REPEATS = 7


def one_robot() -> kbot.Simulation:
    return kbot.Simulation("kbot")


def hundred_robots() -> kbot.Simulation:
    """100 robots in ten rows, 1 m apart."""
    sim = kbot.Simulation("kbot")
    for row, column in product(range(10), range(10)):
        if row or column:
            sim.models.spawn_model(sim.robot, f"r{row}{column}", float(row), float(column))
    return sim


def thousand_boxes() -> kbot.Simulation:
    """1,000 static crates of 0.2 m on a grid of 0.8 m around the robot."""
    places = [(x, y) for x, y in product(range(-16, 17), range(-16, 17)) if (x, y) != (0, 0)][:1000]
    crate = (Part(Box((0.2, 0.2, 0.2))),)
    bodies = [Body(f"b{i}", crate, at(0.8 * x, 0.8 * y, 0.1)) for i, (x, y) in enumerate(places)]
    return kbot.Simulation("kbot", world=World("crates", (floor(), *bodies)))


def share(sim: kbot.Simulation, base: kbot.Simulation) -> float:
    """The time of a step as a multiple of the base's, measured in turn."""
    for each in (sim, base):
        for robot in each.robots.values():
            robot.cmd_vel(0.2, 1.0)
        each.run(0.5)
    return median(timed(sim) / timed(base) for _ in range(REPEATS))


def timed(sim: kbot.Simulation) -> float:
    start = time.perf_counter()
    sim.run(SECONDS)
    return time.perf_counter() - start


def resident() -> float:
    """Resident memory of this process in MB; 0 if the system does not report it."""
    status = Path("/proc/self/status")
    if not status.exists():
        return 0.0
    line = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


def long_run(hours: float) -> str:
    """Drive in curves, and read odometry and joint states 50 times a second."""
    sim = one_robot()
    count = round(hours * 3600 / 0.02)
    after_a_minute = 0.0
    for index in range(count):
        if index % 500 == 0:
            sim.cmd_vel(0.2, 0.5 if index % 1000 else -0.5)
        sim.run(0.02)
        sim.odometry, sim.joint_states  # noqa: B018 - computed as a robot's driver would
        if index == 3000:
            after_a_minute = resident()
    truth, odometry = sim.ground_truth.pose, sim.odometry.pose
    error = 1e3 * hypot(truth.x - odometry.x, truth.y - odometry.y)
    memory = f"memory {after_a_minute:.1f} MB after a minute, {resident():.1f} MB at the end"
    return f"{sim.time / 3600:g} h driven: {memory}; odometry error {error:.1f} mm"


def large_urdf(path: Path) -> None:
    """A file as a CAD exporter writes it: fixed joints have an axis and limits too."""
    shape = '<geometry><box size="0.1 0.2 0.3"/></geometry>'
    body = (
        '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
        f"</inertial><visual>{shape}</visual><collision>{shape}</collision>"
    )
    links = (f'<link name="l{i}">{body}</link>' for i in range(9000))
    limit = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="9" velocity="1"/>'
    joints = (
        f'<joint name="j{i}" type="{"fixed" if i % 2 else "revolute"}"><origin xyz="0 0 1"/>'
        f'<parent link="l{(i - 1) // 3}"/><child link="l{i}"/>{limit}</joint>'
        for i in range(1, 9000)
    )
    path.write_text("\n".join(['<robot name="large">', *links, *joints, "</robot>"]), "utf-8")


def large_map(path: Path) -> None:
    """A building of rooms 9 m wide, in an image beside `path`."""
    pixels = np.full((7000, 7000), 254, np.uint8)
    for wall in range(0, 7000, 180):
        pixels[wall : wall + 4] = pixels[:, wall : wall + 4] = 0
    Image.fromarray(pixels).save(path.with_suffix(".pgm"))
    path.write_text(f"image: {path.stem}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n", "utf-8")


def reading(folder: Path) -> Iterator[tuple[str, float]]:
    """What is read, and its processor time as a multiple of that of a plain parser."""
    urdf, plan = folder / "large.urdf", folder / "large.yaml"
    large_urdf(urdf)
    large_map(plan)

    def read() -> object:
        clear_cache()
        with loading(urdf.name):
            return load_robot(urdf)

    def check() -> object:
        clear_cache()
        return check_file(str(urdf))

    def decode() -> object:
        with Image.open(plan.with_suffix(".pgm")) as image:
            return np.array(image)

    parsing, loaded, checked = best(lambda: ElementTree.parse(urdf), read, check)
    yield "read 9,000 links / expat", loaded / parsing
    yield "check 9,000 links / expat", checked / parsing
    decoding, map_read = best(decode, lambda: read_map(plan))
    yield "read a map of 7,000² / PIL", map_read / decoding


def best(*functions: Callable[[], object]) -> list[float]:
    """The minimum processor time of each function in seconds, measured in turn."""
    times = [[processor_time(function) for function in functions] for _ in range(3)]
    return [min(column) for column in zip(*times, strict=True)]


def processor_time(function: Callable[[], object]) -> float:
    start = time.process_time()
    function()
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours", type=float, default=1.0, help="simulated hours of the long run")
    hours = parser.parse_args().hours
    print(f"{'one robot on the plane':32}{1.0:8.2f}")
    for name, make in (("100 robots in one world", hundred_robots), ("1,000 static boxes", thousand_boxes)):
        print(f"{name:32}{share(make(), one_robot()):8.2f}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, ratio in reading(Path(folder)):
            print(f"{name:32}{ratio:8.2f}", flush=True)
    print(long_run(hours))


if __name__ == "__main__":
    main()
