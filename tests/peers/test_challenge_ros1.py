"""A program that makes the calls of the BARN challenge's run.py, with rospy, against KBot without a map.

The challenge's own run.py is run by benchmarks/bench_barn_ros1.py.
"""

import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import Ros, stop, wait_until
from .test_bridge_ros1 import output_of

HERE = Path(__file__).parent
MESSAGES = HERE.parents[1] / "benchmarks" / "barn_challenge" / "gazebo_messages.py"
SCRIPT = """
from kbot.messages.sensing import Bool
from kbot.sim.real_time import run_in_real_time

def drive(sim):
    collision = sim.bus.advertise("collision", Bool)
    sim.clock.every(20.0, lambda: collision.publish(Bool(True)) if sim.collided else None)
    run_in_real_time(sim, None)
"""
WORLD = """<sdf version="1.6"><world name="posts">
<model name="ground_plane"><static>1</static><link name="link"><collision name="c"><geometry>
  <plane><normal>0 0 1</normal><size>100 100</size></plane></geometry></collision></link></model>
<model name="post"><static>1</static><pose>-1 1.8 0.5 0 0 0</pose><link name="link"><collision name="c">
  <geometry><cylinder><radius>0.2</radius><length>1</length></cylinder></geometry></collision></link></model>
</world></sdf>"""


@pytest.fixture(scope="module")
def challenge(ros: Ros, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros]:
    """A robot with a lidar, at a post, in real time with `--ros1` and `--no-map`."""
    folder = tmp_path_factory.mktemp("challenge")
    (folder / "script.py").write_text(SCRIPT)
    (folder / "posts.world").write_text(WORLD)
    ros.run("/usr/bin/python3", str(MESSAGES), str(folder))
    words = ("sim", "kbot", "lidar:=true", "--world", str(folder / "posts.world"), "--headless", "--ros1")
    options = ("--no-map", "--arrive", "0.2", "--script", str(folder / "script.py"))
    running = ros.start(sys.executable, "-m", "kbot", *words, *options)
    before = ros.environment.get("PYTHONPATH")
    try:
        wait_until(lambda: "/move_base/goal" in output_of(ros, "rostopic", "list"), "action")
        ros.environment["PYTHONPATH"] = os.pathsep.join(filter(None, (before, str(folder))))
        yield ros
    finally:
        if before is None:
            ros.environment.pop("PYTHONPATH", None)
        stop(running)


def judge(ros: Ros, *numbers: float) -> dict[str, float]:
    words = [str(number) for number in numbers]
    command = ("/usr/bin/python3", str(HERE / "challenge_client.py"), *words)
    return dict(json.loads(ros.run(*command, timeout=180)))


def test_robot_is_placed_and_drives_around_a_post_without_a_map(challenge: Ros) -> None:
    end = judge(challenge, -1.0, 1.0, 1.57, -1.0, 2.8)
    assert end["attempts"] == 1
    assert end["highest"] < 0.1  # at z = 0 it stands on the ground and does not jump
    assert end["left"] <= 0.2
    assert not end["collided"]
    assert 1.0 < end["seconds"] < 30.0


def test_costs_and_path_are_published_where_rviz_expects_them(challenge: Ros) -> None:
    listed = output_of(challenge, "rostopic", "list", "-v")
    for line in (
        "/move_base/local_costmap/costmap [nav_msgs/OccupancyGrid] 1 publisher",
        "/move_base/NavfnROS/plan [nav_msgs/Path] 1 publisher",
        "/collision [std_msgs/Bool] 1 publisher",
    ):
        assert line in listed
    assert "/map [" not in listed
