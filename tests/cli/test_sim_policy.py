"""`kbot sim --policy`: a policy drives the robot, headless and in the page."""

import json
from pathlib import Path

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from kbot.cli.main import run
from kbot.learn.interface.policy_interface import PolicyInterface
from kbot.learn.policies.policy import save_policy
from kbot.messages import Header, Point, Pose, Quaternion, String
from kbot.messages.navigation import PoseStamped
from kbot.sim import Simulation

ROBOT = ("sim", "kbot", "lidar:=true")


def constant(interface: PolicyInterface) -> bytes:
    """A network that returns 0 for each speed."""
    inputs, outputs = len(interface.inputs), len(interface.actions)
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["seen", "zeros"], ["action"])],
        "constant",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, [1, inputs])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, outputs])],
        [numpy_helper.from_array(np.zeros((inputs, outputs), np.float32), "zeros")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    data: bytes = model.SerializeToString()
    return data


def test_a_policy_drives_to_a_goal(straight_policy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = (*ROBOT, "--headless", "--world", "rooms", "--policy", str(straight_policy), "--goto", "0.6,-0.5")
    assert run([*words, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    navigation = report["navigation"]
    assert navigation["state"] == "reached"
    assert navigation["map"] == "none"
    assert navigation["goal"] == {"x": 0.6, "y": -0.5, "yaw": None}
    assert navigation["off_m"] < 0.2
    assert not navigation["collided"]
    assert run([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["state_sha256"] == report["state_sha256"]
    assert run(words) == 0
    text = capsys.readouterr().out
    assert text.startswith("goal        reached in ")
    assert "m straight\n" in text


def test_a_goal_that_is_not_reached_is_status_1(
    straight_policy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--headless", "--policy", str(straight_policy), "--goto", "2,0")
    assert run([*ROBOT, *words, "--duration", "1"]) == 1
    assert "stuck: out of time: not at the goal after 1.1 s" in capsys.readouterr().out
    assert run([*ROBOT, *words, "--arrive", "1.5"]) == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--headless"], "--policy with --headless needs --goto or a bridge such as --ros1"),
        (["--headless", "--rosbridge", "--script", "drive.py"], "--policy drives the robot. Remove --script"),
        (["--headless", "--rosbridge", "--no-map"], "--policy drives without a map. Remove --no-map"),
        (["--headless", "--goto", "1,1,0"], "--policy does not turn the robot at the goal. Remove YAW"),
        (["--goto", "1,1,0"], "--policy does not turn the robot at the goal. Remove YAW"),
        (["--headless", "--goto", "1,1", "--no-map"], "--policy drives without a map. Remove --no-map"),
        (
            ["--headless", "--goto", "1,1", "--max-speed", "1,1"],
            "has its own highest speeds. Remove --max-speed",
        ),
        (
            ["--headless", "--goto", "1,1", "--arrive", "0"],
            "--arrive takes a finite number of metres above 0",
        ),
        (["--arrive", "nan"], "--arrive takes a finite number of metres above 0"),
        (["--headless", "--goto", "1,1", "--cmd-vel", "0.1,0"], "--goto drives the robot. Remove --cmd-vel"),
        (["--script", "drive.py"], "--policy drives the robot. Remove --script"),
        (["--duration", "3"], "--duration needs --headless"),
        (["--max-speed", "1,1"], "has its own highest speeds. Remove --max-speed"),
    ],
)
def test_options_that_do_not_go_together_are_errors(
    straight_policy: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    assert run([*ROBOT, "--policy", str(straight_policy), *words]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--headless", "--goto", "1,0"], []])
def test_an_unusable_policy_is_one_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    file = tmp_path / "text.onnx"
    file.write_text("a policy")
    assert run([*ROBOT, "--policy", str(file), *words]) == 2
    assert capsys.readouterr().err == f"error: policy {file}: is not an ONNX file\n"
    assert run([*ROBOT, "--policy", str(tmp_path / "none.onnx"), *words]) == 2
    assert "none.onnx cannot be read: No such file or directory" in capsys.readouterr().err


UNFIT = "error: the policy sees obstacles with a lidar, but robot 'kbot' declares no level lidar"


@pytest.mark.parametrize(
    "words",
    [
        ["--headless", "--goto", "1,0"],
        ["--headless", "--rosbridge"],
        ["--port", "0", "--no-browser"],
        ["--port", "0", "--no-browser", "--goto", "1,0"],
    ],
)
def test_a_robot_that_does_not_fit_is_one_error(
    straight_policy: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
) -> None:
    monkeypatch.setattr("kbot.workbench.serve.serve_session", lambda *_: pytest.fail("the page is served"))
    assert run(["sim", "kbot", "--policy", str(straight_policy), *words]) == 2
    assert UNFIT in capsys.readouterr().err


def test_a_policy_that_follows_paths_is_one_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    interface = PolicyInterface("path", linear=(0.0, 0.3), angular=(-2.0, 2.0))
    save_policy(constant(interface), interface, tmp_path / "follow.onnx")
    assert run([*ROBOT, "--policy", str(tmp_path / "follow.onnx"), "--port", "0", "--no-browser"]) == 2
    assert "error: the policy follows a path, and cannot drive to a goal" in capsys.readouterr().err


def test_goals_of_a_bridge_use_the_policy(
    straight_policy: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A goal on `goal_pose`, as rviz publishes it."""
    goal = PoseStamped(Header(frame_id="map"), Pose(Point(0.6, -0.5, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0)))
    reports = []

    def drive(simulation: Simulation, *_: object, **__: object) -> int:
        simulation.bus.subscribe("/navigation_status", String, lambda each: reports.append(each.data))
        simulation.bus.publish("/goal_pose", goal)
        simulation.run(5.0)
        return 0

    monkeypatch.setattr("kbot.cli.sim.command.run_headless", drive)
    words = ("--headless", "--world", "rooms", "--rosbridge", "--policy", str(straight_policy))
    assert run([*ROBOT, *words]) == 0, capsys.readouterr().err
    assert reports[-2:] == ["driving", "reached"]


def test_speeds_that_the_robot_cannot_reach_are_one_finding(
    tmp_path: Path, straight_policy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    interface = PolicyInterface("goal", linear=(0.0, 2.0), angular=(-20.0, 20.0))
    save_policy(constant(interface), interface, tmp_path / "fast.onnx")
    words = ("--headless", "--goto", "1,0", "--duration", "0.1")
    assert run([*ROBOT, "--policy", str(tmp_path / "fast.onnx"), *words]) == 1
    (finding,) = (line for line in capsys.readouterr().err.splitlines() if "commands" in line)
    assert finding.startswith("info: the policy commands up to 2 m/s, but robot 'kbot' only reaches 1 m/s")
    run([*ROBOT, "--policy", str(tmp_path / "fast.onnx"), *words, "--json"])
    assert [each["code"] for each in json.loads(capsys.readouterr().out)["findings"]] == ["W308"]
    assert run([*ROBOT, "--policy", str(straight_policy), *words]) == 1
    assert "policy" not in capsys.readouterr().err
