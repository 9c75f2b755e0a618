"""What all bridges cost at once, each with a peer in a process of its own, beside their libraries alone.

    python benchmarks/bench_bridges.py

Real time at 50 Hz, with a lidar of 360 beams at 10 Hz, in circles that touch nothing; peers hear the robot's
own topics (the one of ROS 1 the clock alone, for a connection of TCPROS is for one topic). Without bridges,
the same topics are heard within the process, so that simulating and making messages is told apart from what
bridges add. Shares are CPU time of the simulating process over time that passed; memory is what it has more
than without bridges. A delay is from the publication of /clock to its arrival at a peer, both by this
machine's clock, at the median: with one bridge and its peer alone, and with all at once. The libraries alone
are a process that says the same messages to the same peers, all at once, with what bridges can be made of
(rosbags, orjson, cyclonedds, zenoh, websockets, asyncio) and nothing else: how much of a figure is theirs,
the peers' and the machine's. A command's way is from its arrival at the bridge to the first control period
that drives by it. Beside each number stands what is wanted of it.
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
WANTED_SHARE, WANTED_MEGABYTES, WANTED_DELAY, PERIOD = 0.06, 100.0, 1e-3, 0.02
BRIDGES = ("ros1", "ros2", "zenoh", "foxglove", "rosbridge")
OF_A_MOMENT = {"/clock": 1, "/joint_states": 1, "/odom": 1, "/tf": 2, "/scan": 1}
"""How many messages the robot says on each topic at one moment."""

Delays = dict[str, list[float]]
"""Seconds by the bridge's name."""


class Run:
    """A simulation with a lidar in real time, and what it cost with these bridges."""

    def __init__(self, bridges: Sequence[str]) -> None:
        sim = Simulation(kbot.load("kbot"), "boxes")
        sim.add_sensor(Lidar(link="base_link", name="scan", samples=360, rate=10.0))
        told: list[str] = []
        peers = PeerOptions(tuple(bridges)).open(told.append) if bridges else None
        outputs = RunOutputs(told.append, peers=peers)
        outputs.join(sim, "", "boxes")
        self.said = {topic: deque[object](maxlen=count) for topic, count in OF_A_MOMENT.items()}
        """The newest messages of each topic."""
        for topic, newest in self.said.items():
            sim.bus.subscribe(topic, sim.bus.require(topic), newest.append)
        published: dict[int, float] = {}
        sim.bus.subscribe(
            "/clock",
            msg.ClockMessage,
            lambda m: published.__setitem__(m.clock.nanoseconds, time.monotonic()),
        )
        sim.cmd_vel(0.2, 0.6)  # within the boxes: pushing one costs more than driving
        run_in_real_time(sim, 1.0)  # by then the bridges are there
        peers = {name: _start_peer(name, _address(told, name)) for name in bridges}
        run_in_real_time(sim, WARM_SECONDS)
        published.clear()
        before = time.process_time()
        run_in_real_time(sim, REAL_SECONDS)
        self.share = (time.process_time() - before) / REAL_SECONDS
        self.megabytes = _resident()
        self.delays = _end_peers(peers, published)
        outputs.close()

    def moment(self) -> list[tuple[str, str, bytes, str]]:
        """Each message of a moment: its topic, its type, its CDR and its JSON."""
        packets = [Packet(topic, message, 0) for topic, newest in self.said.items() for message in newest]
        return [(p.topic, p.type_name, p.cdr, p.json(ros1=True)) for p in packets]


def libraries_alone(run: Run) -> tuple[float, Delays]:
    """What share of a core the same messages take with nothing but the libraries, and their delays."""
    command = (sys.executable, str(HERE / "bare_bridges.py"), str(WARM_SECONDS), str(REAL_SECONDS))
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as bare:
        told, heard = cast("IO[bytes]", bare.stdin), cast("IO[bytes]", bare.stdout)
        pickle.dump(run.moment(), told)
        told.flush()
        addresses = json.loads(heard.readline())
        peers = {name: _start_peer(name, addresses.get(name, "")) for name in run.delays}
        share, moments = json.loads(heard.readline())
        delays = _end_peers(peers, {int(stamp): at for stamp, at in moments})
        bare.kill()
    return share, delays


def _start_peer(name: str, address: str) -> subprocess.Popen[str]:
    command = (sys.executable, str(HERE / "bridge_peers.py"), name, address)
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def _end_peers(peers: dict[str, subprocess.Popen[str]], published: dict[int, float]) -> Delays:
    """What each message took, of those that came while it was measured."""
    for name, peer in peers.items():
        if peer.poll() is not None:
            print(f"the peer on {name} ended early", file=sys.stderr)
        peer.kill()
    heard = {name: peer.communicate()[0].splitlines()[:-1] for name, peer in peers.items()}
    parts = {name: [line.split() for line in lines] for name, lines in heard.items()}
    return {
        name: [float(at) - published[int(stamp)] for stamp, at in lines if int(stamp) in published]
        for name, lines in parts.items()
    }


def command_delays() -> list[float]:
    """Simulated seconds from a command's arrival at the link to the step at which the robot obeys."""
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


def _address(told: list[str], name: str) -> str:
    """Where a bridge is, of what it told; on ROS 1 where it says the time."""
    words = {"ros1": "ROS 1:", "foxglove": "Foxglove:", "rosbridge": "rosbridge:"}
    address = next((line.split()[-1] for line in told if line.startswith(words.get(name, "-"))), "")
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


def _say(name: str, value: float, unit: str, wanted: float | None = None) -> None:
    print(f"{name:35} {value:8.2f} {unit:12}" + (f" (wanted: {wanted:g})" if wanted else ""))


def main() -> None:
    os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{_free_port()}/"
    os.environ["ROS_DOMAIN_ID"] = "87"
    missing = {"ros2": "cyclonedds", "zenoh": "zenoh"}
    bridges = [name for name in BRIDGES if name not in missing or find_spec(missing[name])]
    without = Run(())
    together = Run(bridges)
    share, floor = libraries_alone(together)
    _say("real time at 50 Hz, without bridges", 100 * without.share, "% of a core")
    _say(f"with {len(bridges)} bridges", 100 * together.share, "% of a core", 100 * WANTED_SHARE)
    _say("what the bridges add", 100 * (together.share - without.share), "% of a core")
    _say("their libraries alone", 100 * share, "% of a core")
    _say("memory for the bridges", together.megabytes - without.megabytes, "MB", WANTED_MEGABYTES)
    _say("command to wheels, at most", 1e3 * max(command_delays()), "ms", 1e3 * PERIOD)
    print(f"\n{'publication to receipt, ms':28} alone  all at once  libraries alone, all at once")
    for name in bridges:
        runs = (Run((name,)).delays, together.delays, floor)
        alone, all_at_once, bare = (1e3 * statistics.median(delays[name]) for delays in runs)
        figures = f"{alone:5.2f} {all_at_once:12.2f} {bare:16.2f}"
        print(f"{name:28} {figures:47} (wanted: {1e3 * WANTED_DELAY:g})")


if __name__ == "__main__":
    main()
