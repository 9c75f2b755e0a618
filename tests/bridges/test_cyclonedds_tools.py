"""The command-line tools of Cyclone DDS find KBot's topics, types and messages."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from kbot.ros.bridges.ros2.bridge import Ros2Bridge
from kbot.ros.bridges.ros2.domain import discovery_range

from .conftest import Running

TOOL = Path(sys.executable).with_name("cyclonedds")


@pytest.fixture
def bridge(running: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ros2Bridge]:
    """Each test process has its own domain."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(100 + os.getpid() % 100))
    bridge = Ros2Bridge(running.link)
    try:
        yield bridge
    finally:
        bridge.close()


def start(bridge: Ros2Bridge, verb: str, *words: str) -> "subprocess.Popen[str]":
    options = ("--id", str(bridge.domain), "--suppress-progress-bar", "--color", "none")
    environment = {
        **os.environ,
        "CYCLONEDDS_URI": discovery_range(None, {}).config,
        "COLUMNS": "200",
        "PYTHONUNBUFFERED": "1",
    }
    return subprocess.Popen(
        (str(TOOL), verb, *options, *words), stdout=subprocess.PIPE, text=True, env=environment
    )


def output_of(bridge: Ros2Bridge, verb: str, *words: str, holds: str) -> str:
    """What the tool prints. It is run again until discovery has found `holds`."""
    for _ in range(10):
        with start(bridge, verb, *words) as tool:
            text, _ = tool.communicate(timeout=60)
        if holds in text:
            return text
    raise AssertionError(text)


def test_ls_finds_topics_with_ros_types(bridge: Ros2Bridge) -> None:
    text = output_of(bridge, "ls", holds="rt/cmd_vel")
    for name, kind in (
        ("rt/odom", "nav_msgs::msg::dds_::Odometry_"),
        ("rt/tf", "tf2_msgs::msg::dds_::TFMessage_"),
        ("rt/cmd_vel", "geometry_msgs::msg::dds_::TwistStamped_"),
        ("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"),
    ):
        assert name in text
        assert kind in text


def test_typeof_prints_the_fields_of_a_type(bridge: Ros2Bridge) -> None:
    text = output_of(bridge, "typeof", "rt/odom", holds="struct Odometry_")
    assert "string child_frame_id;" in text
    assert "double covariance[36];" in text


def test_subscribe_decodes_messages(bridge: Ros2Bridge) -> None:
    output_of(bridge, "ls", holds="rt/joint_states")
    with start(bridge, "subscribe", "rt/joint_states") as tool:
        assert tool.stdout is not None
        lines = []
        for line in tool.stdout:
            lines.append(line.strip())
            if line.startswith(")"):
                break
        tool.terminate()
        tool.communicate(timeout=60)
    text = " ".join(lines)
    assert "JointState_(" in text
    assert "'left_wheel_joint'" in text
    assert "'right_wheel_joint'" in text
