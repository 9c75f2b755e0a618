"""The tools that Cyclone DDS ships know nothing of us: they find our topics, their types and messages."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from kbot.ros.bridges.ros2.bridge import LOOPBACK, Ros2Bridge

from .conftest import Running

TOOL = Path(sys.executable).with_name("cyclonedds")


@pytest.fixture
def bridge(running: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ros2Bridge]:
    """Each test process has a domain of its own."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(100 + os.getpid() % 100))
    found = Ros2Bridge(running.link)
    try:
        yield found
    finally:
        found.close()


def start(bridge: Ros2Bridge, verb: str, *words: str) -> "subprocess.Popen[str]":
    options = ("--id", str(bridge.domain), "--suppress-progress-bar", "--color", "none")
    environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK, "COLUMNS": "200", "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        (str(TOOL), verb, *options, *words), stdout=subprocess.PIPE, text=True, env=environment
    )


def said(bridge: Ros2Bridge, verb: str, *words: str, holds: str) -> str:
    """What it prints, asked again while discovery has not told it all."""
    for _ in range(10):
        with start(bridge, verb, *words) as tool:
            text, _ = tool.communicate(timeout=60)
        if holds in text:
            return text
    raise AssertionError(text)


def test_ls_finds_topics_with_the_types_of_ros(bridge: Ros2Bridge) -> None:
    text = said(bridge, "ls", holds="rt/cmd_vel")
    for name, kind in (
        ("rt/odom", "nav_msgs::msg::dds_::Odometry_"),
        ("rt/tf", "tf2_msgs::msg::dds_::TFMessage_"),
        ("rt/cmd_vel", "geometry_msgs::msg::dds_::TwistStamped_"),
        ("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"),
    ):
        assert name in text
        assert kind in text


def test_typeof_gives_the_fields_of_a_type(bridge: Ros2Bridge) -> None:
    text = said(bridge, "typeof", "rt/odom", holds="struct Odometry_")
    assert "string child_frame_id;" in text
    assert "double covariance[36];" in text


def test_subscribe_reads_messages_by_the_type_it_found(bridge: Ros2Bridge) -> None:
    said(bridge, "ls", holds="rt/joint_states")
    with start(bridge, "subscribe", "rt/joint_states") as tool:
        assert tool.stdout is not None
        heard = []
        for line in tool.stdout:
            heard.append(line.strip())
            if line.startswith(")"):
                break
        tool.terminate()
        tool.communicate(timeout=60)
    text = " ".join(heard)
    assert "JointState_(" in text
    assert "'left_wheel_joint'" in text
    assert "'right_wheel_joint'" in text
