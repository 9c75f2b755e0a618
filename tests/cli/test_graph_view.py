"""Tests `kbot topic`, `param`, `node` and `tf` with a running `kbot view`."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation
from kbot.tf.state_publishers import StatePublishers

ROBOT = """<robot name="{}"><link name="base"/><link name="arm"/><link name="camera"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><origin xyz="0 0 1"/>
<axis xyz="0 0 1"/></joint>
<joint name="mount" type="fixed"><parent link="arm"/><child link="camera"/><origin xyz="0.5 0 0"/></joint>
</robot>"""


def kbot(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "kbot", *words], capture_output=True, text=True, timeout=60, check=False
    )


@pytest.fixture
def viewed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The file of a shown robot."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    file = tmp_path / "arm.urdf"
    file.write_text(ROBOT.format("arm"))
    with showing(tmp_path, file):
        yield file


@contextmanager
def showing(tmp_path: Path, file: Path) -> Iterator[None]:
    """Start `kbot view`, and wait until it can be queried."""
    with (tmp_path / "log").open("w") as log:
        viewing = subprocess.Popen(
            [sys.executable, "-m", "kbot", "view", str(file), "--no-browser", "--port", "0"],
            stdout=log,
            stderr=log,
            env=dict(os.environ),
        )
    try:
        until(lambda: kbot("node", "list").returncode == 0)
        yield
    finally:
        viewing.terminate()
        viewing.wait(60)


def until(condition: object, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.2)


def test_topics_frames_parameters_and_nodes_of_a_shown_robot(viewed: Path) -> None:
    topics = dict(re.findall(r"(\S+) \[(\S+)\]", kbot("topic", "list", "-t").stdout))
    assert topics == {
        "/clock": "rosgraph_msgs/msg/Clock",
        "/joint_states": "sensor_msgs/msg/JointState",
        "/robot_description": "std_msgs/msg/String",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/tf_static": "tf2_msgs/msg/TFMessage",
    }
    assert kbot("tf", "tree").stdout.splitlines() == ["base", "  arm", "    camera (static)"]
    where = kbot("tf", "echo", "base", "camera", "--once").stdout
    assert "Translation: [0.500, 0.000, 1.000]" in where
    assert kbot("topic", "echo", "/joint_states", "--once", "--field", "name").stdout == "- turn\n---\n"
    assert 'robot name="arm"' in kbot("param", "get", "/robot_description").stdout
    assert "/joint_states: sensor_msgs/msg/JointState" in kbot("node", "info", "/kbot").stdout
    assert kbot("service", "list").stdout.strip() == ""
    refused = kbot("service", "call", "/gazebo/pause_physics")
    assert (refused.returncode, refused.stderr) == (2, "error: there is no service /gazebo/pause_physics\n")


def test_a_saved_description_updates_topics_and_frames(viewed: Path) -> None:
    viewed.write_text(ROBOT.format("other").replace("camera", "gripper"))
    until(lambda: 'robot name="other"' in kbot("param", "get", "/robot_description").stdout)
    assert kbot("tf", "tree").stdout.splitlines() == ["base", "  arm", "    gripper (static)"]


def test_a_played_recording_is_published_with_its_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It drives at 0.2 m/s for 2 s. After its end, the last pose is still published."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    file = tmp_path / "run.mcap"
    sim = Simulation("kbot")
    StatePublishers(sim)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(file)):
        sim.cmd_vel(0.2, 0.0)
        sim.run(2.0)
    with showing(tmp_path, file):
        topics = kbot("topic", "list").stdout.split()
        assert {"/clock", "/odom", "/tf", "/tf_static", "/joint_states", "/robot_description"} <= {*topics}
        assert "<robot" in kbot("topic", "echo", "/robot_description", "--once").stdout
        until(lambda: clock_of(kbot("topic", "echo", "/clock", "--once").stdout) == 2.0)
        tree = kbot("tf", "tree").stdout.splitlines()
        assert tree[:3] == ["odom", "  base_footprint", "    base_link (static)"]
        where = kbot("tf", "echo", "odom", "base_footprint", "--once").stdout
        at = re.search(r"At time (\S+)\n- Translation: \[(\S+),", where)
        assert at is not None
        assert float(at[1]) == 2.0
        assert float(at[2]) == pytest.approx(sim.odometry.pose.x, abs=2e-3)
        assert "there is no frame 'nope'" in kbot("tf", "echo", "odom", "nope", "--once").stderr


def clock_of(text: str) -> float:
    found = re.search(r"sec: (\d+)\n +nanosec: (\d+)", text)
    assert found is not None
    return int(found[1]) + int(found[2]) * 1e-9
