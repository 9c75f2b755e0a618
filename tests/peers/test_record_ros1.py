"""Debian's rosbag reads the bags of KBot, and KBot reads the bags of rosbag."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import kbot
from kbot.messages import Twist, Vector3
from kbot.record import Recorder, Recording
from kbot.record.feed import Feed
from kbot.sim import Simulation

from .conftest import Ros, has_master, stop, wait_until

READ = """
import json, rosbag, sys
rows = []
with rosbag.Bag(sys.argv[1]) as bag:
    for topic, message, at in bag.read_messages("/odom"):
        rows.append([at.to_nsec(), message.header.stamp.to_nsec(), message.pose.pose.position.x])
json.dump(rows, sys.stdout)
"""
WRITE = """
import rosbag, rospy, sys
from geometry_msgs.msg import Twist
from std_msgs.msg import String
with rosbag.Bag(sys.argv[1], "w", compression=sys.argv[2]) as bag:
    for n in range(500):
        twist = Twist()
        twist.linear.x = n / 10
        bag.write("/cmd_vel", twist, rospy.Time(1, n))
        bag.write("/chatter", String(str(n)), rospy.Time(1, n))
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bags") / "run.bag"
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path)):
        sim.cmd_vel(0.3, 0.2)
        sim.run(3.0)
    return path


def test_rosbag_info_counts_the_same_messages(ros: Ros, bag: Path) -> None:
    text = ros.run("rosbag", "info", str(bag))
    ours = Recording(str(bag)).summary()
    assert f"messages: {ours.count + 2}" in " ".join(text.split())  # including the two notes about the run
    assert "nav_msgs/Odometry [cd5e73d190d741a2f92e81eda573aca7]" in " ".join(text.split())


def test_rosbag_reads_every_message_and_number(ros: Ros, bag: Path) -> None:
    theirs = json.loads(ros.run("/usr/bin/python3", "-c", READ, str(bag)))
    ours = [
        [entry.nanoseconds, entry.nanoseconds, entry.message().pose.pose.position.x]
        for entry in Recording(str(bag)).entries()
        if entry.topic == "/odom"
    ]
    assert len(ours) == 150
    assert theirs == ours


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_kbot_reads_bags_of_rosbag(ros: Ros, tmp_path: Path, compression: str) -> None:
    path = tmp_path / "theirs.bag"
    ros.run("/usr/bin/python3", "-c", WRITE, str(path), compression)
    found = Recording(str(path))
    assert {name: topic.count for name, topic in found.summary().topics.items()} == {
        "/cmd_vel": 500,
        "/chatter": 500,
    }
    speeds = [entry.message().linear.x for entry in found.entries() if entry.topic == "/cmd_vel"]
    assert speeds == [n / 10 for n in range(500)]


def test_rosbag_plays_back_a_bag_of_kbot(ros: Ros, bag: Path) -> None:
    core = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    player = None
    try:
        wait_until(lambda: has_master(ros), "master")
        player = ros.start("rosbag", "play", "--loop", "--quiet", str(bag))
        wait_until(lambda: "/odom" in ros.run("rostopic", "list"), "player")
        assert "base_footprint" in ros.run("rostopic", "echo", "-n", "1", "/odom/child_frame_id")
        assert "frame_id" in ros.run("rostopic", "echo", "-n", "1", "/tf")
    finally:
        for process in (player, core):
            if process is not None:
                stop(process)


@pytest.mark.parametrize(
    "args", ["-d 4 -s 0.45 -u 1 --topics /cmd_vel --bags={}", "-d 4 -r 2 {} --topics /cmd_vel"]
)
def test_roslaunch_and_kbot_launch_play_back_the_same_messages(ros: Ros, tmp_path: Path, args: str) -> None:
    bag = tmp_path / "drive.bag"
    sim = Simulation("kbot")
    sim.bus.advertise("/cmd_vel", Twist)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(bag)):
        for number in range(1, 21):
            sim.bus.publish("/cmd_vel", Twist(Vector3(number / 10), Vector3()))
            sim.run(0.1)
    file = tmp_path / "play.launch"
    file.write_text(
        f'<launch><node pkg="rosbag" type="play" name="p" args="{args.format(bag)}" required="true">'
        '<remap from="/cmd_vel" to="/again"/></node></launch>'
    )
    core = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    try:
        wait_until(lambda: has_master(ros), "master")
        theirs = _received(ros, tmp_path / "theirs.txt", "roslaunch", str(file))
        ours = _received(
            ros, tmp_path / "ours.txt", sys.executable, "-m", "kbot", "launch", str(file), "--ros1"
        )
    finally:
        stop(core)
    assert len(theirs) >= 10
    assert ours == theirs


def _received(ros: Ros, file: Path, *launch: str) -> list[str]:
    """The values on a topic while a launch runs, which ends without Ctrl-C."""
    with file.open("w") as output:
        echo = subprocess.Popen(
            ["rostopic", "echo", "-p", "/again/linear/x"],
            env=ros.environment,
            stdout=output,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    try:
        subprocess.run(launch, env=ros.environment, capture_output=True, timeout=90, check=False)
    finally:
        stop(echo)
    return [line.partition(",")[2] for line in file.read_text().splitlines() if line[:1].isdecimal()]


def test_killed_recording_is_read_as_far_as_rosbag_reindex_recovers_it(ros: Ros, tmp_path: Path) -> None:
    core = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    started = [core]
    bag = tmp_path / "killed.bag.active"
    try:
        wait_until(lambda: has_master(ros), "master")
        started.append(ros.start("rostopic", "pub", "-r", "200", "/chatter", "std_msgs/String", "x" * 5000))
        recorder = ros.start("rosbag", "record", "--chunksize=64", "-O", str(tmp_path / "killed"), "/chatter")
        started.append(recorder)
        wait_until(lambda: bag.exists() and bag.stat().st_size > 2_000_000, "recording")
        os.killpg(recorder.pid, signal.SIGKILL)
        recorder.wait(60)
    finally:
        for process in reversed(started):
            stop(process)
    found = Recording(str(bag)).summary()
    assert "it was not closed" in found.broken
    reindexed = tmp_path / "reindexed.bag"
    reindexed.write_bytes(bag.read_bytes())
    ros.run("rosbag", "reindex", str(reindexed))
    theirs = re.search(r"/chatter +(\d+) msgs", ros.run("rosbag", "info", str(reindexed)))
    assert theirs is not None
    assert int(theirs[1]) > 300
    # rosbag recovers whole chunks of thirteen messages; KBot also reads those of the last chunk
    assert 0 <= found.count - int(theirs[1]) <= 13
