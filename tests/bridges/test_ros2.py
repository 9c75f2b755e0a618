"""The ROS 2 bridge, with a peer whose messages the DDS library encodes."""

import json
import math
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from kbot.record.encodings.types import ros2_definition
from kbot.record.run_outputs import RunOutputs
from kbot.ros.bridges.ros2.bridge import Ros2Bridge
from kbot.ros.bridges.ros2.domain import discovery_range
from kbot.ros.bridges.ros2.samples import sample_of, sample_type
from kbot.ros.peers import RosPeers
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.extras import needs_extra

from .conftest import Running

PEER = Path(__file__).with_name("dds_peer.py")


@pytest.fixture
def bridge(running: Running, monkeypatch: pytest.MonkeyPatch):
    """Each test process has its own domain."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(100 + os.getpid() % 100))
    bridge = Ros2Bridge(running.link)
    try:
        yield bridge
    finally:
        bridge.close()


@pytest.mark.parametrize("kind", ["plain", "stamped"])
def test_a_peer_receives_odometry_finds_the_node_and_drives(
    running: Running, bridge: Ros2Bridge, kind: str
) -> None:
    done = subprocess.run(
        [sys.executable, str(PEER), str(bridge.domain), discovery_range(None, {}).config, kind],
        capture_output=True,
        text=True,
        check=False,
        timeout=180,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["speed"] > 0.1
    assert found["frames"] == ["odom", "base_footprint"]
    assert found["variance"] == 0.001  # of libgazebo_ros_diff_drive.so
    assert found["description"] == "<robot/>"
    assert found["node"] == "/kbot"
    assert found["readers"] == 3  # two types of cmd_vel, and set_model_state
    assert found["topics"]["rt/odom"] == f"typehash={ros2_definition('nav_msgs/msg/Odometry')[1]};"
    assert found["guids"]["rt/odom"] in found["writers"]
    assert "enclave=/;" in found["enclaves"]
    assert running.reported == []
    assert running.is_stepping()


def test_invalid_messages_have_no_effect(running: Running, bridge: Ros2Bridge) -> None:
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    kind = sample_type("geometry_msgs/msg/Twist")
    writer = DataWriter(bridge._participant, Topic(bridge._participant, "rt/cmd_vel", kind))
    for _ in range(20):
        writer.write(sample_of(kind, b"\0\1\0\0" + struct.pack("<6d", math.nan, 0, 0, 0, 0, 0)))
    assert running.is_stepping()
    assert running.simulation.robots.first.twist.x == 0.0
    assert len(running.reported) <= 1


@pytest.mark.parametrize("domain", ["-1", "233", "zero", "1.5"])
def test_error_for_an_invalid_domain(running: Running, monkeypatch: pytest.MonkeyPatch, domain: str) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    with pytest.raises(KbotError, match="ROS_DOMAIN_ID must be a whole number from 0 to 232"):
        Ros2Bridge(running.link)


def test_error_for_an_address_of_another_machine(running: Running) -> None:
    """192.0.2.1 is for documentation (RFC 5737)."""
    with pytest.raises(KbotError, match=r"Is 192\.0\.2\.1 an address of this machine\?"):
        Ros2Bridge(running.link, "192.0.2.1", domain=229)


def test_error_without_the_extra_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith(("cyclonedds", "kbot.ros.bridges.ros2"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    outputs = RunOutputs(print, peers=RosPeers(print, ["ros2"]))
    import kbot

    with pytest.raises(KbotError, match=re.escape(needs_extra("ROS 2", "ros2"))):
        outputs.join(Simulation(kbot.load("kbot")), "", "empty")
