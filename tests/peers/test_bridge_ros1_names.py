"""KBot accepts the host name of this machine, which the tools of ROS 1 use without ROS_IP."""

import copy
import re
import socket
import sys
from collections.abc import Iterator

import pytest
import yaml

from .conftest import Ros, stop, wait_until


@pytest.fixture(scope="module", params=["kbot as master", "roscore"])
def named(ros: Ros, request: pytest.FixtureRequest) -> Iterator[Ros]:
    """A simulation in real time with `--ros1`. Its master has an address with the name of this machine."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    found = copy.copy(ros)
    found.environment = ros.environment | {"ROS_MASTER_URI": f"http://{socket.gethostname()}:{port}"}
    del found.environment["ROS_IP"]
    running = []
    if request.param == "roscore":
        running.append(found.start("roscore", "-p", port))
        wait_until(lambda: works(found, "rosparam", "list"), "master")
    running.append(found.start(sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros1"))
    try:
        wait_until(lambda: works(found, "rostopic", "info", "/odom"), "topic /odom")
        yield found
    finally:
        for process in reversed(running):
            stop(process)


def works(ros: Ros, *command: str) -> bool:
    try:
        ros.run(*command)
    except AssertionError:
        return False
    return True


def test_parameters_are_set_and_read(named: Ros) -> None:
    named.run("rosparam", "set", "/here/deep", "{a: 1, b: [1.5, x]}")
    assert yaml.safe_load(named.run("rosparam", "get", "/here/deep")) == {"a": 1, "b": [1.5, "x"]}
    assert yaml.safe_load(named.run("rosparam", "get", "/use_sim_time")) is True


def test_messages_are_sent_and_received(named: Ros) -> None:
    """A publisher at this machine's name drives the robot."""
    echo = ("rostopic", "echo", "-n", "1", "/odom/twist/twist/linear/x")
    driver = named.start(
        "rostopic", "pub", "-r", "10", "/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.3}}"
    )
    try:
        wait_until(lambda: float(named.run(*echo).partition("---")[0]) > 0.25, "moving robot", 30)
    finally:
        stop(driver)


def test_cpp_node_receives_the_frames(named: Ros) -> None:
    # it exits only on Ctrl-C
    echo = "timeout -s INT 5 /usr/lib/tf/tf_echo base_footprint base_link || true"
    assert re.search(r"- Translation: \[[-\d., ]+\]", named.run("/bin/sh", "-c", echo))


def test_publisher_on_another_machine_is_reported_and_not_contacted(named: Ros) -> None:
    register = (
        "import rosgraph; rosgraph.Master('/other').registerPublisher"
        "('/cmd_vel', 'geometry_msgs/Twist', 'http://192.0.2.7:1/')"
    )
    works(named, "/usr/bin/python3", "-c", register)  # KBot's master rejects it, roscore forwards it
    log = named.home / f"{sys.executable.rpartition('/')[2]}.log"
    wait_until(lambda: "'192.0.2.7' is not a name or address" in log.read_text(), "report")
    assert "--bridge-host" in log.read_text()
