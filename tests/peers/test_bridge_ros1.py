"""A simulated KBot as a node of ROS 1: Debian's own tools see it, hear it and drive it."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator

import pytest
import yaml

import kbot

from .conftest import Ros, stop, wait_until


@pytest.fixture(scope="module", params=["our own master", "roscore"])
def live(ros: Ros, request: pytest.FixtureRequest) -> Iterator[Ros]:
    """A simulation in real time with `--ros1`, with Debian's master and without one."""
    running = []
    if request.param == "roscore":
        port = ros.environment["ROS_MASTER_URI"].rpartition(":")[2]
        running.append(ros.start("roscore", "-p", port))
        wait_until(lambda: answers(ros, "rosparam", "list"), "a master")
    running.append(ros.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1"))
    try:
        wait_until(lambda: "/kbot" in said(ros, "rosnode", "list"), "a node /kbot")
        wait_until(lambda: "/tf_static" in said(ros, "rostopic", "list"), "topics")
        yield ros
    finally:
        for process in reversed(running):
            stop(process)


def said(ros: Ros, *command: str) -> str:
    done = subprocess.run(
        command, env=ros.environment, capture_output=True, text=True, check=False, timeout=60
    )
    return done.stdout


def answers(ros: Ros, *command: str) -> bool:
    done = subprocess.run(command, env=ros.environment, capture_output=True, check=False, timeout=60)
    return done.returncode == 0


def one(ros: Ros, topic: str) -> dict[str, object]:
    """One message as `rostopic echo` prints it."""
    text = ros.run("rostopic", "echo", "-n", "1", topic, timeout=30)
    return dict(yaml.safe_load(text.partition("---")[0]))


def test_the_tools_see_the_node_its_topics_and_its_parameters(live: Ros) -> None:
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


def test_parameters_as_rosparam_keeps_them(live: Ros) -> None:
    value = {"a": 1, "b": {"c": [1.5, "x"], "d": True}}
    live.run("rosparam", "set", "/here/deep", yaml.safe_dump(value))
    assert yaml.safe_load(live.run("rosparam", "get", "/here/deep")) == value
    assert yaml.safe_load(live.run("rosparam", "get", "/here/deep/b/c")) == [1.5, "x"]
    assert {"/here/deep/a", "/here/deep/b/c"} <= set(live.run("rosparam", "list").split())
    live.run("rosparam", "delete", "/here/deep/b")
    assert yaml.safe_load(live.run("rosparam", "get", "/here")) == {"deep": {"a": 1}}
    assert not answers(live, "rosparam", "get", "/here/deep/b/c")


def test_odometry_comes_at_its_rate(live: Ros) -> None:
    listener = live.start("rostopic", "hz", "-w", "100", "--wall-time", "/odom")
    log = live.home / "rostopic.log"
    try:
        wait_until(lambda: "average rate" in log.read_text(), "a rate", 30)
        rate = float(re.findall(r"average rate: ([\d.]+)", log.read_text())[-1])
    finally:
        stop(listener)
    assert 25 < rate < 75  # it is 50 Hz where the machine is free
    odometry = one(live, "/odom")
    assert odometry["child_frame_id"] == "base_footprint"


def test_a_twist_from_rostopic_drives_it_and_silence_stops_it(live: Ros) -> None:
    driver = live.start(
        "rostopic", "pub", "-r", "10", "/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.3}}"
    )
    try:
        wait_until(lambda: speed(live) > 0.25, "a moving robot", 30)
    finally:
        stop(driver)
    wait_until(lambda: abs(speed(live)) < 0.01, "a robot that its watchdog stopped", 30)
    assert one(live, "/odom")["pose"]["pose"]["position"]["x"] > 0.02


def speed(ros: Ros) -> float:
    return float(one(ros, "/odom")["twist"]["twist"]["linear"]["x"])


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


def test_tf_knows_every_link_also_those_that_were_said_once(live: Ros) -> None:
    """`tf2` hears the latched static transforms although it comes late, and joins them to the moving ones."""
    robot = kbot.load("kbot")
    pairs = [(joint.parent, joint.child) for joint in robot.joints.values()]
    asked = json.dumps([*pairs, *(("odom", link) for link in robot.links)])
    found = json.loads(live.run("/usr/bin/python3", "-c", LOOK_UP, asked))
    for xyz, joint in zip(found, robot.joints.values(), strict=False):
        assert xyz == pytest.approx(joint.pose.xyz, abs=1e-12)
    assert len(found) == len(robot.joints) + len(robot.links)


def test_a_subscriber_of_another_type_is_told(live: Ros) -> None:
    """rospy logs what our header says."""
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


def test_tf_echo_finds_the_frames(live: Ros) -> None:
    # it ends with nothing but Ctrl-C, and then says what it kept back
    echo = "timeout -s INT 5 /usr/lib/tf/tf_echo base_footprint base_link || true"
    text = live.run("/bin/sh", "-c", echo)
    line = next(line for line in text.splitlines() if line.startswith("- Translation"))
    found = [float(number) for number in re.findall(r"-?\d+\.\d+", line)]
    pose = kbot.kinematics.FrameTree(kbot.load("kbot")).poses()["base_link"]
    assert found == pytest.approx(pose.translation.tolist(), abs=1e-3)


def test_rosservice_lists_and_calls(live: Ros) -> None:
    """Debian has no gazebo_msgs: what is called is of std_srvs."""
    listed = live.run("rosservice", "list").splitlines()
    assert {"/gazebo/pause_physics", "/gazebo/spawn_urdf_model"} <= set(listed)
    assert live.run("rosservice", "type", "/gazebo/delete_model").strip() == "gazebo_msgs/DeleteModel"
    info = live.run("rosservice", "info", "/gazebo/reset_world")
    assert "Node: /kbot" in info
    live.run("rosservice", "call", "/gazebo/pause_physics")
    paused = live.run("/usr/bin/python3", "-c", PERSISTENT)
    assert paused.strip() == "twice"
    assert answers(live, "rostopic", "echo", "-n", "1", "/clock")


def test_a_second_one_takes_the_name_and_the_first_gives_way(live: Ros) -> None:
    """The last one here: what the others ask is gone when it ends."""
    before = live.run("rosnode", "info", "/kbot").partition("Pid:")[2].split()[0]
    second = live.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1")
    try:
        wait_until(lambda: str(second.pid) in said(live, "rosnode", "info", "/kbot"), "the second's node")
        assert before != str(second.pid)
        for _ in range(3):
            assert str(second.pid) in said(live, "rosnode", "info", "/kbot")
    finally:
        stop(second)
