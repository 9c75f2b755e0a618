"""`kbot topic`, `node`, `service`, `param` and `tf` against a KBot that runs: as a user types them."""

import json
from typing import Any

import pytest
import yaml

from kbot.cli.main import run
from kbot.cli.ros.graph.asking import tell_of_silence
from kbot.ros.graph.server import GraphServer

from .conftest import Running, Said, told, wait_until


def test_topics(graph: GraphServer, capsys: Said) -> None:
    assert "/odom [nav_msgs/msg/Odometry]" in told(capsys, "topic", "list", "-t").splitlines()
    assert json.loads(told(capsys, "topic", "list", "--json"))["/clock"] == "rosgraph_msgs/msg/Clock"
    assert told(capsys, "topic", "type", "cmd_vel") == "geometry_msgs/msg/Twist\n"
    info = told(capsys, "topic", "info", "/cmd_vel").splitlines()
    assert info[:3] == ["Type: geometry_msgs/msg/Twist", "Publisher count: 0", "Subscription count: 1"]
    assert "did you mean '/odom'" in told(capsys, "topic", "info", "/odmo", status=2)
    topics = told(capsys, "topic", "list").splitlines()
    assert told(capsys, "topic", "list", "-c") == f"{len(topics)}\n"
    said, _, heard = told(capsys, "topic", "list", "-v").partition("Subscribed topics:\n")
    assert " * /odom [nav_msgs/msg/Odometry]" in said.splitlines()
    assert " * /cmd_vel [geometry_msgs/msg/Twist]" in heard.splitlines()
    assert said.count(" * ") + heard.count(" * ") == len(topics)
    verbose = told(capsys, "topic", "info", "-v", "/cmd_vel").splitlines()
    assert verbose[2:] == [
        *("Subscription count: 1", "", "Node name: kbot", "Node namespace: /"),
        *("Topic type: geometry_msgs/msg/Twist", "Endpoint type: SUBSCRIPTION", ""),
    ]


def test_echo(graph: GraphServer, capsys: Said) -> None:
    text = told(capsys, "topic", "echo", "/odom", "-n", "2")
    first, second, rest = text.split("---\n")
    assert rest == ""
    assert yaml.safe_load(first)["child_frame_id"] == "base_footprint"
    assert yaml.safe_load(second)["header"]["stamp"] != yaml.safe_load(first)["header"]["stamp"]
    part = told(capsys, "topic", "echo", "/odom", "--once", "--json", "--field", "pose.covariance[0]")
    assert json.loads(part) == 0.001
    assert told(capsys, "topic", "echo", "/joint_states", "--once", "--field", "name") != ""
    wrong = told(capsys, "topic", "echo", "/odom", "--once", "--field", "pose.psoe", status=2)
    assert "there is no 'psoe': did you mean 'pose'" in wrong


def test_who_waits_is_told_what_for(
    running: Running, graph: GraphServer, capsys: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tell_and_go_on(*what: Any) -> None:
        tell_of_silence(*what)
        running.simulation.paused = False

    for module in ("asking", "tf"):
        monkeypatch.setattr(f"kbot.cli.ros.graph.{module}.tell_of_silence", tell_and_go_on)
    for words, topic in ((("topic", "echo", "/odom"), "/odom"), (("tf", "echo", "odom", "base_link"), "/tf")):
        running.simulation.paused = True
        assert run((*words, "--once")) == 0
        captured = capsys.readouterr()
        assert captured.err == f"waiting for {topic}: time stands still there: is it paused?\n"
        assert captured.out != ""


def test_echo_in_other_styles(graph: GraphServer, capsys: Said) -> None:
    def echo(*options: str) -> str:
        return told(capsys, "topic", "echo", "--once", "/odom", "nav_msgs/msg/Odometry", *options)

    short = yaml.safe_load(echo("--no-arr", "--no-str").removesuffix("---\n"))
    assert short["pose"]["covariance"] == "<36 numbers>"
    assert short["child_frame_id"] == f"<{len('base_footprint')} characters>"
    line, end, rest = echo("--flow-style").split("\n")
    assert (end, rest) == ("---", "")
    assert len(yaml.safe_load(line)["twist"]["covariance"]) == 36
    values = echo("--csv").rstrip("\n").split(",")
    # stamp, two frames, and twice a covariance: beside a pose of 7, and beside a twist of 6
    assert len(values) == 2 + 2 + (7 + 36) + (6 + 36)
    assert values[2:4] == ["odom", "base_footprint"]
    wrong = told(capsys, "topic", "echo", "/odom", "nav_msgs/msg/Path", status=2)
    assert "/odom carries nav_msgs/msg/Odometry, not nav_msgs/msg/Path" in wrong


def test_hz_is_the_control_rate(graph: GraphServer, capsys: Said) -> None:
    """The fixture steps 20 ms at a time: each step says odometry once."""
    text = told(capsys, "topic", "hz", "/odom", "-n", "1")
    assert text.startswith("average rate: ")
    assert "window: " in text


def test_pub_drives_the_robot(running: Running, graph: GraphServer, capsys: Said) -> None:
    words = ("topic", "pub", "/cmd_vel", "geometry_msgs/msg/Twist", "{linear: {x: 0.3}}", "-r", "50")
    told(capsys, *words, "-t", "5")
    assert running.simulation.robots.first.commanded_twist.x == 0.3
    assert "what the simulation says" in told(capsys, "topic", "pub", "--once", "/odom", status=2)
    assert "no field 'linaer'" in told(capsys, "topic", "pub", "-1", "/cmd_vel", "{linaer: {}}", status=2)
    error = told(capsys, "topic", "pub", "-1", "/cmd_vel", "{linear: {x: .nan}}", status=2)
    assert "two finite numbers" in error
    assert "is to be YAML" in told(capsys, "topic", "pub", "-1", "/cmd_vel", "{linear: [", status=2)


def test_nodes_and_services(running: Running, graph: GraphServer, capsys: Said) -> None:
    assert told(capsys, "node", "list") == "/kbot\n"
    info = told(capsys, "node", "info", "kbot").splitlines()
    assert "    /cmd_vel: geometry_msgs/msg/Twist" in info[: info.index("  Publishers:")]
    assert "    /gazebo/pause_physics: std_srvs/srv/Empty" in info
    services = told(capsys, "service", "list", "-t").splitlines()
    assert "/gazebo/spawn_urdf_model [gazebo_msgs/srv/SpawnModel]" in services
    assert told(capsys, "service", "list", "-c") == f"{len(services)}\n"
    assert told(capsys, "node", "list", "-c") == "1\n"
    kind = told(capsys, "service", "type", "/gazebo/delete_model")
    assert (
        kind == "gazebo_msgs/srv/DeleteModel\nstring model_name\n---\nbool success\nstring status_message\n"
    )
    told(capsys, "service", "call", "/gazebo/pause_physics")
    assert running.simulation.paused
    call = ("service", "call", "/gazebo/get_model_state", "{model_name: kbot}", "--json")
    stamp = json.loads(told(capsys, *call))["header"]["stamp"]
    assert stamp["sec"] + stamp["nanosec"] * 1e-9 == pytest.approx(running.simulation.time, abs=1e-9)
    capsys.readouterr()
    assert run(("service", "call", "/gazebo/delete_model", "{model_name: ghost}")) == 1
    failed = capsys.readouterr()
    assert failed.err.startswith("/gazebo/delete_model failed: ")
    assert yaml.safe_load(failed.out)["status_message"] in failed.err
    assert "'ghost'" in failed.err
    assert run(("service", "call", "/gazebo/get_model_state", "{model_name: ghost}")) == 1
    told_of = yaml.safe_load(capsys.readouterr().out)
    assert told_of.keys() == {"success", "status_message"}
    assert told_of["success"] is False
    assert "did you mean '/gazebo/pause_physics'" in told(
        capsys, "service", "call", "/gazebo/pause_phsics", status=2
    )


def test_parameters(running: Running, graph: GraphServer, capsys: Said) -> None:
    told(capsys, "param", "set", "/arm/gain", "2.5")
    told(capsys, "param", "set", "names", "[a, b]")
    assert running.link.parameters["/arm/gain"] == 2.5
    assert "as in 0.5 or '[a, b]': " in told(capsys, "param", "set", "names", "[a", status=2)
    assert told(capsys, "param", "get", "/robot_description") == "<robot/>\n"
    assert "/arm/gain" in told(capsys, "param", "list").splitlines()
    assert yaml.safe_load(told(capsys, "param", "get", "names")) == ["a", "b"]
    assert "there is no parameter /arm/size" in told(capsys, "param", "get", "/arm/size", status=2)
    assert "VALUE is empty" in told(capsys, "param", "set", "names", "", status=2)
    assert "a number is too large" in told(capsys, "param", "set", "names", "0x" + "f" * 5000, status=2)


def test_parameters_named_as_ros_2_does(running: Running, graph: GraphServer, capsys: Said) -> None:
    running.link.set_parameters({"/arm/gain": 2.5, "/slow": True})
    assert told(capsys, "param", "get", "/arm", "gain") == "2.5\n"
    assert told(capsys, "param", "get", "arm", "slow") == "true\n"  # the one that all share
    assert told(capsys, "param", "list", "/arm") == "/arm/gain\n"
    assert told(capsys, "param", "list", "/kbot") == told(capsys, "param", "list")
    assert "no parameters beneath /leg/" in told(capsys, "param", "list", "/leg", status=2)
    told(capsys, "param", "set", "/arm", "names", "[a, b]")
    assert running.link.parameters["/arm/names"] == ["a", "b"]
    assert "one NODE and one NAME" in told(capsys, "param", "get", "a", "b", "c", status=2)


def test_frames(running: Running, graph: GraphServer, capsys: Said) -> None:
    begins = ["odom", "  base_footprint", "    base_link (static)"]
    # it looks for a second, in which a busy machine may tell of nothing that moves
    wait_until(lambda: told(capsys, "tf", "tree").splitlines()[:3] == begins)
    echoed = told(capsys, "tf", "echo", "base_footprint", "left_wheel", "--once", "--json")
    transform = running.simulation.robot.joints
    assert "left_wheel_joint" in transform
    pose = running.simulation.link_pose("base_footprint").inverse() @ running.simulation.link_pose(
        "left_wheel"
    )
    assert json.loads(echoed)["translation"] == pytest.approx(pose.translation.tolist(), abs=1e-4)
    wrong = told(capsys, "tf", "echo", "odom", "base_lnik", status=2)
    assert "there is no frame 'base_lnik': did you mean 'base_link'" in wrong
