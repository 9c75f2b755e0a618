"""`kbot sim --policy`: a policy drives the robot, headless and in the page."""

import json
from pathlib import Path

import pytest

from kbot.cli.main import run

ROBOT = ("sim", "kbot", "lidar:=true")


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
        (["--headless"], "--policy with --headless needs --goto"),
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


def test_a_robot_that_does_not_fit_is_one_error(
    straight_policy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["sim", "kbot", "--headless", "--policy", str(straight_policy), "--goto", "1,0"]) == 2
    message = "error: the policy sees obstacles with a lidar, but robot 'kbot' declares no level lidar"
    assert message in capsys.readouterr().err
