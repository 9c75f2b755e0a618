"""Cost of recording a simulation, compared with the same run without recording.

    python benchmarks/bench_record.py

Rates are compared with encoding the same messages with the rosbags library alone. Shares are CPU time over
simulated time, at 50 Hz in real time with a lidar of 360 beams at 10 Hz.
"""

from __future__ import annotations

import itertools
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import kbot
from kbot.messages import types as msg
from kbot.messages.sensing import LaserScan
from kbot.record import open_writer
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import ros2_types
from kbot.record.feed import Packet
from kbot.record.record_options import RecordOptions
from kbot.record.run_outputs import RunOutputs
from kbot.sensors import Lidar
from kbot.sim import Simulation
from kbot.sim.real_time import run_in_real_time

STAMP = msg.Header(msg.Time(1, 2), "odom")
MESSAGES = {
    "/odom": msg.Odometry(STAMP, "base_footprint"),
    "/joint_states": msg.JointState(STAMP, ("left_wheel_joint", "right_wheel_joint"), (1.0, 2.0), (3.0, 4.0)),
    "/tf": msg.TFMessage((msg.TransformStamped(STAMP, "base_footprint"),)),
    "/clock": msg.ClockMessage(),
}
COUNT = 4000
ROUNDS = 5
REAL_SECONDS = 8.0


def median_rate(work: Callable[[], None]) -> float:
    """Messages per second, the median of several rounds after a warm-up."""
    work()
    times = []
    for _ in range(ROUNDS):
        before = time.perf_counter()
        work()
        times.append(time.perf_counter() - before)
    return COUNT / statistics.median(times)


def peer_rate() -> float:
    """The rate of rosbags alone: it encodes its own objects as CDR and writes no file."""
    store = ros2_types()
    packets = [Packet(topic, message, 0) for topic, message in MESSAGES.items()]
    ready = [(store.deserialize_cdr(p.cdr, p.type_name), ros_name(type(p.message))) for p in packets]

    def work() -> None:
        for message, name in itertools.islice(itertools.cycle(ready), COUNT):
            store.serialize_cdr(message, name)

    return median_rate(work)


def recording_rate(folder: Path, name: str) -> float:
    numbers = itertools.count()

    def work() -> None:
        writer = open_writer(str(folder / f"{next(numbers)}{name}"))
        for number, (topic, message) in zip(range(COUNT), itertools.cycle(MESSAGES.items()), strict=False):
            writer.write(Packet(topic, message, number * 50_000))
        writer.close()

    return median_rate(work)


def share(record: RecordOptions) -> float:
    """CPU time of this process over simulated time."""
    sim = Simulation(kbot.load("kbot"), "boxes")
    sim.add_sensor(Lidar(link="base_link", name="scan", samples=360, rate=10.0))
    sim.bus.subscribe("/scan", LaserScan, lambda scan: None)
    outputs = RunOutputs(print, record)
    outputs.join(sim, "", "boxes")
    sim.cmd_vel(0.2, 0.3)
    run_in_real_time(sim, 1.0)
    before = time.process_time()
    run_in_real_time(sim, REAL_SECONDS)
    used = time.process_time() - before
    outputs.close()
    return used / REAL_SECONDS


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        peer = peer_rate()
        print(f"{'encoded by rosbags alone':32} {peer:8.0f} messages/s")
        for kind in ("run.mcap", "run.bag", "run"):
            rate = recording_rate(folder, kind)
            what = {"run.mcap": "MCAP", "run.bag": "ROS 1 bag", "run": "rosbag2"}[kind]
            print(f"{'recorded as ' + what:32} {rate:8.0f} messages/s   {rate / peer:.2f} of rosbags")
        alone = share(RecordOptions())
        recorded = share(RecordOptions(str(folder / "live.mcap")))
    print(f"{'real time at 50 Hz, not recorded':32} {100 * alone:8.2f} % of a core")
    print(f"{'real time at 50 Hz, recorded':32} {100 * recorded:8.2f} % of a core")


if __name__ == "__main__":
    main()
