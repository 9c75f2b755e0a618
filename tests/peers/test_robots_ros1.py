"""Debian's ROS 1 lists and drives two robots of one launch file, each in its namespace."""

import json
import sys
from collections.abc import Iterator

import pytest
import yaml

from kbot.model.load import resolve_robot_path

from .conftest import Ros, has_master, stop, wait_until
from .test_bridge_ros1 import LOOK_UP, message_on, output_of

ROBOT = """<group ns="{name}">
    <param name="robot_description" command="xacro {file}"/>
    <param name="tf_prefix" value="{name}"/>
    <param name="gait/speed" value="{speed}"/>
    <node pkg="gazebo_ros" type="spawn_model" name="spawn"
          args="-urdf -param robot_description -model {name} -x {x} -y {y}"/>
    <node pkg="robot_state_publisher" type="robot_state_publisher" name="rsp"/>
  </group>"""
WORLD = '<include file="$(find gazebo_ros)/launch/empty_world.launch"/>'
NAMES = "robot1", "robot2"


@pytest.fixture(scope="module", params=["kbot as master", "roscore"])
def live(ros: Ros, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros]:
    """Robots at (0, 0) and (0, 1), in real time with `--ros1`, with and without Debian's master."""
    file = resolve_robot_path("kbot")
    groups = (ROBOT.format(name=name, file=file, x=0, y=y, speed=y + 0.5) for y, name in enumerate(NAMES))
    launch = tmp_path_factory.mktemp("two") / "two.launch"
    launch.write_text(f"<launch>{WORLD}{''.join(groups)}</launch>")
    running = []
    if request.param == "roscore":
        running.append(ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2]))
        wait_until(lambda: has_master(ros), "master")
    words = ("-m", "kbot", "launch", str(launch), "--ros1", "--no-browser", "--port", "0")
    running.append(ros.start(sys.executable, *words))
    try:
        wait_until(lambda: "/robot2/odom" in output_of(ros, "rostopic", "list"), "topics of both robots")
        yield ros
    finally:
        for process in reversed(running):
            stop(process)


def where(ros: Ros, name: str) -> tuple[float, float]:
    """The position in a robot's odometry."""
    position = message_on(ros, f"/{name}/odom")["pose"]["pose"]["position"]
    return position["x"], position["y"]


def speed(ros: Ros, name: str) -> float:
    return abs(float(message_on(ros, f"/{name}/odom")["twist"]["twist"]["linear"]["x"]))


def test_each_robot_has_its_topics_and_parameters(live: Ros) -> None:
    published, _, subscribed = live.run("rostopic", "list", "-v").partition("Subscribed topics")
    for name in NAMES:
        assert f"/{name}/odom [nav_msgs/Odometry] 1 publisher" in published
        assert f"/{name}/joint_states [sensor_msgs/JointState] 1 publisher" in published
        assert f"/{name}/cmd_vel [geometry_msgs/Twist] 1 subscriber" in subscribed
        assert "left_wheel_joint" in yaml.safe_load(live.run("rosparam", "get", f"/{name}/robot_description"))
    assert "/cmd_vel " not in subscribed.replace("1/cmd_vel ", "").replace("2/cmd_vel ", "")
    assert [live.run("rosparam", "get", f"/{name}/gait/speed").strip() for name in NAMES] == ["0.5", "1.5"]


def test_messages_name_the_frames_of_their_robot(live: Ros) -> None:
    for name in NAMES:
        odometry = message_on(live, f"/{name}/odom")
        assert odometry["header"]["frame_id"] == f"{name}/odom"
        assert odometry["child_frame_id"] == f"{name}/base_footprint"
    for name in NAMES:
        states = message_on(live, f"/{name}/joint_states")
        assert {"left_wheel_joint", "right_wheel_joint"} <= set(states["name"])


def test_command_drives_only_its_robot(live: Ros) -> None:
    """rostopic drives one robot. tf agrees with its odometry, and the other robot does not move."""
    before = {name: where(live, name) for name in NAMES}
    driver = live.start(
        "rostopic", "pub", "-r", "10", "/robot2/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.3}}"
    )
    try:
        wait_until(lambda: where(live, "robot2")[0] > before["robot2"][0] + 0.2, "moving robot2", 30)
    finally:
        stop(driver)
    wait_until(lambda: speed(live, "robot2") < 1e-3, "stopped robot2", 30)
    assert where(live, "robot1") == pytest.approx(before["robot1"], abs=1e-3)
    queries = json.dumps([(f"{name}/odom", f"{name}/base_footprint") for name in NAMES])
    found = json.loads(live.run("/usr/bin/python3", "-c", LOOK_UP, queries))
    for name, xyz in zip(NAMES, found, strict=True):
        assert xyz[:2] == pytest.approx(where(live, name), abs=2e-3)
