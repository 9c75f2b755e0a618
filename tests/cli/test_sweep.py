"""Tests the command `kbot sweep`: the table, exit status, JSON, interruptions, and wrong input."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
from click.testing import CliRunner, Result
from pyarrow import parquet

from kbot.cli import main
from kbot.cli.sweep import command as sweep_command
from kbot.sweep import sweep
from kbot.text import DescriptionError, KbotError
from kbot.text.extras import needs_extra
from kbot.text.notes import notes_sent_to
from kbot.trials import RobotSource, run_trial
from kbot.trials.scenario_file import read_scenarios
from kbot.trials.trial import load_source

XACRO = "http://www.ros.org/wiki/xacro"
TRIANGLE = """\
solid body
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 0.100 0 0
vertex 0 0.100 0
endloop
endfacet
endsolid body
"""
ROBOT = f"""\
<robot name="robot" xmlns:xacro="{XACRO}">
  <xacro:include filename="part.xacro"/>
  <link name="base_link">
    <visual><geometry><mesh filename="body.stl"/></geometry></visual>
    <collision><geometry><box size="0.100 0.1 0.1"/></geometry></collision>
    <inertial>
      <mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
</robot>
"""
SHORT = ("--scenario", "drive.scenario.yaml", "--out", "out")
RADII = ("--set", "wheel_radius=0.03,0.04")


@pytest.fixture(autouse=True)
def folder(drive_folder: Path) -> Path:
    return drive_folder


def edit(file: Path, old: str, new: str) -> None:
    file.write_text(file.read_text().replace(old, new))


def run(*words: str) -> Result:
    return CliRunner().invoke(
        sweep_command, [*words, "-j", "1"], catch_exceptions=False, standalone_mode=False
    )


def table() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = parquet.read_table("out/results.parquet").to_pylist()
    return found


def error(*words: str) -> str:
    """The error of a command that does not begin."""
    with pytest.raises(KbotError) as raised:
        run(*words)
    assert not Path("out", "runs.jsonl").exists()
    return str(raised.value)


def test_a_row_is_the_result_of_the_trial_with_these_values() -> None:
    words = (
        "kbot",
        *RADII,
        "--set",
        "wheel_mass=0.05,0.1",
        "--set",
        "scenario.steps.0.linear=0.1,0.2",
        "--set",
        "seed=3",
    )
    result = run(*words, *SHORT, "--objective", "energy")
    assert result.return_value == 0
    rows = table()
    assert [row["run"] for row in rows] == list(range(8))
    assert [(row["wheel_radius"], row["wheel_mass"]) for row in rows[:3]] == [
        (0.03, 0.05), (0.03, 0.05), (0.03, 0.1)
    ]  # fmt: skip
    assert {row["seed"] for row in rows} == {3}
    slow, fast = rows[4:6]
    assert (slow["passed"], fast["passed"]) == (False, True)
    assert slow["reason"].startswith("final_forward is 0.0")
    (scenario,) = read_scenarios("drive.scenario.yaml")
    robot = load_source(RobotSource("kbot", {"wheel_radius": "0.04"}, {"wheel_mass": "0.05"}))
    expected = run_trial(scenario, 3, robot, with_all_values=True)
    assert fast["state_sha256"] == expected.state_sha256
    for name, value in expected.all_values.items():
        assert fast[name] == (value if value == value else None), name


def test_a_finished_sweep_is_not_run_again_and_a_larger_one_continues() -> None:
    words = ("kbot", "--set", "wheel_radius=0.02:0.05", *SHORT, "--method", "random")
    run(*words, "--runs", "2")
    before, lines = table(), Path("out/runs.jsonl").read_bytes()
    run(*words, "--runs", "2")
    assert Path("out/runs.jsonl").read_bytes() == lines
    result = run(*words, "--runs", "3")
    assert "continuing: 2 of 3 runs are finished" in result.stderr
    assert Path("out/runs.jsonl").read_bytes().startswith(lines)
    assert table()[:2] == before
    assert len(table()) == 3


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--set", "wheel_radius=0.03,0.05"), "it varies wheel_radius=0.03,0.04, not wheel_radius=0.03,0.05"),
        ((*RADII, "--method", "random", "--runs", "2"), "its method is grid, not random"),
        ((*RADII, "wheel_width:=0.03"), "its robot is kbot, not kbot; wheel_width:=0.03."),
        ((*RADII, "--scenario", "straight"), "its scenarios are drive, seed 0, not straight, seed 0; drive"),
        ((*RADII, "--runs", "1"), "the number of its designs is 2, not 1"),
    ],
)
def test_a_folder_of_another_sweep(words: tuple[str, ...], expected: str) -> None:
    run("kbot", *RADII, *SHORT)
    before = Path("out/sweep.json").read_bytes()
    with pytest.raises(KbotError) as raised:
        run("kbot", *words, *SHORT)
    assert str(raised.value).startswith(f"out has another sweep: {expected}")
    assert "Choose another folder with --out, or delete this one" in str(raised.value)
    assert Path("out/sweep.json").read_bytes() == before


def test_a_scenario_that_was_edited_is_another_sweep(folder: Path) -> None:
    run("kbot", *RADII, *SHORT)
    edit(folder / "drive.scenario.yaml", "0.15", "0.16")
    with pytest.raises(
        KbotError, match="the files of the robot or of the scenario have changed since it began"
    ):
        run("kbot", *RADII, *SHORT)


@pytest.mark.parametrize("changed", ["robot.urdf.xacro", "part.xacro", "body.stl"])
def test_a_robot_that_was_edited_is_another_sweep(folder: Path, changed: str) -> None:
    """Its rows would mix two robots."""
    (folder / "robot.urdf.xacro").write_text(ROBOT)
    (folder / "part.xacro").write_text(f'<robot xmlns:xacro="{XACRO}"></robot>')
    (folder / "body.stl").write_text(TRIANGLE)
    words = ("robot.urdf.xacro", "--set", "world=empty", *SHORT)
    run(*words)
    (folder / changed).write_text((folder / changed).read_text().replace(">", "> ").replace("100", "101"))
    with pytest.raises(KbotError, match="the files of the robot or of the scenario have changed"):
        run(*words)


def test_a_value_that_the_robot_refuses_is_a_row_with_the_reason() -> None:
    result = run("kbot", "--set", "wheel_radius=0.04,abc", *SHORT, "--objective", "energy")
    assert result.return_value == 0
    fine, refused = table()
    assert fine["passed"]
    assert not refused["passed"]
    assert "'wheel_radius' is the text 'abc', not a number" in refused["reason"]
    assert refused["energy"] is None
    assert (
        run("kbot", "--set", "wheel_radius=abc", "--scenario", "straight", "--out", "bad").return_value == 1
    )


def test_json() -> None:
    result = run("kbot", *RADII, *SHORT, "--objective", "energy:max", "--objective", "wheel_radius", "--json")
    found = json.loads(result.stdout)
    assert found["runs"] == found["passed"] == 2
    assert found["objectives"] == {"energy": "maximize", "wheel_radius": "minimize"}
    assert found["table"] == str(Path("out/results.parquet"))
    rows = {row["run"]: row for row in table()}
    for best in found["best"]:
        row = rows[best["design"]]
        assert best["objectives"] == {"energy": row["energy"], "wheel_radius": row["wheel_radius"]}
        assert best["values"] == {"wheel_radius": row["wheel_radius"]}


def test_a_world_and_its_parameters() -> None:
    words = ("--set", "world=stairs:steps=2,height=0.01,empty", "--scenario", "drive.scenario.yaml")
    run("kbot", *words, "--out", "out")
    assert [row["world"] for row in table()] == ["stairs:steps=2,height=0.01", "empty"]
    run("kbot", "--set", "world.height=0.005,0.02", "--scenario", "step", "--out", "heights")
    low, high = parquet.read_table("heights/results.parquet").to_pylist()
    assert low["state_sha256"] != high["state_sha256"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--set", "wheel_radius=0.02:0.05"), "a grid needs the number of values, for example wheel"),
        ((*RADII, "--method", "lhs"), "--method lhs needs --runs N"),
        (
            (*RADII, "--set", "seed=1:3", "--method", "random", "--runs", "7"),
            "--runs 7 is more than the 6 combinations of these values. --method grid runs each of them once",
        ),
        ((*RADII, "--method", "lhs", "--runs", "3"), "--runs 3 is more than the 2 combinations"),
        (
            ("--set", "wheel_radius=0.03:0.04", "--method", "lhs", "--runs", "1000001"),
            "together, at most 1000000, not 1000001.",
        ),
        ((*RADII, "--method", "optimize", "--runs", "3"), "--method optimize needs --objective MEASURE"),
        ((*RADII, "--objective", "enrgy"), "unknown measure 'enrgy': did you mean 'energy'?"),
        ((*RADII, "--objective", "goal_time"), "no scenario measures it, because none has a goal"),
        ((*RADII, "--objective", "support/left_whel"), "measure it: did you mean 'support/left_wheel'?"),
        ((*RADII, "--scenario", "strait"), "there is no battery and no scenario file 'strait'"),
        ((*RADII, "--set", "scenario.step.0.linear=1,2"), "there is no 'step': did you mean 'steps'?"),
        ((*RADII, "--set", "world=mars"), "unknown world 'mars'"),
        ((*RADII, "--set", "world.height=1,2"), "world 'empty' has no parameter 'height'"),
        (
            ("--set", "wheel_radius=0.02:0.05:1000", "--set", "wheel_mass=0.1:1:1000", "--set", "seed=0:999"),
            "the sweep has 1000000000 runs (1000 x 1000 x 1000), which take about ",
        ),
    ],
)  # fmt: skip
def test_wrong_input_is_one_error_before_anything_runs(words: tuple[str, ...], expected: str) -> None:
    assert expected in error("kbot", *words, *SHORT)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((), "FILE is missing."),
        (RADII, "FILE is missing."),
        (("kbot",), "nothing varies. Add --set NAME=VALUES"),
        (("kbot", "--out", "out"), "nothing varies. Add --set NAME=VALUES"),
        (("kbot", *RADII), "no scenario is given. Add --scenario NAME|FILE"),
        (("kbot", *RADII, *SHORT[:2]), "--out DIR is missing"),
    ],
)
def test_the_first_missing_part_of_the_command_is_named(words: tuple[str, ...], expected: str) -> None:
    assert error(*words).startswith(expected)


def test_an_unknown_name_is_reported_with_the_nearest_names() -> None:
    with pytest.raises(
        DescriptionError, match=r"no argument or top-level property 'wheel_raduis'; the nearest"
    ):
        run("kbot", "--set", "wheel_raduis=0.03,0.04", *SHORT)


def test_the_folder_is_a_file(folder: Path) -> None:
    with pytest.raises(KbotError, match=r"--out takes a folder, and drive\.scenario\.yaml is a file"):
        run("kbot", *RADII, "--scenario", "straight", "--out", "drive.scenario.yaml")


def test_a_json_object_is_printed_after_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(["sweep", "kbot", "--json", *SHORT]) == 2
    assert json.loads(capsys.readouterr().out)["runs"] == 0


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    assert error("kbot", *RADII, *SHORT) == needs_extra("a sweep", "sweep")


def test_a_range_of_integers_is_noted() -> None:
    notes: list[str] = []
    with notes_sent_to(notes.append):
        run("kbot", "--set", "wheel_mass=0:1", *SHORT)
    assert "wheel_mass=0:1 has only integers. For all numbers, write 1.0 instead of 1" in notes
    assert [row["wheel_mass"] for row in table()] == [0, 1]


def test_ctrl_c_between_the_first_run_and_the_others_reports_the_first(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kbot.cli.sweep._executor", interrupted)
    words = ["kbot", "--set", "wheel_radius=0.03:0.05:9", *SHORT, "--objective", "slip", "-j", "1"]
    assert main.run(["sweep", *words, "--html", "r.html"]) == 130
    printed = capsys.readouterr()
    assert "interrupted after 1 of 9 runs. The same command continues\n" in printed.err
    assert "interrupted: nothing was written to r.html\n" in printed.err
    assert parquet.read_table("out/results.parquet").num_rows == 1


def test_ctrl_c_during_the_search_writes_the_table_once(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[object] = []

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kbot.sweep.runner.search", interrupted)
    monkeypatch.setattr("kbot.sweep.runner.Sweep.write_finished", lambda sweep: written.append(sweep))
    words = ["kbot", "--set", "wheel_radius=0.03:0.05:9", *SHORT, "--objective", "slip", "-j", "1"]
    assert main.run(["sweep", *words]) == 130
    assert len(written) == 1


def test_the_function_gives_the_same_table_as_the_command() -> None:
    words = ("kbot", "--set", "wheel_radius=0.03:0.05", *SHORT, "--method", "lhs", "--runs", "2")
    run(*words, "--objective", "slip")
    path = sweep(
        "kbot",
        {"wheel_radius": "0.03:0.05"},
        "drive.scenario.yaml",
        "of_function",
        objectives="slip",
        method="lhs",
        runs=2,
        jobs=2,
    )
    assert path.read_bytes() == Path("out/results.parquet").read_bytes()
    with pytest.raises(KbotError, match="unknown method 'lsh'"):
        sweep("kbot", {"wheel_radius": [0.03, 0.04]}, "straight", "other", method="lsh")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT and SIGKILL of one process")
def test_ctrl_c_and_kills_lose_nothing_and_the_same_command_continues(folder: Path) -> None:
    edit(folder / "drive.scenario.yaml", "duration: 1", "duration: 5")
    words = ["kbot", "--set", "wheel_radius=0.02:0.05:24", "--scenario", "drive.scenario.yaml"]
    words += ["--objective", "energy"]
    command = [sys.executable, "-m", "kbot", "sweep", *words, "-j", "1", "--out", "killed"]
    journal = folder / "killed" / "runs.jsonl"

    def begin(rows: int) -> subprocess.Popen[bytes]:
        """Start the command, and wait until this many runs are finished."""
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        while not journal.exists() or journal.read_bytes().count(b"\n") < rows:
            assert process.poll() is None, process.stderr and process.stderr.read()
            time.sleep(0.01)
        return process

    first = begin(1)
    first.send_signal(signal.SIGINT)
    printed, errors = first.communicate()
    assert first.returncode == 130
    done = journal.read_bytes().count(b"\n")
    assert b"interrupted after %d of 24 runs. The same command continues" % done in errors
    assert b"lowest energy so far, after %d of 24 runs:\n" % done in printed
    assert b"Traceback" not in errors
    assert parquet.read_table("killed/results.parquet").num_rows == done

    second = begin(done + 1)
    second.kill()
    second.communicate()

    third = begin(done + 2)
    with pytest.raises(KbotError, match="another process runs the sweep in killed"):
        run(*words, "--out", "killed")
    started = psutil.Process(third.pid).children()  # also the guard, which ends what is left of a killed KBot
    (worker,) = [each for each in started if "kbot.worker.child" in " ".join(each.cmdline())]
    worker.kill()
    _, errors = third.communicate()
    assert third.returncode == 0, errors

    run(*words, "--out", "whole")
    assert (folder / "killed/results.parquet").read_bytes() == (folder / "whole/results.parquet").read_bytes()
    assert journal.read_bytes().count(b"\n") == 24
