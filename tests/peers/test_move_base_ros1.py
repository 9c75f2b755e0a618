"""Debian's actionlib client, with Debian's move_base_msgs, drives a simulated KBot to goals."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .conftest import Ros, stop, wait_until
from .test_bridge_ros1 import message_on, output_of

CLIENT = Path(__file__).with_name("move_base_client.py")
PREEMPTED, SUCCEEDED, ABORTED, REJECTED = 2, 3, 4, 5
"""States of actionlib_msgs/GoalStatus."""


@pytest.fixture(scope="module")
def maze(ros: Ros) -> Iterator[Ros]:
    """A robot in a maze in real time with `--ros1` and KBot's master."""
    words = ("sim", "kbot", "--headless", "--ros1", "--world", "maze:size=3,seed=3")
    running = ros.start(sys.executable, "-m", "kbot", *words)
    try:
        wait_until(lambda: "/move_base/goal" in output_of(ros, "rostopic", "list"), "action")
        yield ros
    finally:
        stop(running)


def drive(ros: Ros, *goals: object) -> list[dict[str, Any]]:
    """The end of each goal as Debian's client sees it."""
    return list(json.loads(ros.run("/usr/bin/python3", str(CLIENT), json.dumps(goals), timeout=120)))


def test_topics_have_the_types_of_move_base(maze: Ros) -> None:
    listed = maze.run("rostopic", "list", "-v")
    for line in (
        "/move_base/status [actionlib_msgs/GoalStatusArray] 1 publisher",
        "/move_base/feedback [move_base_msgs/MoveBaseActionFeedback] 1 publisher",
        "/move_base/result [move_base_msgs/MoveBaseActionResult] 1 publisher",
        "/move_base/NavfnROS/plan [nav_msgs/Path] 1 publisher",
        "/move_base/goal [move_base_msgs/MoveBaseActionGoal] 1 subscriber",
        "/move_base/cancel [actionlib_msgs/GoalID] 1 subscriber",
        "/move_base_simple/goal [geometry_msgs/PoseStamped] 1 subscriber",
    ):
        assert line in listed


def test_goals_are_reached_preempted_cancelled_and_refused(maze: Ros) -> None:
    replaced, reached, cancelled, refused, rejected = drive(
        maze,
        {"x": 1.2, "y": 1.2, "replace_after": 1.0},
        {"x": 0.6, "y": 0.6},
        {"x": 0.0, "y": 0.0, "frame": "odom", "cancel_after": 1.0},
        {"x": 0.3, "y": 0.0},
        {"x": 0.3, "y": 0.0, "frame": "camera"},
    )
    assert replaced["state"] == PREEMPTED
    assert "another goal" in replaced["text"]
    assert (reached["state"], reached["text"]) == (SUCCEEDED, "Goal reached.")
    assert reached["feedback"] > 10
    assert reached["frames"] == ["odom"]
    assert reached["last"] == pytest.approx([0.6, 0.6], abs=0.03)
    assert (cancelled["state"], cancelled["text"]) == (PREEMPTED, "cancelled by its sender")
    assert refused["state"] == ABORTED
    assert refused["text"].startswith("the goal is inside an obstacle")
    assert rejected["state"] == REJECTED
    assert "the frame 'camera', which does not exist" in rejected["text"]
    assert len(message_on(maze, "/move_base/NavfnROS/plan")["poses"]) >= 2  # latched


def test_goal_of_rviz_is_a_goal_of_the_action(maze: Ros) -> None:
    goal = "{header: {frame_id: map}, pose: {position: {x: 0.6, y: 0.6}, orientation: {w: 1.0}}}"
    maze.run("rostopic", "pub", "-1", "/move_base_simple/goal", "geometry_msgs/PoseStamped", goal)
    (status,) = message_on(maze, "/move_base/status")["status_list"][-1:]
    assert status["status"] in (1, SUCCEEDED)
