"""`kbot topic`, `node`, `service`, `param` and `tf` against a running KBot."""

import json
from typing import Any

import pytest
import yaml

from kbot.cli.main import run
from kbot.cli.ros.graph.common import print_waiting_note
from kbot.ros.graph.server import GraphServer

from .conftest import Capture, Running, run_verb, wait_until


def test_topics(graph: GraphServer, capsys: Capture) -> None:
    assert "/odom [nav_msgs/msg/Odometry]" in run_verb(capsys, "topic", "list", "-t").splitlines()
    assert json.loads(run_verb(capsys, "topic", "list", "--json"))["/clock"] == "rosgraph_msgs/msg/Clock"
    assert run_verb(capsys, "topic", "type", "cmd_vel") == "geometry_msgs/msg/Twist\n"
    info = run_verb(capsys, "topic", "info", "/cmd_vel").splitlines()
    assert info[:3] == ["Type: geometry_msgs/msg/Twist", "Publisher count: 0", "Subscription count: 1"]
    assert "did you mean '/odom'" in run_verb(capsys, "topic", "info", "/odmo", status=2)
    topics = run_verb(capsys, "topic", "list").splitlines()
    assert run_verb(capsys, "topic", "list", "-c") == f"{len(topics)}\n"
    published, _, subscribed = run_verb(capsys, "topic", "list", "-v").partition("Subscribed topics:\n")
    assert " * /odom [nav_msgs/msg/Odometry]" in published.splitlines()
    assert " * /cmd_vel [geometry_msgs/msg/Twist]" in subscribed.splitlines()
    assert published.count(" * ") + subscribed.count(" * ") == len(topics)
    verbose = run_verb(capsys, "topic", "info", "-v", "/cmd_vel").splitlines()
    assert verbose[2:] == [
        *("Subscription count: 1", "", "Node name: kbot", "Node namespace: /"),
        *("Topic type: geometry_msgs/msg/Twist", "Endpoint type: SUBSCRIPTION", ""),
    ]


def test_echo(graph: GraphServer, capsys: Capture) -> None:
    text = run_verb(capsys, "topic", "echo", "/odom", "-n", "2")
    first, second, rest = text.split("---\n")
    assert rest == ""
    assert yaml.safe_load(first)["child_frame_id"] == "base_footprint"
    assert yaml.safe_load(second)["header"]["stamp"] != yaml.safe_load(first)["header"]["stamp"]
    part = run_verb(capsys, "topic", "echo", "/odom", "--once", "--json", "--field", "pose.covariance[0]")
    assert json.loads(part) == 1e-5  # of libgazebo_ros_diff_drive.so
    assert run_verb(capsys, "topic", "echo", "/joint_states", "--once", "--field", "name") != ""
    wrong = run_verb(capsys, "topic", "echo", "/odom", "--once", "--field", "pose.psoe", status=2)
    assert "there is no field 'psoe': did you mean 'pose'" in wrong


def test_a_note_is_printed_while_no_message_arrives(
    running: Running, graph: GraphServer, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def print_note_and_resume(*arguments: Any) -> None:
        print_waiting_note(*arguments)
        running.simulation.paused = False

    for module in ("common", "tf"):
        monkeypatch.setattr(f"kbot.cli.ros.graph.{module}.print_waiting_note", print_note_and_resume)
    for words, topic in ((("topic", "echo", "/odom"), "/odom"), (("tf", "echo", "odom", "base_link"), "/tf")):
        running.simulation.paused = True
        assert run((*words, "--once")) == 0
        captured = capsys.readouterr()
        assert captured.err == f"waiting for {topic}: KBot's time does not advance. Is it paused?\n"
        assert captured.out != ""


def test_echo_with_other_output_formats(graph: GraphServer, capsys: Capture) -> None:
    def echo(*options: str) -> str:
        return run_verb(capsys, "topic", "echo", "--once", "/odom", "nav_msgs/msg/Odometry", *options)

    short = yaml.safe_load(echo("--no-arr", "--no-str").removesuffix("---\n"))
    assert short["pose"]["covariance"] == "<36 numbers>"
    assert short["child_frame_id"] == f"<{len('base_footprint')} characters>"
    line, end, rest = echo("--flow-style").split("\n")
    assert (end, rest) == ("---", "")
    assert len(yaml.safe_load(line)["twist"]["covariance"]) == 36
    values = echo("--csv").rstrip("\n").split(",")
    # stamp (2), frames (2), pose (7) with its covariance (36), twist (6) with its covariance (36)
    assert len(values) == 2 + 2 + (7 + 36) + (6 + 36)
    assert values[2:4] == ["odom", "base_footprint"]
    wrong = run_verb(capsys, "topic", "echo", "/odom", "nav_msgs/msg/Path", status=2)
    assert "/odom carries nav_msgs/msg/Odometry, not nav_msgs/msg/Path" in wrong


def test_hz_is_the_control_rate(graph: GraphServer, capsys: Capture) -> None:
    """The fixture steps 20 ms at a time. Each step publishes odometry once."""
    text = run_verb(capsys, "topic", "hz", "/odom", "-n", "1")
    assert text.startswith("average rate: ")
    assert "window: " in text


def test_pub_drives_the_robot(running: Running, graph: GraphServer, capsys: Capture) -> None:
    words = ("topic", "pub", "/cmd_vel", "geometry_msgs/msg/Twist", "{linear: {x: 0.3}}", "-r", "50")
    run_verb(capsys, *words, "-t", "5")
    assert running.simulation.robots.first.commanded_twist.x == 0.3
    assert "KBot publishes /odom" in run_verb(capsys, "topic", "pub", "--once", "/odom", status=2)
    assert "no field 'linaer'" in run_verb(capsys, "topic", "pub", "-1", "/cmd_vel", "{linaer: {}}", status=2)
    error = run_verb(capsys, "topic", "pub", "-1", "/cmd_vel", "{linear: {x: .nan}}", status=2)
    assert "two finite numbers" in error
    assert "must be YAML" in run_verb(capsys, "topic", "pub", "-1", "/cmd_vel", "{linear: [", status=2)


def test_nodes_and_services(running: Running, graph: GraphServer, capsys: Capture) -> None:
    assert run_verb(capsys, "node", "list") == "/kbot\n"
    info = run_verb(capsys, "node", "info", "kbot").splitlines()
    assert "    /cmd_vel: geometry_msgs/msg/Twist" in info[: info.index("  Publishers:")]
    assert "    /gazebo/pause_physics: std_srvs/srv/Empty" in info
    services = run_verb(capsys, "service", "list", "-t").splitlines()
    assert "/gazebo/spawn_urdf_model [gazebo_msgs/srv/SpawnModel]" in services
    assert run_verb(capsys, "service", "list", "-c") == f"{len(services)}\n"
    assert run_verb(capsys, "node", "list", "-c") == "1\n"
    kind = run_verb(capsys, "service", "type", "/gazebo/delete_model")
    assert (
        kind == "gazebo_msgs/srv/DeleteModel\nstring model_name\n---\nbool success\nstring status_message\n"
    )
    run_verb(capsys, "service", "call", "/gazebo/pause_physics")
    assert running.simulation.paused
    call = ("service", "call", "/gazebo/get_model_state", "{model_name: kbot}", "--json")
    stamp = json.loads(run_verb(capsys, *call))["header"]["stamp"]
    assert stamp["sec"] + stamp["nanosec"] * 1e-9 == pytest.approx(running.simulation.time, abs=1e-9)
    capsys.readouterr()
    assert run(("service", "call", "/gazebo/delete_model", "{model_name: ghost}")) == 1
    failed = capsys.readouterr()
    assert failed.err.startswith("/gazebo/delete_model failed: ")
    assert yaml.safe_load(failed.out)["status_message"] in failed.err
    assert "'ghost'" in failed.err
    assert run(("service", "call", "/gazebo/get_model_state", "{model_name: ghost}")) == 1
    printed = yaml.safe_load(capsys.readouterr().out)
    assert printed.keys() == {"success", "status_message"}
    assert printed["success"] is False
    assert "did you mean '/gazebo/pause_physics'" in run_verb(
        capsys, "service", "call", "/gazebo/pause_phsics", status=2
    )


def test_parameters(running: Running, graph: GraphServer, capsys: Capture) -> None:
    run_verb(capsys, "param", "set", "/arm/gain", "2.5")
    run_verb(capsys, "param", "set", "names", "[a, b]")
    assert running.link.parameters["/arm/gain"] == 2.5
    assert "as in 0.5 or '[a, b]': " in run_verb(capsys, "param", "set", "names", "[a", status=2)
    assert run_verb(capsys, "param", "get", "/robot_description") == "<robot/>\n"
    assert "/arm/gain" in run_verb(capsys, "param", "list").splitlines()
    assert yaml.safe_load(run_verb(capsys, "param", "get", "names")) == ["a", "b"]
    assert "there is no parameter /arm/size" in run_verb(capsys, "param", "get", "/arm/size", status=2)
    assert "VALUE is empty" in run_verb(capsys, "param", "set", "names", "", status=2)
    assert "a number is too large" in run_verb(capsys, "param", "set", "names", "0x" + "f" * 5000, status=2)


def test_parameters_by_node_and_name(running: Running, graph: GraphServer, capsys: Capture) -> None:
    running.link.set_parameters({"/arm/gain": 2.5, "/slow": True})
    assert run_verb(capsys, "param", "get", "/arm", "gain") == "2.5\n"
    assert run_verb(capsys, "param", "get", "arm", "slow") == "true\n"  # /arm has no slow: /slow is used
    assert run_verb(capsys, "param", "list", "/arm") == "/arm/gain\n"
    assert run_verb(capsys, "param", "list", "/kbot") == run_verb(capsys, "param", "list")
    assert "no parameters below /leg/" in run_verb(capsys, "param", "list", "/leg", status=2)
    run_verb(capsys, "param", "set", "/arm", "names", "[a, b]")
    assert running.link.parameters["/arm/names"] == ["a", "b"]
    assert "one NODE and one NAME" in run_verb(capsys, "param", "get", "a", "b", "c", status=2)


def test_frames(running: Running, graph: GraphServer, capsys: Capture) -> None:
    first_lines = ["odom", "  base_footprint", "    base_link (static)"]
    # `tf tree` collects frames for one second: on a busy machine, /tf may not be published within it
    wait_until(lambda: run_verb(capsys, "tf", "tree").splitlines()[:3] == first_lines)
    echoed = run_verb(capsys, "tf", "echo", "base_footprint", "left_wheel", "--once", "--json")
    transform = running.simulation.robot.joints
    assert "left_wheel_joint" in transform
    pose = running.simulation.link_pose("base_footprint").inverse() @ running.simulation.link_pose(
        "left_wheel"
    )
    assert json.loads(echoed)["translation"] == pytest.approx(pose.translation.tolist(), abs=1e-4)
    wrong = run_verb(capsys, "tf", "echo", "odom", "base_lnik", status=2)
    assert "there is no frame 'base_lnik': did you mean 'base_link'" in wrong
