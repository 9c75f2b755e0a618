"""On a real ROS 1: a package from `kbot new` is built and run, and a kbot.Node connects to the master."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from kbot.ros.launch import read_launch
from kbot.templates import Sizes, make_package
from kbot.xacro import Packages

from .conftest import Ros, stop, wait_until

PROGRAM = Path(__file__).parents[1] / "client" / "drive.py"


@pytest.fixture(scope="module")
def package(ros: Ros) -> Path:
    """A package in a catkin workspace, built and installed."""
    source = ros.home / "new_workspace" / "src"
    source.mkdir(parents=True)
    make_package(source / "new_robot", "new_robot", Sizes())
    ros.run("catkin_make", "-C", str(source.parent), "install", timeout=240)
    return source / "new_robot"


@pytest.fixture
def sourced(ros: Ros, package: Path, monkeypatch: pytest.MonkeyPatch) -> Ros:
    """The environment after `source install/setup.bash`."""
    setup = package.parents[1] / "install" / "setup.sh"
    for entry in ros.run("/bin/sh", "-c", f". {setup} && env -0").split("\0"):
        name, _, value = entry.partition("=")
        if name and name != "PWD":
            monkeypatch.setitem(ros.environment, name, value)
    monkeypatch.setitem(
        ros.environment,
        "ROS_PACKAGE_PATH",
        f"{ros.environment['ROS_PACKAGE_PATH']}:{ros.packages}:/usr/share",
    )
    return ros


def test_catkin_builds_and_installs_all_files(package: Path) -> None:
    share = package.parents[1] / "install" / "share" / "new_robot"
    installed = {str(file.relative_to(share)) for file in share.rglob("*") if file.is_file()}
    written = {str(file.relative_to(package)) for file in package.rglob("*") if file.is_file()}
    assert written - installed == {
        "CMakeLists.txt",
        "README.md",
        ".github/workflows/robot.yml",
        "test/drive.scenario.yaml",
        "test/test_new_robot.py",
    }


def test_roslaunch_sets_the_same_parameters(sourced: Ros, package: Path) -> None:
    file = package / "launch" / "display.launch"
    theirs = yaml.safe_load(sourced.run("roslaunch", "--dump-params", "new_robot", "display.launch"))
    plan = read_launch(str(file), packages=Packages([str(package), str(sourced.packages)])).require()
    assert set(theirs) == set(plan.params) == {"/robot_description"}
    assert theirs["/robot_description"].count("<link ") == plan.params["/robot_description"].value.count(
        "<link "
    )


def test_roslaunch_publishes_the_frames(sourced: Ros, display: Path) -> None:
    process = sourced.start("roslaunch", "new_robot", "display.launch")
    try:
        wait_until(lambda: "/robot_state_publisher" in _output_of(sourced, "rosnode", "list"), "nodes")
        fixed = yaml.safe_load(sourced.run("rostopic", "echo", "-n", "1", "/tf_static").partition("---")[0])
        assert {t["child_frame_id"] for t in fixed["transforms"]} == {"base_link", "caster"}
        states = yaml.safe_load(
            sourced.run("rostopic", "echo", "-n", "1", "/joint_states").partition("---")[0]
        )
        assert states["name"] == ["left_wheel_joint", "right_wheel_joint"]
    finally:
        stop(process)


@pytest.fixture
def simulated(ros: Ros) -> Iterator[Ros]:
    """Debian's master with a KBot as a node."""
    master = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    wait_until(lambda: "/rosout" in _output_of(ros, "rosnode", "list"), "master")
    robot = ros.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1")
    try:
        wait_until(lambda: "/kbot" in _output_of(ros, "rosnode", "list"), "node /kbot")
        yield ros
    finally:
        stop(robot)
        stop(master)


def test_kbot_node_drives_through_debian_master(simulated: Ros) -> None:
    simulated.run("rosparam", "set", "/driver/distance", "0.25")
    done = simulated.run(sys.executable, str(PROGRAM), "go:=cmd_vel", timeout=90)
    found = json.loads(done)
    assert (found["distance"], found["sim_time"]) == (0.25, True)
    assert found["x"] >= 0.25


def test_kbot_node_and_rostopic_exchange_messages(simulated: Ros) -> None:
    program = (
        "import kbot\nfrom kbot.messages import String\n"
        "node = kbot.Node('talker')\n"
        "chatter = node.advertise('chatter', String, latched=True)\n"
        "node.subscribe('orders', String, lambda m: chatter.publish(String('got ' + m.data)))\n"
        "node.spin(60)\n"
    )
    node = simulated.start(sys.executable, "-c", program)
    orders = simulated.start("rostopic", "pub", "-r", "5", "/orders", "std_msgs/String", "turn")
    try:
        assert "got turn" in simulated.run("rostopic", "echo", "-n", "1", "/chatter", timeout=60)
        wait_until(lambda: "/talker" in _output_of(simulated, "rosnode", "list"), "node /talker")
        assert "* /chatter [std_msgs/String]" in simulated.run("rosnode", "info", "/talker")
    finally:
        stop(orders)
        stop(node)


def _output_of(ros: Ros, *command: str) -> str:
    done = subprocess.run(
        command, env=ros.environment, capture_output=True, text=True, check=False, timeout=60
    )
    return done.stdout


def test_rosparam_reads_the_parameters_of_a_launch(sourced: Ros, package: Path) -> None:
    file = package / "launch" / "many.launch"
    file.write_text(
        """<launch><include file="$(dirname)/display.launch"/>
        <rosparam>{gains: {p: 1.5, i: 0}, names: [a, b], flag: true, text: "12"}</rosparam>
        <param name="count" value="3"/><group ns="left"><param name="rate" value="2.5"/></group></launch>"""
    )
    theirs = yaml.safe_load(sourced.run("roslaunch", "--dump-params", str(file)))
    running = sourced.start(
        *(sys.executable, "-m", "kbot", "launch", str(file), "--ros1", "--no-browser", "--port", "0")
    )
    try:
        wait_until(lambda: "/left/rate" in _output_of(sourced, "rosparam", "list"), "parameters")
        ours = yaml.safe_load(sourced.run("rosparam", "get", "/"))
    finally:
        stop(running)
    flat = _flat(ours, "")
    for name, value in theirs.items():
        if name != "/robot_description":
            assert (type(flat[name]), flat[name]) == (type(value), value), name
    assert flat["/robot_description"].count("<link ") == theirs["/robot_description"].count("<link ")


def _flat(tree: dict[str, object], prefix: str) -> dict[str, object]:
    found: dict[str, object] = {}
    for key, value in tree.items():
        found.update(
            _flat(value, f"{prefix}/{key}") if isinstance(value, dict) else {f"{prefix}/{key}": value}
        )
    return found
