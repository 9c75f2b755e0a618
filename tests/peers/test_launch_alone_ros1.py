"""A launch without a robot beside a master of ROS 1, as roslaunch would run it."""

import sys
from pathlib import Path

import yaml

from .conftest import Ros, has_master, stop, wait_until
from .test_bridge_ros1 import answers, one, said

LAUNCH = """<launch>
  <param name="gait/speed" value="0.5"/>
  <node pkg="tf2_ros" type="static_transform_publisher" name="f" args="1 2 3 0 0 0 map odom"/>
  <node pkg="teleop_twist_keyboard" type="teleop_twist_keyboard.py" name="keys"/>
</launch>"""


def test_its_frames_topics_and_parameters_are_there_and_time_stays_the_walls(
    ros: Ros, tmp_path: Path
) -> None:
    (tmp_path / "a.launch").write_text(LAUNCH)
    core = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    running = [core]
    try:
        wait_until(lambda: has_master(ros), "a master")
        running.append(ros.start(sys.executable, "-m", "kbot", "launch", str(tmp_path / "a.launch")))
        wait_until(lambda: "/tf_static" in said(ros, "rostopic", "list"), "its topics")
        wait_until(lambda: "/cmd_vel" in said(ros, "rostopic", "list"), "its topics")
        (transform,) = one(ros, "/tf_static")["transforms"]
        assert (transform["header"]["frame_id"], transform["child_frame_id"]) == ("map", "odom")
        assert transform["transform"]["translation"] == {"x": 1.0, "y": 2.0, "z": 3.0}
        assert yaml.safe_load(ros.run("rosparam", "get", "/gait/speed")) == 0.5
        assert not answers(ros, "rosparam", "get", "/use_sim_time")
        assert not answers(ros, "rosparam", "get", "/robot_description")
        assert "/clock" not in said(ros, "rostopic", "list").split()
    finally:
        for process in reversed(running):
            stop(process)
