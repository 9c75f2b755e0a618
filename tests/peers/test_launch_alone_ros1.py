"""A launch file without a robot, beside a ROS 1 master."""

import sys
from pathlib import Path

import yaml

from .conftest import Ros, has_master, stop, wait_until
from .test_bridge_ros1 import answers, message_on, output_of

LAUNCH = """<launch>
  <param name="gait/speed" value="0.5"/>
  <node pkg="tf2_ros" type="static_transform_publisher" name="f" args="1 2 3 0 0 0 map odom"/>
  <node pkg="teleop_twist_keyboard" type="teleop_twist_keyboard.py" name="keys"/>
</launch>"""


def test_frames_topics_and_parameters_are_published_in_wall_clock_time(ros: Ros, tmp_path: Path) -> None:
    (tmp_path / "a.launch").write_text(LAUNCH)
    core = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    running = [core]
    try:
        wait_until(lambda: has_master(ros), "master")
        running.append(ros.start(sys.executable, "-m", "kbot", "launch", str(tmp_path / "a.launch")))
        wait_until(lambda: "/tf_static" in output_of(ros, "rostopic", "list"), "topics")
        wait_until(lambda: "/cmd_vel" in output_of(ros, "rostopic", "list"), "topics")
        (transform,) = message_on(ros, "/tf_static")["transforms"]
        assert (transform["header"]["frame_id"], transform["child_frame_id"]) == ("map", "odom")
        assert transform["transform"]["translation"] == {"x": 1.0, "y": 2.0, "z": 3.0}
        assert yaml.safe_load(ros.run("rosparam", "get", "/gait/speed")) == 0.5
        assert not answers(ros, "rosparam", "get", "/use_sim_time")
        assert not answers(ros, "rosparam", "get", "/robot_description")
        assert "/clock" not in output_of(ros, "rostopic", "list").split()
    finally:
        for process in reversed(running):
            stop(process)
