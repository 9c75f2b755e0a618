"""What all bridges cost at once, each with a peer in a process of its own, beside the same run alone.

    python benchmarks/bench_bridges.py

Real time at 50 Hz, with a lidar of 360 beams at 10 Hz, in circles that touch nothing; peers hear the robot's
own topics (the one of ROS 1 the clock alone, for a connection of TCPROS is for one topic). Alone, the same
topics are heard within the process, so that simulating and making messages is told apart from what bridges
add. Shares are CPU time of the simulating process over time that passed; memory is what it has more than
alone. A delay is from the publication of /clock to its arrival at a peer, both by this machine's clock; what
the machine takes for as little between two Python processes without KBot, over a plain socket while all that
runs, stands before them. A command's way is from its arrival at the bridge to the first control period that
drives by it. Beside each number stands what is wanted of it.
"""

from __future__ import annotations

import os
import resource
import socket
import statistics
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import kbot
from kbot.bridges.companion_options import CompanionOptions
from kbot.bridges.companions import Companions
from kbot.bridges.link import Link
from kbot.bridges.pacing import run_in_real_time
from kbot.messages import types as msg
from kbot.sensors import Lidar
from kbot.sim import Simulation
from kbot.wire import Feed

REAL_SECONDS = 8.0
WARM_SECONDS = 8.0
WANTED_SHARE, WANTED_MEGABYTES, WANTED_DELAY, PERIOD = 0.06, 100.0, 1e-3, 0.02
HEARD = ("/odom", "/tf", "/joint_states", "/scan")
TELL = """
import sys, time
def tell(nanoseconds):
    sys.stdout.write(f"{nanoseconds} {time.monotonic()}\\n")
    sys.stdout.flush()
"""
"""What each peer does when the clock arrives."""

PEERS = {
    "ros1": """
import socket, struct
from kbot.bridges.ros1.rpc import call
from kbot.bridges.ros1.tcpros import encode_header, read_block, read_header
uri = call(sys.argv[1], "lookupNode", "/peer", "/kbot")
_, host, port = call(uri, "requestTopic", "/peer", "/clock", [["TCPROS"]])
with socket.create_connection((host, port)) as connection:
    connection.sendall(encode_header({"callerid": "/peer", "topic": "/clock", "type": "*", "md5sum": "*"}))
    read_header(connection)
    while True:
        secs, nsecs = struct.unpack("<II", read_block(connection))
        tell(secs * 10**9 + nsecs)
""",
    "foxglove": """
import json, struct
from websockets.sync.client import connect
with connect(sys.argv[1], subprotocols=["foxglove.sdk.v1"]) as connection:
    while True:
        data = connection.recv()
        if isinstance(data, bytes) and data[0] == 2:
            tell(struct.unpack_from("<Q", data, 1)[0])
        elif isinstance(data, str) and (said := json.loads(data))["op"] == "advertise":
            names = ("/odom", "/tf", "/joint_states", "/clock", "/scan")
            wanted = [{"id": c["id"], "channelId": c["id"]} for c in said["channels"] if c["topic"] in names]
            connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
""",
    "rosbridge": """
import json
from websockets.sync.client import connect
with connect(sys.argv[1]) as connection:
    for topic in ("/odom", "/tf", "/joint_states", "/clock", "/scan"):
        connection.send(json.dumps({"op": "subscribe", "topic": topic}))
    while True:
        data = connection.recv()
        if "/clock" in data:
            clock = json.loads(data)["msg"]["clock"]
            tell(clock["secs"] * 10**9 + clock["nsecs"])
""",
    "ros2": """
import os, struct
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.util import duration
from kbot.bridges.ros2.bridge import LOOPBACK, Domain, DomainParticipant, DataReader, DdsTopic, sample_type
number = int(os.environ["ROS_DOMAIN_ID"])
domain = Domain(number, LOOPBACK)
participant = DomainParticipant(number)
names = {
    "clock": "rosgraph_msgs/msg/Clock",
    "odom": "nav_msgs/msg/Odometry",
    "tf": "tf2_msgs/msg/TFMessage",
    "joint_states": "sensor_msgs/msg/JointState",
    "scan": "sensor_msgs/msg/LaserScan",
}
topics = [DdsTopic(participant, f"rt/{name}", sample_type(kind)) for name, kind in names.items()]
readers = [DataReader(participant, topic) for topic in topics]
waiting = WaitSet(participant)
any_new = ViewState.Any | InstanceState.Alive | SampleState.NotRead
for reader in readers:
    waiting.attach(ReadCondition(reader, any_new))
while True:
    waiting.wait(duration(seconds=1))
    for sample in readers[0].take(64):
        sec, nanosec = struct.unpack_from("<iI", sample.encoded, 4)
        tell(sec * 10**9 + nanosec)
    for reader in readers[1:]:
        reader.take(64)
""",
    "zenoh": """
import struct, zenoh
def hear(sample):
    if "/clock/" in str(sample.key_expr):
        sec, nanosec = struct.unpack_from("<iI", sample.payload.to_bytes(), 4)
        tell(sec * 10**9 + nanosec)
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", '["tcp/127.0.0.1:7447"]')
with zenoh.open(config) as session:
    names = ("odom", "tf", "joint_states", "clock", "scan")
    subscribers = [session.declare_subscriber(f"*/{name}/**", hear) for name in names]
    while True:
        time.sleep(1)
""",
}
"""Each is told the address of its bridge, where it has one."""

BARE = """
import contextlib, os, socket, struct, time
server = socket.create_server(("127.0.0.1", 0))
if os.fork() == 0:
    with contextlib.suppress(OSError), socket.create_connection(server.getsockname()) as connection:
        while True:
            time.sleep(0.02)
            connection.sendall(struct.pack("<d", time.monotonic()))
    os._exit(0)
connection, _ = server.accept()
while True:
    (sent,) = struct.unpack("<d", connection.recv(8))
    print(time.monotonic() - sent, flush=True)
"""
"""Prints the seconds that eight bytes take from one process to another, fifty times a second."""


class Run:
    """A simulation with a lidar in real time, and what it cost."""

    def __init__(self, options: CompanionOptions) -> None:
        sim = Simulation(kbot.load("kbot"), "boxes")
        sim.add_sensor(Lidar(link="base_link", name="scan", samples=360, rate=10.0))
        told: list[str] = []
        companions = Companions(options, told.append)
        companions.join(sim, "", "boxes")
        for topic in HEARD:
            sim.bus.subscribe(topic, sim.bus.require(topic), lambda message: None)
        published: dict[int, float] = {}
        sim.bus.subscribe(
            "/clock",
            msg.ClockMessage,
            lambda m: published.__setitem__(m.clock.nanoseconds, time.monotonic()),
        )
        sim.cmd_vel(0.2, 0.6)  # within the boxes: pushing one costs more than driving
        peers = {
            name: subprocess.Popen(
                (sys.executable, "-c", TELL + code, _address(told, name)), stdout=subprocess.PIPE, text=True
            )
            for name, code in PEERS.items()
            if getattr(options, name)
        }
        bare = subprocess.Popen((sys.executable, "-c", BARE), stdout=subprocess.PIPE, text=True)
        run_in_real_time(sim, WARM_SECONDS)
        before = time.process_time()
        run_in_real_time(sim, REAL_SECONDS)
        self.share = (time.process_time() - before) / REAL_SECONDS
        self.megabytes = _resident()
        self.gone = [name for name, peer in peers.items() if peer.poll() is not None]
        for peer in peers.values():
            peer.kill()
        self.delays = {
            name: _delays(peer.communicate()[0].splitlines(), published) for name, peer in peers.items()
        }
        bare.kill()
        self.bare = [float(line) for line in bare.communicate()[0].splitlines()[:-1]]
        companions.close()


def _delays(lines: list[str], published: dict[int, float]) -> list[float]:
    """Seconds each message took, of those that came while it was measured."""
    parts = [line.split() for line in lines if line.count(" ") == 1]
    return [float(at) - published[int(stamp)] for stamp, at in parts if at and int(stamp) in published]


def command_delays() -> list[float]:
    """Simulated seconds from a command's arrival at the link to the step at which the robot obeys."""
    sim = Simulation(kbot.load("kbot"))
    link = Link(lambda text: None)
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
    delays = []
    for number in range(50):
        sim.step(37)
        speed = 0.1 + 0.001 * number
        link.send("/cmd_vel", msg.Twist(msg.Vector3(speed)))
        start = sim.time
        while sim.named().commanded_twist.x != speed:
            sim.step()
        delays.append(sim.time - start)
    return delays


def _address(told: list[str], name: str) -> str:
    words = {"ros1": "ROS 1:", "foxglove": "Foxglove:", "rosbridge": "rosbridge:"}
    return next((line.split()[-1] for line in told if line.startswith(words.get(name, "-"))), "")


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
    alone = Run(CompanionOptions())
    extras = {"ros2": find_spec("cyclonedds") is not None, "zenoh": find_spec("zenoh") is not None}
    together = Run(CompanionOptions(ros1=True, foxglove=True, rosbridge=True, **extras))
    names = {"real time at 50 Hz, alone": alone.share, f"{3 + sum(extras.values())} bridges": together.share}
    for name, share in names.items():
        _say(name, 100 * share, "% of a core", 100 * WANTED_SHARE)
    _say("what the bridges add", 100 * (together.share - alone.share), "% of a core")
    _say("memory for them", together.megabytes - alone.megabytes, "MB", WANTED_MEGABYTES)
    _say("between two processes, without KBot", 1e3 * statistics.median(together.bare), "ms")
    for name, delays in together.delays.items():
        _say(f"publication to receipt, {name}", 1e3 * statistics.median(delays), "ms", 1e3 * WANTED_DELAY)
    _say("command to wheels, at most", 1e3 * max(command_delays()), "ms", 1e3 * PERIOD)
    for name in together.gone:
        print(f"the peer on {name} ended early", file=sys.stderr)


if __name__ == "__main__":
    main()
