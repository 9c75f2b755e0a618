"""CPU time, memory and delay of all bridges at once, compared with their libraries alone.

    python benchmarks/bench_bridges.py

KBot runs in real time at 50 Hz, with a lidar of 360 beams at 10 Hz, and drives in circles without contacts.
Each bridge has one peer in its own process, which subscribes to the robot's topics. The ROS 1 peer subscribes
only to /clock, because a TCPROS connection carries one topic. Without bridges, the same topics are subscribed
to inside the process, so that the difference is what the bridges add. CPU time is that of the simulating
process, as a share of one core. Memory is the increase over the run without bridges. The delay is the median
time from publishing /clock to its arrival at a peer, measured with this machine's clock, with one bridge
alone and with all at once. "Libraries alone" is a process that sends the same messages to the same peers with
only the underlying libraries (rosbags, orjson, cyclonedds, zenoh, websockets, asyncio). It shows which part
of a figure KBot cannot avoid. The command delay is the simulated time from a command's arrival at the bridge
to the first control period that uses it. The target of each figure is beside it.
"""

from __future__ import annotations

import json
import os
import pickle
import resource
import socket
import statistics
import subprocess
import sys
import time
from collections import deque
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import IO, cast

import kbot
from kbot.messages import types as msg
from kbot.record.feed import Feed, Packet
from kbot.record.run_outputs import RunOutputs
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.ros1.rpc import call
from kbot.ros.peer_options import PeerOptions
from kbot.sensors import Lidar
from kbot.sim import Simulation
from kbot.sim.real_time import run_in_real_time

HERE = Path(__file__).parent
REAL_SECONDS = WARM_SECONDS = 8.0
TARGET_SHARE, TARGET_MEGABYTES, TARGET_DELAY, PERIOD = 0.06, 100.0, 1e-3, 0.02
BRIDGES = ("ros1", "ros2", "zenoh", "foxglove", "rosbridge")
MESSAGES_PER_PERIOD = {"/clock": 1, "/joint_states": 1, "/odom": 1, "/tf": 2, "/scan": 1}
"""Messages that the robot publishes on each topic in one period."""

Delays = dict[str, list[float]]
"""Seconds by bridge."""


class Run:
    """A simulation with a lidar in real time, and its cost with these bridges."""

    def __init__(self, bridges: Sequence[str]) -> None:
        sim = Simulation(kbot.load("kbot"), "boxes")
        sim.add_sensor(Lidar(link="base_link", name="scan", samples=360, rate=10.0))
        reports: list[str] = []
        peers = PeerOptions(tuple(bridges)).open(reports.append) if bridges else None
        outputs = RunOutputs(reports.append, peers=peers)
        outputs.join(sim, "", "boxes")
        self.newest = {topic: deque[object](maxlen=count) for topic, count in MESSAGES_PER_PERIOD.items()}
        """The newest messages of each topic."""
        for topic, newest in self.newest.items():
            sim.bus.subscribe(topic, sim.bus.require(topic), newest.append)
        published: dict[int, float] = {}
        sim.bus.subscribe(
            "/clock",
            msg.ClockMessage,
            lambda m: published.__setitem__(m.clock.nanoseconds, time.monotonic()),
        )
        sim.cmd_vel(0.2, 0.6)  # between the boxes: pushing one costs more than driving
        run_in_real_time(sim, 1.0)  # the bridges are open after this time
        peers = {name: _start_peer(name, _address(reports, name)) for name in bridges}
        run_in_real_time(sim, WARM_SECONDS)
        published.clear()
        before = time.process_time()
        run_in_real_time(sim, REAL_SECONDS)
        self.share = (time.process_time() - before) / REAL_SECONDS
        self.megabytes = _resident()
        self.delays = _end_peers(peers, published)
        outputs.close()

    def period_messages(self) -> list[tuple[str, str, bytes, str]]:
        """The messages of one period: topic, type, CDR and JSON of each."""
        packets = [Packet(topic, message, 0) for topic, newest in self.newest.items() for message in newest]
        return [(p.topic, p.type_name, p.cdr, p.json(ros1=True)) for p in packets]


def libraries_alone(run: Run) -> tuple[float, Delays]:
    """The share of a core that the same messages take with the libraries alone, and their delays."""
    command = (sys.executable, str(HERE / "bare_bridges.py"), str(WARM_SECONDS), str(REAL_SECONDS))
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as bare:
        to_process, from_process = cast("IO[bytes]", bare.stdin), cast("IO[bytes]", bare.stdout)
        pickle.dump(run.period_messages(), to_process)
        to_process.flush()
        addresses = json.loads(from_process.readline())
        peers = {name: _start_peer(name, addresses.get(name, "")) for name in run.delays}
        share, periods = json.loads(from_process.readline())
        delays = _end_peers(peers, {int(stamp): at for stamp, at in periods})
        bare.kill()
    return share, delays


def _start_peer(name: str, address: str) -> subprocess.Popen[str]:
    command = (sys.executable, str(HERE / "bridge_peers.py"), name, address)
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def _end_peers(peers: dict[str, subprocess.Popen[str]], published: dict[int, float]) -> Delays:
    """The delays of the messages that arrived during the measurement."""
    for name, peer in peers.items():
        if peer.poll() is not None:
            print(f"the peer on {name} ended early", file=sys.stderr)
        peer.kill()
    received = {name: peer.communicate()[0].splitlines()[:-1] for name, peer in peers.items()}
    parts = {name: [line.split() for line in lines] for name, lines in received.items()}
    return {
        name: [float(at) - published[int(stamp)] for stamp, at in lines if int(stamp) in published]
        for name, lines in parts.items()
    }


def command_delays() -> list[float]:
    """Simulated seconds from a command's arrival at the link to the step in which it takes effect."""
    sim = Simulation(kbot.load("kbot"))
    link = PeerLink(lambda text: None)
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
    delays = []
    for number in range(50):
        sim.step(37)
        speed = 0.1 + 0.001 * number
        link.send("/cmd_vel", msg.Twist(msg.Vector3(speed)))
        start = sim.time
        while sim.robots.first.commanded_twist.x != speed:
            sim.step()
        delays.append(sim.time - start)
    return delays


def _address(reports: list[str], name: str) -> str:
    """The address of a bridge, from its report. For ROS 1, the address of the publisher of /clock."""
    words = {"ros1": "ROS 1:", "foxglove": "Foxglove:", "rosbridge": "rosbridge:"}
    address = next((line.split()[-1] for line in reports if line.startswith(words.get(name, "-"))), "")
    if name != "ros1":
        return address
    node = call(address, "lookupNode", "/peer", "/kbot")
    _, host, port = call(node, "requestTopic", "/peer", "/clock", [["TCPROS"]])
    return f"{host}:{port}"


def _resident() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])


def _print_row(name: str, value: float, unit: str, target: float | None = None) -> None:
    print(f"{name:35} {value:8.2f} {unit:12}" + (f" (target: {target:g})" if target else ""))


def main() -> None:
    os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{_free_port()}/"
    os.environ["ROS_DOMAIN_ID"] = "87"
    missing = {"ros2": "cyclonedds", "zenoh": "zenoh"}
    bridges = [name for name in BRIDGES if name not in missing or find_spec(missing[name])]
    without = Run(())
    together = Run(bridges)
    share, floor = libraries_alone(together)
    _print_row("real time at 50 Hz, without bridges", 100 * without.share, "% of a core")
    _print_row(f"with {len(bridges)} bridges", 100 * together.share, "% of a core", 100 * TARGET_SHARE)
    _print_row("added by the bridges", 100 * (together.share - without.share), "% of a core")
    _print_row("their libraries alone", 100 * share, "% of a core")
    _print_row("memory for the bridges", together.megabytes - without.megabytes, "MB", TARGET_MEGABYTES)
    _print_row("command to wheels, maximum", 1e3 * max(command_delays()), "ms", 1e3 * PERIOD)
    print(f"\n{'publishing to receipt, ms':28} alone  all at once  libraries alone, all at once")
    for name in bridges:
        runs = (Run((name,)).delays, together.delays, floor)
        alone, all_at_once, bare = (1e3 * statistics.median(delays[name]) for delays in runs)
        figures = f"{alone:5.2f} {all_at_once:12.2f} {bare:16.2f}"
        print(f"{name:28} {figures:47} (target: {1e3 * TARGET_DELAY:g})")


if __name__ == "__main__":
    main()
