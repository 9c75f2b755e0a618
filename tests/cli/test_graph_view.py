"""Tests `kbot topic`, `param`, `node` and `tf` with a running `kbot view`."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.tf.state_publishers import StatePublishers

RunKbot = Callable[..., Any]

ROBOT = """<robot name="{}"><link name="base"/><link name="arm"/><link name="camera"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><origin xyz="0 0 1"/>
<axis xyz="0 0 1"/></joint>
<joint name="mount" type="fixed"><parent link="arm"/><child link="camera"/><origin xyz="0.5 0 0"/></joint>
</robot>"""


@pytest.fixture
def viewed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run_kbot: RunKbot) -> Iterator[Path]:
    """The file of a shown robot."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    file = tmp_path / "arm.urdf"
    file.write_text(ROBOT.format("arm"))
    with showing(tmp_path, file, run_kbot):
        yield file


@contextmanager
def showing(tmp_path: Path, file: Path, run_kbot: RunKbot) -> Iterator[None]:
    """Start `kbot view`, and wait until it can be queried."""
    with (tmp_path / "log").open("w") as log:
        viewing = subprocess.Popen(
            [sys.executable, "-m", "kbot", "view", str(file), "--no-browser", "--port", "0"],
            stdout=log,
            stderr=log,
            env=dict(os.environ),
        )
    try:
        until(lambda: run_kbot("node", "list").status == 0)
        yield
    finally:
        viewing.terminate()
        viewing.wait(60)


def until(condition: object, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.2)


def test_topics_frames_parameters_and_nodes_of_a_shown_robot(viewed: Path, run_kbot: RunKbot) -> None:
    topics = dict(re.findall(r"(\S+) \[(\S+)\]", run_kbot("topic", "list", "-t").out))
    assert topics == {
        "/clock": "rosgraph_msgs/msg/Clock",
        "/joint_states": "sensor_msgs/msg/JointState",
        "/robot_description": "std_msgs/msg/String",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/tf_static": "tf2_msgs/msg/TFMessage",
    }
    assert run_kbot("tf", "tree").out.splitlines() == ["base", "  arm", "    camera (static)"]
    where = run_kbot("tf", "echo", "base", "camera", "--once").out
    assert "Translation: [0.500, 0.000, 1.000]" in where
    assert run_kbot("topic", "echo", "/joint_states", "--once", "--field", "name").out == "- turn\n---\n"
    assert 'robot name="arm"' in run_kbot("param", "get", "/robot_description").out
    assert "/joint_states: sensor_msgs/msg/JointState" in run_kbot("node", "info", "/kbot").out
    assert run_kbot("service", "list").out.strip() == ""
    refused = run_kbot("service", "call", "/gazebo/pause_physics")
    assert (refused.status, refused.err) == (2, "error: there is no service /gazebo/pause_physics\n")


def test_a_saved_description_updates_topics_and_frames(viewed: Path, run_kbot: RunKbot) -> None:
    viewed.write_text(ROBOT.format("other").replace("camera", "gripper"))
    until(lambda: 'robot name="other"' in run_kbot("param", "get", "/robot_description").out)
    assert run_kbot("tf", "tree").out.splitlines() == ["base", "  arm", "    gripper (static)"]


def test_a_played_recording_is_published_with_its_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run_kbot: RunKbot
) -> None:
    """It drives at 0.2 m/s for 2 s. After its end, the last pose is still published."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    file = tmp_path / "run.mcap"
    sim = Simulation("kbot")
    StatePublishers(sim)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(file)):
        sim.cmd_vel(0.2, 0.0)
        sim.run(2.0)
    with showing(tmp_path, file, run_kbot):
        topics = run_kbot("topic", "list").out.split()
        assert {"/clock", "/odom", "/tf", "/tf_static", "/joint_states", "/robot_description"} <= {*topics}
        assert "<robot" in run_kbot("topic", "echo", "/robot_description", "--once").out
        until(lambda: clock_of(run_kbot("topic", "echo", "/clock", "--once").out) == 2.0)
        tree = run_kbot("tf", "tree").out.splitlines()
        assert tree[:3] == ["odom", "  base_footprint", "    base_link (static)"]
        where = run_kbot("tf", "echo", "odom", "base_footprint", "--once").out
        at = re.search(r"At time (\S+)\n- Translation: \[(\S+),", where)
        assert at is not None
        assert float(at[1]) == 2.0
        assert float(at[2]) == pytest.approx(sim.odometry.pose.x, abs=2e-3)
        assert "there is no frame 'nope'" in run_kbot("tf", "echo", "odom", "nope", "--once").err


def clock_of(text: str) -> float:
    found = re.search(r"sec: (\d+)\n +nanosec: (\d+)", text)
    assert found is not None
    return int(found[1]) + int(found[2]) * 1e-9
