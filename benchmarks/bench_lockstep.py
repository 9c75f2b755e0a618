"""Reruns of a trial with a controller in its own process, on a busy computer: are they equal bit for bit?

    python benchmarks/bench_lockstep.py [RERUNS] [SECONDS]

A `kbot.Node` reads a lidar and odometry, and commands a robot at 30 Hz, which does not divide the 50 ticks a
second. Meanwhile, two processes per processor compute. `states` is the number of different end states, which
must be 1. `ms/tick` is the wall-clock time of a tick in the median rerun, for physics, sensors, transport and
controller, and `not busy` that without these processes. `start` is the time until the program is ready.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import kbot
from kbot.extensions import program_runner
from kbot.record.run_outputs import RunOutputs
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.trials import Program

RERUNS, SECONDS = 50, 1.0
TICKS_PER_SECOND = 50
BUSY_PER_PROCESSOR = 2
CONTROLLER = """
import math
import kbot
from kbot.messages import Odometry, Twist, Vector3
from kbot.messages.sensing import LaserScan

node = kbot.Node("controller")
seen = {"free": 1.0, "x": 0.0}

def on_scan(scan):
    seen["free"] = min((float(r) for r in scan.ranges if math.isfinite(r)), default=9.0)

def drive():
    turn = 0.3 * math.sin(10.0 * seen["x"]) + 0.2 / (0.1 + seen["free"])
    node.publish("cmd_vel", Twist(Vector3(min(0.3, 0.4 * seen["free"])), Vector3(0.0, 0.0, turn)))

node.subscribe("scan", LaserScan, on_scan)
node.subscribe("odom", Odometry, lambda odometry: seen.update(x=odometry.pose.pose.position.x))
node.every(1 / 30, drive)
node.spin()
"""


def main(reruns: int, seconds: float) -> int:
    states = set[str]()
    print("| transport | reruns | states | start in s | ms/tick | not busy |")
    print("| --- | --: | --: | --: | --: | --: |")
    with tempfile.TemporaryDirectory() as folder:
        controller = Path(folder) / "controller.py"
        controller.write_text(CONTROLLER)
        for transport in ("local", "ros1", *(["ros2"] if find_spec("cyclonedds") else [])):
            program = Program(str(controller), transport=transport)
            idle = rerun(program, seconds)
            with busy_processors():
                runs = [rerun(program, seconds) for _ in range(reruns)]
            start, run = (statistics.median(run[index] for run in runs) for index in (1, 2))
            tick, idle_tick = (1e3 * time / (TICKS_PER_SECOND * seconds) for time in (run, idle[2]))
            ends = {state for state, _, _ in (idle, *runs)}
            states |= ends
            row = f"| {transport} | {reruns} | {len(ends)} | {start:.2f} | {tick:.2f} | {idle_tick:.2f} |"
            print(row, flush=True)
    print(f"\nNumber of end states over all transports: {len(states)}")
    return 0 if len(states) == 1 else 1


@contextmanager
def busy_processors() -> Iterator[None]:
    count = BUSY_PER_PROCESSOR * (os.cpu_count() or 1)
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def rerun(program: Program, seconds: float) -> tuple[str, float, float]:
    """The digest of the end state, the time until the program was ready, and the time of the run, in s."""
    simulation = Simulation(kbot.load("kbot", lidar=True), "rooms")
    mount_declared(simulation)
    outputs = RunOutputs(lambda text: None, peers=program_runner().open_programs([program], print))
    try:
        begin = time.perf_counter()
        outputs.join(simulation, "", "rooms")
        ready = time.perf_counter()
        simulation.run(seconds)
        end = time.perf_counter()
    finally:
        outputs.close()
    return simulation.state_sha256(), ready - begin, end - ready


if __name__ == "__main__":
    reruns = int(sys.argv[1]) if len(sys.argv) > 1 else RERUNS
    sys.exit(main(reruns, float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS))
