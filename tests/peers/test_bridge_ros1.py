"""A simulated KBot as a ROS 1 node: Debian's tools list it, subscribe to its topics and drive it."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator

import pytest
import yaml

import kbot

from .conftest import Ros, stop, wait_until


@pytest.fixture(scope="module", params=["kbot as master", "roscore"])
def live(ros: Ros, request: pytest.FixtureRequest) -> Iterator[Ros]:
    """A simulation in real time with `--ros1`, with and without Debian's master."""
    running = []
    if request.param == "roscore":
        port = ros.environment["ROS_MASTER_URI"].rpartition(":")[2]
        running.append(ros.start("roscore", "-p", port))
        wait_until(lambda: answers(ros, "rosparam", "list"), "master")
    running.append(ros.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1"))
    try:
        wait_until(lambda: "/kbot" in output_of(ros, "rosnode", "list"), "node /kbot")
        wait_until(lambda: "/tf_static" in output_of(ros, "rostopic", "list"), "topics")
        yield ros
    finally:
        for process in reversed(running):
            stop(process)


def output_of(ros: Ros, *command: str) -> str:
    done = subprocess.run(
        command, env=ros.environment, capture_output=True, text=True, check=False, timeout=60
    )
    return done.stdout


def answers(ros: Ros, *command: str) -> bool:
    done = subprocess.run(command, env=ros.environment, capture_output=True, check=False, timeout=60)
    return done.returncode == 0


def message_on(ros: Ros, topic: str) -> dict[str, object]:
    """A message on a topic, as `rostopic echo` prints it."""
    text = ros.run("rostopic", "echo", "-n", "1", topic, timeout=30)
    return dict(yaml.safe_load(text.partition("---")[0]))


def test_tools_list_the_node_its_topics_and_its_parameters(live: Ros) -> None:
    listed = live.run("rostopic", "list", "-v")
    published, _, subscribed = listed.partition("Subscribed topics")
    for line in (
        "/clock [rosgraph_msgs/Clock] 1 publisher",
        "/joint_states [sensor_msgs/JointState] 1 publisher",
        "/odom [nav_msgs/Odometry] 1 publisher",
        "/tf [tf2_msgs/TFMessage] 1 publisher",
        "/tf_static [tf2_msgs/TFMessage] 1 publisher",
    ):
        assert line in published
    assert "/cmd_vel [geometry_msgs/Twist] 1 subscriber" in subscribed
    info = live.run("rosnode", "info", "/kbot")
    assert "* /odom [nav_msgs/Odometry]" in info
    assert "xmlrpc reply" in live.run("rosnode", "ping", "-c", "1", "/kbot")
    assert yaml.safe_load(live.run("rosparam", "get", "/use_sim_time")) is True
    description = yaml.safe_load(live.run("rosparam", "get", "/robot_description"))
    assert "left_wheel_joint" in description


def test_rosparam_sets_reads_and_deletes_parameters(live: Ros) -> None:
    value = {"a": 1, "b": {"c": [1.5, "x"], "d": True}}
    live.run("rosparam", "set", "/here/deep", yaml.safe_dump(value))
    assert yaml.safe_load(live.run("rosparam", "get", "/here/deep")) == value
    assert yaml.safe_load(live.run("rosparam", "get", "/here/deep/b/c")) == [1.5, "x"]
    assert {"/here/deep/a", "/here/deep/b/c"} <= set(live.run("rosparam", "list").split())
    live.run("rosparam", "delete", "/here/deep/b")
    assert yaml.safe_load(live.run("rosparam", "get", "/here")) == {"deep": {"a": 1}}
    assert not answers(live, "rosparam", "get", "/here/deep/b/c")


def test_odometry_is_published_at_its_rate(live: Ros) -> None:
    listener = live.start("rostopic", "hz", "-w", "100", "--wall-time", "/odom")
    log = live.home / "rostopic.log"
    try:
        wait_until(lambda: "average rate" in log.read_text(), "rate", 30)
        rate = float(re.findall(r"average rate: ([\d.]+)", log.read_text())[-1])
    finally:
        stop(listener)
    assert 25 < rate < 75  # it is 50 Hz on an idle machine
    odometry = message_on(live, "/odom")
    assert odometry["child_frame_id"] == "base_footprint"


def test_twist_from_rostopic_drives_until_the_watchdog_stops_the_robot(live: Ros) -> None:
    driver = live.start(
        "rostopic", "pub", "-r", "10", "/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.3}}"
    )
    try:
        wait_until(lambda: speed(live) > 0.25, "moving robot", 30)
    finally:
        stop(driver)
    wait_until(lambda: abs(speed(live)) < 0.01, "stopped robot", 30)
    assert message_on(live, "/odom")["pose"]["pose"]["position"]["x"] > 0.02


def speed(ros: Ros) -> float:
    return float(message_on(ros, "/odom")["twist"]["twist"]["linear"]["x"])


LOOK_UP = """
import json, sys, rospy, tf2_ros
rospy.init_node("look", anonymous=True)
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
found = []
for parent, child in json.loads(sys.argv[1]):
    for attempt in range(300):
        try:
            transform = buffer.lookup_transform(parent, child, rospy.Time(0)).transform
            break
        except tf2_ros.TransformException:
            rospy.rostime.wallsleep(0.05)
    found.append([transform.translation.x, transform.translation.y, transform.translation.z])
json.dump(found, sys.stdout)
"""


def test_tf_has_every_link_also_static_ones(live: Ros) -> None:
    """A late `tf2` listener receives the latched static transforms and joins them to the moving ones."""
    robot = kbot.load("kbot")
    pairs = [(joint.parent, joint.child) for joint in robot.joints.values()]
    queries = json.dumps([*pairs, *(("odom", link) for link in robot.links)])
    found = json.loads(live.run("/usr/bin/python3", "-c", LOOK_UP, queries))
    for xyz, joint in zip(found, robot.joints.values(), strict=False):
        assert xyz == pytest.approx(joint.pose.xyz, abs=1e-12)
    assert len(found) == len(robot.joints) + len(robot.links)


def test_subscriber_with_another_type_does_not_break_the_topic(live: Ros) -> None:
    """rospy logs the error in the connection header."""
    program = (
        "import rospy, std_msgs.msg; rospy.init_node('wrong', anonymous=True, log_level=rospy.DEBUG);"
        "rospy.Subscriber('/odom', std_msgs.msg.String, print); import time; time.sleep(3)"
    )
    live.run("/usr/bin/python3", "-c", program)
    assert answers(live, "rostopic", "echo", "-n", "1", "/odom")


PERSISTENT = """
import rospy
from std_srvs.srv import Empty
rospy.init_node("caller", disable_signals=True)
proxy = rospy.ServiceProxy("/gazebo/unpause_physics", Empty, persistent=True)
proxy(); proxy()
print("twice")
"""


def test_tf_echo_prints_the_frames(live: Ros) -> None:
    # it exits only on Ctrl-C, and then prints its buffered output
    echo = "timeout -s INT 5 /usr/lib/tf/tf_echo base_footprint base_link || true"
    text = live.run("/bin/sh", "-c", echo)
    line = next(line for line in text.splitlines() if line.startswith("- Translation"))
    found = [float(number) for number in re.findall(r"-?\d+\.\d+", line)]
    pose = kbot.kinematics.FrameTree(kbot.load("kbot")).poses()["base_link"]
    assert found == pytest.approx(pose.translation.tolist(), abs=1e-3)


def test_rosservice_lists_and_calls_services(live: Ros) -> None:
    """Only services of std_srvs are called, because Debian does not have gazebo_msgs."""
    listed = live.run("rosservice", "list").splitlines()
    assert {"/gazebo/pause_physics", "/gazebo/spawn_urdf_model"} <= set(listed)
    assert live.run("rosservice", "type", "/gazebo/delete_model").strip() == "gazebo_msgs/DeleteModel"
    info = live.run("rosservice", "info", "/gazebo/reset_world")
    assert "Node: /kbot" in info
    live.run("rosservice", "call", "/gazebo/pause_physics")
    paused = live.run("/usr/bin/python3", "-c", PERSISTENT)
    assert paused.strip() == "twice"
    assert answers(live, "rostopic", "echo", "-n", "1", "/clock")


def test_second_kbot_takes_the_name_of_the_first(live: Ros) -> None:
    """This is the last test in the file, because it ends the node that the other tests use."""
    before = live.run("rosnode", "info", "/kbot").partition("Pid:")[2].split()[0]
    second = live.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1")
    try:
        wait_until(
            lambda: str(second.pid) in output_of(live, "rosnode", "info", "/kbot"), "node of the second KBot"
        )
        assert before != str(second.pid)
        for _ in range(3):
            assert str(second.pid) in output_of(live, "rosnode", "info", "/kbot")
    finally:
        stop(second)
