"""ROS 2 over Zenoh with zenoh-ros2-sdk as the peer: topics, what is latched, commands, services, tokens."""

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
"""As ROS 2 has it."""


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return free.getsockname()[1]


def test_a_peer_hears_drives_and_calls(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    port = free_port()
    monkeypatch.setattr("kbot.ros.bridges.zenoh.bridge.ROUTER_PORT", port)
    bridge = ZenohBridge(running.link)
    try:
        assert "in the router's place" in bridge.describe()
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
    ours = [token.split("/") for token in found["tokens"] if token.split("/")[8] == "kbot"]
    assert {token[5] for token in ours} == {"NN", "MP", "MS", "SS"}
    odometry = next(token for token in ours if len(token) > 9 and token[9] == "%odom")
    assert odometry[10] == "nav_msgs::msg::dds_::Odometry_"
    assert running.reported == []


def test_a_second_one_joins_the_first_as_its_router(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kbot.ros.bridges.zenoh.bridge.ROUTER_PORT", free_port())
    first = ZenohBridge(running.link)
    second = ZenohBridge(running.link)
    try:
        assert "by the router at" in second.describe()
        wait_until(running.goes_on)
    finally:
        second.close()
        first.close()


def test_a_router_that_is_named_and_does_not_answer(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ZENOH_CONNECT", f"tcp/127.0.0.1:{free_port()}")
    with pytest.raises(KbotError, match="no Zenoh router answers at tcp/"):
        ZenohBridge(running.link)
