"""roslaunch and KBot delete and clear the same parameters on Debian's master."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import Ros, has_master, stop, wait_until

ROBOT = """<param name="robot_description" command="$(find xacro)/xacro $(dirname)/r.urdf"/>
<node pkg="gazebo_ros" type="spawn_model" name="spawn" args="-urdf -param robot_description -model r"/>
"""
FILE = """<launch>
  {}
  <rosparam command="delete" param="/removed/deep"/>
  <rosparam command="delete" ns="elsewhere" param="x"/>
  <group ns="left" clear_params="true"><param name="new" value="1"/></group>
  <node pkg="ends_at_once" type="end.py" name="n" clear_params="true"><param name="mine" value="2"/></node>
</launch>"""
BEFORE = {
    "/removed/deep/a": "1", "/removed/deep/b": "2", "/removed/stays": "3", "/elsewhere/x": "4",
    "/elsewhere/y": "5",
    "/left/old": "6", "/right/old": "7", "/n/old": "8",
}  # fmt: skip
AFTER = {
    "/removed/stays": "3", "/elsewhere/y": "5", "/left/new": "1", "/right/old": "7", "/n/mine": "2",
}  # fmt: skip


@pytest.fixture
def package(ros: Ros) -> Path:
    folder = ros.packages / "ends_at_once"
    folder.mkdir(exist_ok=True)
    (folder / "package.xml").write_text(
        "<package format='2'><name>ends_at_once</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='a@example.org'>a</maintainer><license>MIT</license></package>"
    )
    (folder / "end.py").write_text("#!/usr/bin/python3\nimport rospy\nrospy.init_node('n')\n")
    (folder / "end.py").chmod(0o755)
    (folder / "r.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    return folder


def parameters(ros: Ros) -> dict[str, str]:
    """The parameters under the names above, as set on the master."""
    text = ros.run("rosparam", "list")
    names = [name for name in text.split() if re.match("/(removed|elsewhere|left|right|n)/", name)]
    return {name: ros.run("rosparam", "get", name).strip() for name in names}


@pytest.mark.parametrize("by", ["roslaunch", "kbot", "kbot with a robot"])
def test_only_deleted_and_cleared_parameters_are_removed(ros: Ros, package: Path, by: str) -> None:
    file = package / "a.launch"
    file.write_text(FILE.format(ROBOT if "robot" in by else ""))
    core = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    running = None
    try:
        wait_until(lambda: has_master(ros), "master")
        for name, value in BEFORE.items():
            ros.run("rosparam", "set", name, value)
        kbot = [sys.executable, "-m", "kbot", "launch", str(file)]
        if "robot" in by:
            running = ros.start(*kbot, "--no-browser", "--port", "0", "--ros1")
            wait_until(lambda: _is_done(ros), "finished launch")
        else:
            command = ["roslaunch", str(file)] if by == "roslaunch" else kbot
            subprocess.run(command, env=ros.environment, capture_output=True, timeout=90, check=False)
        assert parameters(ros) == AFTER
    finally:
        for process in (running, core):
            if process is not None:
                stop(process)


def _is_done(ros: Ros) -> bool:
    try:
        return parameters(ros) == AFTER
    except AssertionError:  # a listed parameter was deleted before it was read
        return False
