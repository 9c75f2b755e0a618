"""Tests the command `kbot try`: exit status, table, JSON, reports, batteries, grades, and Ctrl-C."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner, Result

import kbot.cli.view
from kbot.cli import main
from kbot.cli.try_command import command as try_command
from kbot.text import KbotError
from kbot.trials.batteries import BATTERIES

DRIVE = """\
robot: kbot
duration: 3
steps:
  - command: {linear: 0.2}
  - at: 2
    command: {}
expect:
  - final_forward: {min: 0.39, max: 0.41}
  - never_touches
"""
NOT_A_REPORT = "exists and is not a report of this command. Choose another file, or delete this one"
TOO_FAST = DRIVE.replace("linear: 0.2", "linear: 0.3").replace("robot", "name: fast\nrobot")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with a scenario that passes."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drive.scenario.yaml").write_text(DRIVE)
    return tmp_path


def run(*words: str) -> Result:
    return CliRunner().invoke(try_command, list(words), catch_exceptions=False, standalone_mode=False)


def results(*words: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(run(*words, "--json").stdout)
    return found


def test_a_scenario_passes_and_its_state_is_the_same_again() -> None:
    result = run("drive.scenario.yaml", "-j", "1")
    assert result.return_value == 0
    first, last = result.stdout.splitlines()
    assert first == "✓ drive  final_forward 0.4 m"
    assert last.startswith("1 passed in ")
    assert not Path(".kbot").exists()
    found = results("drive.scenario.yaml", "-j", "2")
    assert found == results("drive.scenario.yaml")
    assert set(found) == {"schema", "passed", "failed", "scenarios"}
    assert (found["schema"], found["passed"], found["failed"]) == (1, 1, 0)
    (scenario,) = found["scenarios"]
    assert set(scenario) == {"name", "seed", "passed", "reason", "measures", "state_sha256"}
    assert (scenario["name"], scenario["seed"], scenario["passed"], scenario["reason"]) == (
        "drive",
        0,
        True,
        None,
    )
    assert scenario["measures"][1] == {
        "name": "contacts", "value": 0.0, "unit": "", "min": None, "max": 0.0, "passed": True,
    }  # fmt: skip


def test_a_failed_trial_has_a_reason_a_recording_and_reports(folder: Path) -> None:
    (folder / "fast.scenario.yaml").write_text(TOO_FAST)
    run("fast.scenario.yaml", "--junit", "junit.xml")
    result = run(".", "--junit", "junit.xml")  # overwrites the first report
    assert result.return_value == 1
    passed, failed, command, last = result.stdout.splitlines()
    assert passed == "✓ drive  final_forward 0.4 m"
    assert failed.startswith("✗ fast   final_forward is 0.6 m, above 0.41 m")
    assert last.startswith("1 passed, 1 failed in ")
    # the robot passes 0.41 m after 1.5 s, and the recording is opened one second before
    recording = Path(".kbot/trials/fast-seed0.mcap")
    words = command.split()
    assert words[:4] == ["kbot", "view", str(recording), "--at"]
    assert 0.3 < float(words[4]) < 0.8
    assert recording.is_file()
    assert Path(".kbot/.gitignore").read_text() == "*\n"
    suite = ElementTree.parse("junit.xml").getroot()[0]
    assert {name: suite.get(name) for name in ("tests", "failures", "errors", "skipped")} == {
        "tests": "2", "failures": "1", "errors": "0", "skipped": "0",
    }  # fmt: skip
    (failure,) = suite.iter("failure")
    assert failure.get("message", "").startswith("final_forward is 0.6 m, above 0.41 m")


def test_the_command_line_changes_robot_and_seeds(folder: Path) -> None:
    # a wheel that is twice as large as odometry believes is not possible: both follow the argument
    found = results("drive.scenario.yaml", "wheel_radius:=0.04", "--seed", "3", "--seed", "1")
    assert [(each["seed"], each["passed"]) for each in found["scenarios"]] == [(3, True), (1, True)]
    assert (
        found["scenarios"][0]["state_sha256"]
        != results("drive.scenario.yaml")["scenarios"][0]["state_sha256"]
    )
    wrong = results("drive.scenario.yaml", "wheel_raduis:=0.04")
    assert (
        "did you mean 'wheel_radius'?" in wrong["scenarios"][0]["reason"]
        or "wheel_raduis" in (wrong["scenarios"][0]["reason"])
    )


def test_an_unusable_scenario_counts_as_failed_and_the_others_run(folder: Path) -> None:
    (folder / "bad.scenario.yaml").write_text("name: odd\nrobot: kbot\nduration: 2\nexpct: []\n")
    result = run(".", "--json")
    assert result.return_value == 2
    assert "bad.scenario.yaml:4:1: error: unknown key 'expct' [T102]" in result.stderr
    found = json.loads(result.stdout)
    assert [(each["name"], each["passed"]) for each in found["scenarios"]] == [
        ("odd", False),
        ("drive", True),
    ]
    assert "bad.scenario.yaml:4:1" in found["scenarios"][0]["reason"]


def test_a_scenario_without_a_robot_needs_one(folder: Path) -> None:
    (folder / "any.scenario.yaml").write_text(DRIVE.replace("robot: kbot\n", ""))
    result = run(".")
    assert result.return_value == 2
    assert "any.scenario.yaml: the scenario 'any' names no robot. Add robot: FILE" in result.stderr
    assert "1 passed, 1 failed" in result.stdout
    assert run("kbot", "--battery", "any.scenario.yaml").return_value == 0


def test_a_robot_that_does_not_expand_is_one_line_and_the_others_run(folder: Path) -> None:
    (folder / "broken.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">\n  <link name="${gone}"/>\n</robot>\n'
    )
    (folder / "broken.scenario.yaml").write_text(DRIVE.replace("kbot", "broken.xacro"))
    result = run(".")
    assert result.return_value == 1
    assert "broken.xacro:2:" in result.stdout.splitlines()[0]
    assert "1 passed, 1 failed" in result.stdout


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["kbot"], "kbot is a robot. To try it with the built-in scenarios, use kbot try kbot --battery all"),
        (["robot.xacro"], "robot.xacro is a robot"),
        (["drive.scenario.yml"], "there is no file or folder drive.scenario.yml"),
        (["empty"], "empty contains no scenario file: their names end in"),
        (["notes.txt"], "notes.txt is not a scenario file"),
        ([], "PATH is missing"),
        (["drive.scenario.yaml", "--csv", "grades.csv"], "--csv writes a row for each robot"),
        (["drive.scenario.yaml", "--junit", "gone/junit.xml"], "the folder gone does not exist"),
        (["kbot", "--battery", "gone.scenario.yaml"], "there is no file or folder gone.scenario.yaml"),
    ],
)
def test_unusable_input_has_a_hint_and_still_an_object(folder: Path, words: list[str], reason: str) -> None:
    (folder / "empty").mkdir()
    (folder / "notes.txt").write_text("notes")
    (folder / "robot.xacro").write_text("<robot/>")
    program = [sys.executable, "-m", "kbot", "try", *words, "--json"]
    ended = subprocess.run(program, capture_output=True, text=True, encoding="utf-8")
    assert ended.returncode == 2
    assert reason in ended.stderr
    assert "Traceback" not in ended.stderr
    assert json.loads(ended.stdout) == {"schema": 1, "passed": 0, "failed": 0, "scenarios": []}


def test_a_file_is_a_battery_for_any_robot_and_grades_folders(folder: Path) -> None:
    good, broken, empty, several = (folder / "students" / name for name in ("ann", "bob", "cid", "dan"))
    for place in (good, broken, empty, several):
        place.mkdir(parents=True)
    urdf = Path(kbot.__file__).parent / "robots" / "kbot_description"
    shutil.copytree(urdf, good, dirs_exist_ok=True)
    (broken / "robot.urdf").write_text(
        '<robot name="bob">\n  <link name="a"/>\n  <link name="b"/>\n</robot>\n'
    )
    for name in ("one", "two"):
        (several / f"{name}.urdf").write_text('<robot name="dan"><link name="a"/></robot>')
    paths = [f"students/{name}/" for name in ("ann", "bob", "cid", "dan")]
    Path("grades.csv").write_text("name,grade\n")
    with pytest.raises(KbotError, match=f"grades.csv {NOT_A_REPORT}"):
        run("--battery", "drive.scenario.yaml", *paths, "--csv", "grades.csv")
    Path("grades.csv").unlink()
    run("--battery", "drive.scenario.yaml", paths[0], "--csv", "grades.csv")
    result = run("--battery", "drive.scenario.yaml", *paths, "--csv", "grades.csv")
    assert result.return_value == 1
    rows = list(csv.DictReader(Path("grades.csv").read_text("utf-8").splitlines()))
    assert [row["path"] for row in rows] == paths
    assert [(row["passed"], row["failed"], row["score"]) for row in rows] == [
        ("1", "0", "1.00"), ("0", "1", "0.00"), ("0", "1", "0.00"), ("0", "1", "0.00"),
    ]  # fmt: skip
    assert rows[0]["drive"] == "pass"
    assert "robot.urdf" in rows[1]["drive"]
    assert "contains no robot" in rows[2]["drive"]
    assert "2 robots. Choose one: students/dan/one.urdf, students/dan/two.urdf" in rows[3]["drive"]
    assert "✓ students/ann/: drive" in result.stdout


def test_batteries_are_tried_by_their_names() -> None:
    result = run("kbot", "--battery", "straight", "--battery", "standing_still", "-j", "2")
    assert result.return_value == 0
    assert [line.split()[:2] for line in result.stdout.splitlines()[:2]] == [
        ["✓", "straight"], ["✓", "standing_still"],
    ]  # fmt: skip
    assert {line.split()[0] for line in run("--list").stdout.splitlines()} == set(BATTERIES)
    assert run("kbot", "--battery", "all", "--list").stdout.splitlines()[0] == "straight"
    with pytest.raises(KbotError, match="there is no battery and no scenario file 'strait'"):
        run("kbot", "--battery", "strait")


def test_a_robot_that_cannot_drive_is_one_error_and_the_others_are_tried(folder: Path) -> None:
    (folder / "arm.urdf").write_text('<robot name="arm"><link name="a"/></robot>')
    result = run("arm.urdf", "--battery", "all")
    assert result.return_value == 2
    assert result.stderr.startswith("error: robot 'arm' cannot drive")
    assert result.stdout == ""
    assert results("arm.urdf", "--battery", "all")["failed"] == len(BATTERIES)
    result = run("arm.urdf", "kbot", "gone.urdf", "--battery", "standing_still")
    assert result.return_value == 1
    marks = [line.split("  ")[0] for line in result.stdout.splitlines()[:3]]
    assert marks == [
        "✗ arm.urdf: standing_still", "✓ kbot: standing_still", "✗ gone.urdf: standing_still"
    ]  # fmt: skip


def test_the_list_and_the_schema_run_nothing() -> None:
    assert (
        run("drive.scenario.yaml", "--list", "--seed", "0", "--seed", "2").stdout == "drive\ndrive (seed 2)\n"
    )
    assert json.loads(run("--schema").stdout)["title"] == "Scenario of KBot"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals of one process")
@pytest.mark.parametrize("ending", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_an_ending_reports_what_is_done(folder: Path, ending: str) -> None:
    (folder / "endless.py").write_text(
        "def drive(sim):\n    open('begun', 'w').close()\n    while True: pass\n"
    )
    (folder / "endless.scenario.yaml").write_text("robot: kbot\nduration: 9\nsteps: [{script: endless.py}]\n")
    program = [sys.executable, "-m", "kbot", "try", ".", "-j", "1", "--json", "--junit", "junit.xml"]
    running = subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not (folder / "begun").exists() and running.poll() is None:
        time.sleep(0.05)
    number = getattr(signal, ending)
    running.send_signal(number)
    running.send_signal(number)  # `timeout` sends a signal to the process, and again to its group
    out, err = running.communicate()
    assert running.returncode == 128 + number, err
    reasons = {each["name"]: each["reason"] for each in json.loads(out)["scenarios"]}
    assert reasons == {"drive": None, "endless": "KBot was interrupted before this trial ended"}
    suite = ElementTree.parse("junit.xml").getroot().find("testsuite")
    assert suite is not None
    assert (suite.get("tests"), suite.get("errors")) == ("2", "1")


def test_view_opens_only_recordings_at_a_time() -> None:
    with pytest.raises(KbotError, match="--at is a time in a recording, and kbot is not a recording"):
        CliRunner().invoke(
            kbot.cli.view.command, ["kbot", "--at", "3"], catch_exceptions=False, standalone_mode=False
        )


def test_batteries_that_a_robot_cannot_run_are_noted(shared: Path) -> None:
    folder = shared / "corpus/expected/ros-controls+ros2_control_demos/example_11/description/urdf"
    result = run(str(folder / "carlikebot.urdf.xacro.urdf"), "--battery", "all", "--list")
    assert "maze" not in result.stdout.split()
    assert "circle" in result.stdout.split()
    assert "'maze' does not apply: robot 'carlikebot_robot' steers" in result.stderr


def test_results_are_printed_if_a_report_cannot_be_written(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write(path: str, text: str) -> None:
        raise OSError(28, "No space left on device", path)

    monkeypatch.setattr("kbot.cli.try_command.write_text", write)
    result = run("drive.scenario.yaml", "--json", "--junit", "junit.xml")
    assert result.return_value == 2
    assert json.loads(result.stdout)["passed"] == 1
    assert "junit.xml: No space left on device" in result.stderr


def test_results_are_printed_if_recordings_cannot_be_written(folder: Path) -> None:
    (folder / "fast.scenario.yaml").write_text(TOO_FAST)
    (folder / ".kbot").touch()
    result = run("fast.scenario.yaml", "--json")
    assert result.return_value == 1
    assert json.loads(result.stdout)["failed"] == 1
    assert "failed trials are not recorded: .kbot" in result.stderr


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--keep", "drive.scenario.yaml"], "--keep takes a folder, and drive.scenario.yaml is a file"),
        (["--junit", "."], ". cannot be written: it is a folder"),
        (["--html", "drive.scenario.yaml"], f"drive.scenario.yaml {NOT_A_REPORT}"),
        (["--junit", "drive.scenario.yaml"], f"drive.scenario.yaml {NOT_A_REPORT}"),
        (
            ["--html", "a", "--junit", "a"],
            "two outputs of this command are the same file: a. Choose different files",
        ),
    ],
)
def test_unusable_outputs_are_reported_before_the_trials(words: list[str], error: str) -> None:
    with pytest.raises(KbotError) as refused:
        run("drive.scenario.yaml", *words)
    assert str(refused.value) == error
    assert Path("drive.scenario.yaml").read_text() == DRIVE


def test_ctrl_c_before_the_trials_prints_an_object(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kbot.cli.try_command._select", interrupted)
    assert main.run(["try", "drive.scenario.yaml", "--json"]) == 130
    assert json.loads(capsys.readouterr().out) == {"schema": 1, "passed": 0, "failed": 0, "scenarios": []}
