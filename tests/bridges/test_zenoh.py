"""The Zenoh bridge, with zenoh-ros2-sdk as the peer: topics, commands, services and liveliness tokens."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from kbot.record.encodings.types import ros2_definition
from kbot.ros.bridges.zenoh.bridge import ZenohBridge
from kbot.text import KbotError

from .conftest import Running, wait_until

PEER = Path(__file__).with_name("zenoh_peer.py")
TWIST = "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
"""The hash that ROS 2 installs for geometry_msgs/msg/Twist."""


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return free.getsockname()[1]


def test_a_peer_receives_topics_drives_and_calls_services(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = free_port()
    monkeypatch.setattr("kbot.ros.bridges.zenoh.bridge.ROUTER_PORT", port)
    bridge = ZenohBridge(running.link)
    try:
        assert "acting as the router" in bridge.describe()
        hashes = (TWIST, ros2_definition("nav_msgs/msg/Odometry")[1])
        done = subprocess.run(
            (sys.executable, str(PEER), str(port), *hashes), capture_output=True, text=True, timeout=180
        )
    finally:
        bridge.close()
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["speed"] > 0.15
    assert found["frame"] == "odom"
    assert found["description"] == "<robot/>"
    assert found["answer"][0] is False
    assert "'ghost'" in found["answer"][1]
    own_tokens = [token.split("/") for token in found["tokens"] if token.split("/")[8] == "kbot"]
    assert {token[5] for token in own_tokens} == {"NN", "MP", "MS", "SS"}
    odometry = next(token for token in own_tokens if len(token) > 9 and token[9] == "%odom")
    assert odometry[10] == "nav_msgs::msg::dds_::Odometry_"
    assert running.reported == []


def test_a_second_bridge_connects_to_the_first_as_its_router(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kbot.ros.bridges.zenoh.bridge.ROUTER_PORT", free_port())
    first = ZenohBridge(running.link)
    second = ZenohBridge(running.link)
    try:
        assert "connected to the router at" in second.describe()
        wait_until(running.is_stepping)
    finally:
        second.close()
        first.close()


def test_error_if_the_configured_router_does_not_answer(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ZENOH_CONNECT", f"tcp/127.0.0.1:{free_port()}")
    with pytest.raises(KbotError, match="no Zenoh router answers at tcp/"):
        ZenohBridge(running.link)
