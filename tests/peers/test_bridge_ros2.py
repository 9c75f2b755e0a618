"""A simulated KBot as a ROS 2 node, with the rclpy of ROS 2 Jazzy and of Kilted as peers, on two machines.

The machines are network namespaces of Linux, so that nothing reaches a real network.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from kbot.messages import TFMessage
from kbot.record.encodings.serialization import decode_cdr
from kbot.ros.bridges.ros2.domain import CYCLONE_HINT

from .conftest import ros2_python

PEER, CYCLONE_PEER = (Path(__file__).with_name(name) for name in ("ros2_peer.py", "cyclone_peer.py"))
DISTRIBUTIONS = pytest.mark.parametrize("distribution", ["jazzy", "kilted"])
RANGES = pytest.mark.parametrize("range_", ["", "LOCALHOST"])
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
DOMAIN = "41"
OWN, OTHER = "10.77.0.1", "10.77.0.2"
"""The addresses of the machine with KBot and of the other one."""
MULTICAST_GROUP = "0100FFEF"
"""239.255.0.1, where DDS participants find each other, as /proc/net/igmp writes it."""
LIMIT_SECONDS = 30.0
"""After which a peer gives up. Most finish within 3 s."""
SILENT_SECONDS = 4.0
"""For which a peer that must find nothing searches. Fast DDS announces itself 5 times in the first second."""


class Machine:
    """A network namespace with an address."""

    def __init__(self, name: str) -> None:
        self.name = name

    def command(self, *words: str) -> list[str]:
        return ["ip", "netns", "exec", self.name, *words]

    def environment(self, variables: Mapping[str, str]) -> dict[str, str]:
        own = {key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "PYTHON"))}
        return {**own, "ROS_DOMAIN_ID": DOMAIN, **variables}

    def run(self, *words: str, variables: Mapping[str, str] | None = None, seconds: float = 60.0) -> str:
        done = subprocess.run(
            self.command(*words),
            env=self.environment(variables or {}),
            capture_output=True,
            text=True,
            timeout=seconds + LIMIT_SECONDS,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout


def ip(*words: str) -> None:
    subprocess.run(("ip", *words), check=True, capture_output=True, text=True, timeout=30)


@pytest.fixture(scope="module")
def machines() -> Iterator[tuple[Machine, Machine]]:
    """This machine and another one, joined by a cable."""
    if shutil.which("ip") is None:
        pytest.skip("the program ip is not installed (make test-peers installs it)")
    own, other = (Machine(f"kbot{os.getpid()}{letter}") for letter in "ab")
    try:
        try:
            for machine in (own, other):
                ip("netns", "add", machine.name)
        except subprocess.CalledProcessError as error:
            pytest.skip(f"network namespaces need root on Linux: {error.stderr.strip()}")
        ip(
            "link",
            "add",
            "cable",
            "netns",
            own.name,
            "type",
            "veth",
            "peer",
            "name",
            "cable",
            "netns",
            other.name,
        )
        for machine, address in ((own, OWN), (other, OTHER)):
            ip("-n", machine.name, "address", "add", f"{address}/24", "dev", "cable")
            for interface in ("lo", "cable"):
                ip("-n", machine.name, "link", "set", interface, "up")
            ip("-n", machine.name, "route", "add", "default", "dev", "cable")  # multicast needs a route
        yield own, other
    finally:
        for machine in (own, other):
            subprocess.run(("ip", "netns", "delete", machine.name), capture_output=True, check=False)


@contextmanager
def kbot(machine: Machine, *options: str) -> Iterator[str]:
    """A KBot that simulates until the end. Yields the line that it prints when the bridge starts."""
    process = subprocess.Popen(
        machine.command(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros2", *options),
        env={**machine.environment({}), "PYTHONPATH": os.environ.get("PYTHONPATH", "")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        yield process.stderr.readline()
        assert process.poll() is None
    finally:
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert "Traceback" not in errors
    assert "invalid type object" not in errors


@pytest.fixture(scope="module")
def local(machines: tuple[Machine, Machine]) -> Iterator[str]:
    with kbot(machines[0]) as line:
        yield line


def find(machine: Machine, distribution: str, range_: str = "", *, static_peer: str = "") -> dict:
    """What a peer finds until it has found everything."""
    variables = {name: value for name, value in ((RANGE, range_), ("ROS_STATIC_PEERS", static_peer)) if value}
    seconds = str(LIMIT_SECONDS)
    python = ros2_python(distribution)
    return json.loads(machine.run(python, str(PEER), seconds, variables=variables))


def find_cyclone(machine: Machine, config: str, seconds: float) -> list[str]:
    """The topics of KBot that a peer with Cyclone DDS finds."""
    variables = {"CYCLONEDDS_URI": config} if config else {}
    words = (sys.executable, str(CYCLONE_PEER), DOMAIN, str(seconds))
    return json.loads(machine.run(*words, variables=variables))


def require_everything(found: dict) -> None:
    """The peer has found the node with its topics and types, received messages, and driven the robot."""
    assert "/kbot" in found["nodes"]
    by_kbot = found["by_kbot"]
    for name, kind in (
        ("/clock", "rosgraph_msgs/msg/Clock"),
        ("/joint_states", "sensor_msgs/msg/JointState"),
        ("/odom", "nav_msgs/msg/Odometry"),
        ("/robot_description", "std_msgs/msg/String"),
        ("/tf", "tf2_msgs/msg/TFMessage"),
        ("/tf_static", "tf2_msgs/msg/TFMessage"),
    ):
        assert by_kbot[name] == [kind]
    ros1_names = ("/move_base/", "/move_base_simple/", "/gazebo/")
    assert not [name for name in found["topics"] if name.startswith(ros1_names)]
    assert set(found["topics"]["/cmd_vel"]) == {"geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"}
    assert set(found["counts"]) == {"/odom", "/joint_states", "/clock"}
    assert found["joints"] == ["left_wheel_joint", "right_wheel_joint"]
    assert found["description"].startswith("<?xml")
    static = decode_cdr(bytes.fromhex(found["tf_static"]), TFMessage)
    assert ("base_footprint", "base_link") in {
        (t.header.frame_id, t.child_frame_id) for t in static.transforms
    }
    assert 0.1 < found["speed"] < 0.21  # it commands 0.2 m/s


def groups(machine: Machine) -> set[str]:
    """The interfaces on which something receives the multicast of DDS."""
    interfaces, name = set(), ""
    for line in machine.run("cat", "/proc/net/igmp").splitlines()[1:]:
        words = line.split()
        if not line.startswith("\t"):
            name = words[1]
        elif words[0] == MULTICAST_GROUP:
            interfaces.add(name)
    return interfaces


@RANGES
@DISTRIBUTIONS
def test_peers_on_this_machine_find_the_node_and_drive(
    machines: tuple[Machine, Machine], local: str, distribution: str, range_: str
) -> None:
    require_everything(find(machines[0], distribution, range_))


@DISTRIBUTIONS
def test_other_machines_find_nothing(
    machines: tuple[Machine, Machine], local: str, distribution: str
) -> None:
    assert groups(machines[0]) == {"lo"}
    python, seconds = ros2_python(distribution), str(SILENT_SECONDS)
    variables = {"ROS_STATIC_PEERS": OWN}  # it also sends to KBot's machine directly
    found = json.loads(machines[1].run(python, str(PEER), seconds, variables=variables))
    assert found["nodes"] == ["/rclpy_peer"]
    assert found["counts"] == {}
    assert "/tf" not in found["topics"]


@DISTRIBUTIONS
def test_other_machines_find_the_node_at_its_address(
    machines: tuple[Machine, Machine], distribution: str
) -> None:
    own, other = machines
    with kbot(own, "--bridge-host", OWN) as line:
        assert line.strip().endswith(f"at {OWN}")
        assert groups(own) == {"lo", "cable"}
        for machine, range_ in ((other, ""), (own, ""), (own, "LOCALHOST")):
            require_everything(find(machine, distribution, range_))


LOCALHOST = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>'
    "</Domain></CycloneDDS>"
)
"""The configuration of rmw_cyclonedds for peers that are limited to this machine (check_create_domain in its
rmw_node.cpp)."""


def test_cyclone_finds_the_node_as_the_first_line_describes(
    machines: tuple[Machine, Machine], local: str
) -> None:
    own, _ = machines
    assert CYCLONE_HINT in local
    assert find_cyclone(own, "", SILENT_SECONDS) == []
    assert "rt/odom" in find_cyclone(own, LOCALHOST, LIMIT_SECONDS)
    with kbot(own, "--bridge-host", OWN):
        assert "rt/odom" in find_cyclone(own, "", LIMIT_SECONDS)
