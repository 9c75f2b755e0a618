"""KBot's package on a real ROS 1: catkin_make builds it, roslaunch runs it, rviz shows it."""

import json
import shutil
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.kinematics import FrameTree
from kbot.xacro.packages import SHIPPED

from .conftest import Ros, stop, wait_until

PACKAGE = Path(SHIPPED) / "kbot_description"
POSITIONS = [
    {"left_wheel_joint": 0.0, "right_wheel_joint": 0.0},
    {"left_wheel_joint": 0.7, "right_wheel_joint": -2.5},
]


@pytest.fixture(scope="module")
def workspace(ros: Ros) -> Path:
    """A catkin workspace with KBot's package, built and installed."""
    folder = ros.home / "workspace"
    shutil.copytree(PACKAGE, folder / "src" / "kbot_description")
    ros.run("catkin_make", "-C", str(folder), "install", timeout=240)
    return folder


@pytest.fixture
def sourced(ros: Ros, workspace: Path, monkeypatch: pytest.MonkeyPatch) -> Ros:
    """The environment after `source install/setup.bash`."""
    command = f". {workspace}/install/setup.sh && env -0"
    for entry in ros.run("/bin/sh", "-c", command).split("\0"):
        name, _, value = entry.partition("=")
        if name and name != "PWD":
            monkeypatch.setitem(ros.environment, name, value)
    ros.environment["ROS_PACKAGE_PATH"] += f":{ros.packages}:/usr/share"
    return ros


@pytest.fixture
def launched(sourced: Ros, display: Path) -> Iterator[Ros]:
    """ROS while roslaunch runs the launch file of the package."""
    process = sourced.start("roslaunch", "kbot_description", "kbot_base_rviz.launch")
    try:
        yield sourced
    finally:
        stop(process)


def test_package_is_built_and_installed(workspace: Path) -> None:
    share = workspace / "install/share/kbot_description"
    installed = {str(file.relative_to(share)) for file in share.rglob("*") if file.is_file()}
    written = {str(file.relative_to(PACKAGE)) for file in PACKAGE.rglob("*") if file.is_file()}
    assert written - installed <= {"CMakeLists.txt"}


def test_roslaunch_publishes_the_same_frames_as_kbot(launched: Ros, display: Path) -> None:
    robot = kbot.load("kbot")
    tree = FrameTree(robot)
    wait_until(lambda: "/rviz" in _nodes(launched), "node /rviz")
    movable = [joint.child for joint in robot.movable_joints]
    listener = str(Path(__file__).with_name("listen.py"))
    joints = [{**{j.name: 0.0 for j in robot.movable_joints}, **position} for position in POSITIONS]
    transforms = launched.run("/usr/bin/python3", listener, json.dumps(joints), json.dumps(movable))
    for position, edges in zip(joints, json.loads(transforms), strict=True):
        poses = tree.poses(position)
        assert set(edges) == set(poses) - {robot.root}
        for link, (parent, xyz, xyzw) in edges.items():
            expected = poses[parent].inverse() @ poses[link]
            assert robot.parent_joint[link].parent == parent
            np.testing.assert_allclose(xyz, expected.translation, atol=1e-12)
            np.testing.assert_allclose(_matrix(xyzw), expected.rotation, atol=1e-9)
    wait_until(lambda: shows_robot(display), "blue plate and black wheels on rviz's screen", 90)


def _nodes(ros: Ros) -> str:
    try:
        return ros.run("rosnode", "list")
    except AssertionError:
        return ""


def _matrix(xyzw: list[float]) -> np.ndarray:
    x, y, z, w = np.array(xyzw) / np.linalg.norm(xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def shows_robot(display: Path) -> bool:
    """Whether the picture has thousands of pixels in the blue of the base and, around it, in the black of the
    wheels."""
    pixels = picture(display).astype(int)
    blue = (pixels[..., 2] > 80) & (pixels[..., :2].max(axis=2) < 12)
    if blue.sum() < 5000:
        return False
    rows, columns = np.nonzero(blue)
    around = pixels[rows.min() - 20 : rows.max() + 20, columns.min() : columns.max()]
    return bool((around.max(axis=2) < 8).sum() > 1000)


def picture(file: Path) -> np.ndarray:
    """The pixels (height, width, 3) of an X window dump."""
    data = file.read_bytes()
    header = struct.unpack(">25I", data[:100])
    size, width, height, per_line, colors = header[0], header[4], header[5], header[12], header[19]
    start = size + 12 * colors
    rows = np.frombuffer(data, np.uint8, per_line * height, start).reshape(height, per_line)
    return rows[:, : 4 * width].reshape(height, width, 4)[:, :, 2::-1]
