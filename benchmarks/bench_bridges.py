"""What all bridges cost at once, each with a peer in a process of its own, beside the same run alone.

    python benchmarks/bench_bridges.py

Real time at 50 Hz, with a lidar of 360 beams at 10 Hz; peers hear the robot's own topics. Alone, the same
topics are heard within the process, so that simulating and making messages is told apart from what bridges
add. Shares are CPU time of the simulating process over time that passed; memory is what it has more than
alone. A delay is from a message's publication to its arrival at a peer, both by this machine's clock. A
command's way is from its arrival at the bridge to the first control period that drives by it.
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
from kbot.bridges.companions import Companions
from kbot.bridges.link import Link
from kbot.bridges.pacing import run_in_real_time
from kbot.bridges.wishes import Wishes
from kbot.messages import types as msg
from kbot.sensors import Lidar
from kbot.sim import Simulation
from kbot.wire import Feed

REAL_SECONDS = 8.0
WARM_SECONDS = 8.0
HEARD = ("/odom", "/tf", "/joint_states", "/scan")
PEERS = {
    "ros1": """
import socket, struct, sys, time
from kbot.bridges.ros1.rpc import call
from kbot.bridges.ros1.tcpros import encode_header, read_block, read_header
uri = call(sys.argv[1], "lookupNode", "/peer", "/kbot")
_, host, port = call(uri, "requestTopic", "/peer", "/clock", [["TCPROS"]])
with socket.create_connection((host, port)) as connection:
    connection.sendall(encode_header({"callerid": "/peer", "topic": "/clock", "type": "*", "md5sum": "*"}))
    read_header(connection)
    while True:
        secs, nsecs = struct.unpack("<II", read_block(connection))
        sys.stdout.write(f"{secs * 10**9 + nsecs} {time.monotonic()}\\n")
        sys.stdout.flush()
""",
    "foxglove": """
import json, sys
from websockets.sync.client import connect
with connect(sys.argv[1], subprotocols=["foxglove.sdk.v1"]) as connection:
    while True:
        data = connection.recv()
        if isinstance(data, str) and (said := json.loads(data))["op"] == "advertise":
            names = ("/odom", "/tf", "/joint_states", "/clock", "/scan")
            wanted = [{"id": c["id"], "channelId": c["id"]} for c in said["channels"] if c["topic"] in names]
            connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
""",
    "rosbridge": """
import json, sys
from websockets.sync.client import connect
with connect(sys.argv[1]) as connection:
    for topic in ("/odom", "/tf", "/joint_states", "/clock", "/scan"):
        connection.send(json.dumps({"op": "subscribe", "topic": topic}))
    while True:
        connection.recv()
""",
    "ros2": """
import os, time
from kbot.bridges.ros2.bridge import LOOPBACK, Domain, DomainParticipant, DataReader, DdsTopic, sample_type
number = int(os.environ["ROS_DOMAIN_ID"])
domain = Domain(number, LOOPBACK)
participant = DomainParticipant(number)
names = {
    "odom": "nav_msgs/msg/Odometry",
    "clock": "rosgraph_msgs/msg/Clock",
    "tf": "tf2_msgs/msg/TFMessage",
    "joint_states": "sensor_msgs/msg/JointState",
    "scan": "sensor_msgs/msg/LaserScan",
}
topics = [DdsTopic(participant, f"rt/{name}", sample_type(kind)) for name, kind in names.items()]
readers = [DataReader(participant, topic) for topic in topics]
while True:
    for reader in readers:
        reader.take(64)
    time.sleep(0.02)
""",
    "zenoh": """
import sys, time, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", '["tcp/127.0.0.1:7447"]')
with zenoh.open(config) as session:
    names = ("odom", "tf", "joint_states", "clock", "scan")
    subscribers = [session.declare_subscriber(f"*/{name}/**", lambda sample: None) for name in names]
    while True:
        time.sleep(1)
""",
}


class Run:
    """A simulation with a lidar in real time, and what it cost."""

    def __init__(self, wishes: Wishes) -> None:
        sim = Simulation(kbot.load("kbot"), "boxes")
        sim.add_sensor(Lidar(link="base_link", name="scan", samples=360, rate=10.0))
        told: list[str] = []
        companions = Companions(wishes, told.append)
        companions.join(sim, "", "boxes")
        for topic in HEARD:
            sim.bus.subscribe(topic, sim.bus.require(topic), lambda message: None)
        published: dict[int, float] = {}
        sim.bus.subscribe(
            "/clock",
            msg.ClockMessage,
            lambda m: published.__setitem__(m.clock.nanoseconds, time.monotonic()),
        )
        sim.cmd_vel(0.2, 0.3)
        peers = {
            name: subprocess.Popen(
                (sys.executable, "-c", code, _address(told, name)), stdout=subprocess.PIPE, text=True
            )
            for name, code in PEERS.items()
            if getattr(wishes, name)
        }
        run_in_real_time(sim, WARM_SECONDS)
        before = time.process_time()
        run_in_real_time(sim, REAL_SECONDS)
        self.share = (time.process_time() - before) / REAL_SECONDS
        self.megabytes = _resident()
        self.gone = [name for name, peer in peers.items() if peer.poll() is not None]
        for peer in peers.values():
            peer.kill()
        self.delays = [
            float(at) - published[int(stamp)]
            for line in (peers["ros1"].communicate()[0].splitlines() if "ros1" in peers else [])
            for stamp, _, at in (line.partition(" "),)
            if at and int(stamp) in published
        ]
        for peer in peers.values():
            peer.wait()
        companions.close()


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
        while sim.named().controller.wanted[0] != speed:
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


def main() -> None:
    os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{_free_port()}/"
    os.environ["ROS_DOMAIN_ID"] = "87"
    alone = Run(Wishes())
    extras = {"ros2": find_spec("cyclonedds") is not None, "zenoh": find_spec("zenoh") is not None}
    together = Run(Wishes(ros1=True, foxglove=True, rosbridge=True, **extras))
    commands = command_delays()
    delay = statistics.median(together.delays)
    count = 3 + sum(extras.values())
    print(f"{'real time at 50 Hz, alone':34} {100 * alone.share:8.2f} % of a core")
    print(f"{f'{count} bridges, a peer on each':34} {100 * together.share:8.2f} % of a core")
    print(f"{'what the bridges add':34} {100 * (together.share - alone.share):8.2f} % of a core")
    print(f"{'memory for them':34} {together.megabytes - alone.megabytes:8.1f} MB")
    print(f"{'publication to receipt, ROS 1':34} {1e3 * delay:8.2f} ms at the median")
    print(f"{'command to wheels':34} {1e3 * max(commands):8.2f} ms at most (a control period is 20)")
    for name in together.gone:
        print(f"the peer on {name} ended early", file=sys.stderr)


if __name__ == "__main__":
    main()
