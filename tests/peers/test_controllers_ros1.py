"""Debian's actionlib client moves an arm that a launch file spawns."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import Ros, stop, wait_until
from .test_bridge_ros1 import message_on, output_of

MANAGER = """<gazebo><plugin name="gazebo_ros_control" filename="libgazebo_ros_control.so">
<robotNamespace>/arm</robotNamespace></plugin></gazebo>"""
ARM = (Path(__file__).parents[1] / "robots" / "arm.urdf").read_text()
ARM = ARM.replace("</robot>", f"{MANAGER}</robot>")
CONTROLLERS = """
joint_state_controller: {type: joint_state_controller/JointStateController, publish_rate: 50}
follow: {type: position_controllers/JointTrajectoryController, joints: [shoulder, elbow]}
"""
LAUNCH = """<launch>
  <param name="robot_description" textfile="$(dirname)/arm.urdf"/>
  <include file="$(find gazebo_ros)/launch/empty_world.launch"/>
  <node pkg="gazebo_ros" type="spawn_model" name="spawn" args="-urdf -param robot_description -model arm"/>
  <rosparam command="load" file="$(dirname)/arm.yaml" ns="arm"/>
  <node pkg="controller_manager" type="spawner" name="s" ns="arm" args="joint_state_controller follow"/>
</launch>"""


@pytest.fixture(scope="module")
def arm(ros: Ros, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros]:
    """An arm in real time with `--ros1` and KBot's master."""
    folder = tmp_path_factory.mktemp("arm")
    for name, text in (("arm.urdf", ARM), ("arm.yaml", CONTROLLERS), ("arm.launch", LAUNCH)):
        (folder / name).write_text(text)
    words = ("launch", str(folder / "arm.launch"), "--ros1", "--no-browser", "--port", "0")
    running = ros.start(sys.executable, "-m", "kbot", *words)
    try:
        wait_until(
            lambda: "/arm/follow/follow_joint_trajectory/goal" in output_of(ros, "rostopic", "list"), "action"
        )
        yield ros
    finally:
        stop(running)


CLIENT = Path(__file__).with_name("follow_trajectory.py")


def follow(ros: Ros, *goals: object) -> list[dict[str, object]]:
    """The result of Debian's actionlib client for each goal."""
    return list(json.loads(ros.run("/usr/bin/python3", str(CLIENT), json.dumps(goals))))


def test_action_has_the_topics_and_types_of_actionlib(arm: Ros) -> None:
    listed = arm.run("rostopic", "list", "-v")
    stem = "/arm/follow/follow_joint_trajectory"
    for line in (
        f"{stem}/status [actionlib_msgs/GoalStatusArray] 1 publisher",
        f"{stem}/feedback [control_msgs/FollowJointTrajectoryActionFeedback] 1 publisher",
        f"{stem}/result [control_msgs/FollowJointTrajectoryActionResult] 1 publisher",
        f"{stem}/goal [control_msgs/FollowJointTrajectoryActionGoal] 1 subscriber",
        f"{stem}/cancel [actionlib_msgs/GoalID] 1 subscriber",
    ):
        assert line in listed


def test_actionlib_client_gets_feedback_and_can_cancel(arm: Ros) -> None:
    joints = ["shoulder", "elbow"]
    reached, cancelled = follow(
        arm,
        {"joints": joints, "points": [[1.0, [0.4, -0.3]], [2.0, [0.6, -0.5]]]},
        {"joints": joints, "points": [[20.0, [0.0, 0.0]]], "cancel_after": 1.0},
    )
    assert (reached["state"], reached["code"]) == (3, 0)
    assert reached["feedback"] > 10
    assert cancelled["state"] == 2
    positions = dict(
        zip(*(message_on(arm, "/arm/joint_states")[key] for key in ("name", "position")), strict=True)
    )
    assert 0.3 < positions["shoulder"] < 0.6


def test_invalid_trajectory_is_rejected_with_code_and_message(arm: Ros) -> None:
    both = ["shoulder", "elbow"]
    refused = follow(
        arm,
        {"joints": ["shoulder", "elbw"], "points": [[1.0, [0.1, 0.1]]]},
        {"joints": both, "points": [[1.0, ["nan", 0.1]]]},
        {"joints": both, "points": [[1.0, [0.1, 0.1]], [0.5, [0.2, 0.2]]]},
    )
    assert [(result["state"], result["code"]) for result in refused] == [(5, -2), (5, -1), (5, -1)]
    for result, message in zip(refused, ("did you mean 'elbow'", "finite", "must increase"), strict=True):
        assert message in str(result["words"])
