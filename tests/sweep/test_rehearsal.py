"""Tests what the first runs of a sweep show before the others begin: their time, and the objectives."""

from __future__ import annotations

import itertools
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner, Result
from pyarrow import parquet

from kbot.cli.sweep import command as sweep_command
from kbot.sweep import rehearsal
from kbot.text import KbotError
from kbot.text.notes import notes_sent_to
from kbot.trials.pool import run_tasks
from kbot.trials.results import TrialResult

CASTER = """\
<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="has_caster" default="false"/>
  <xacro:macro name="part" params="name radius">
    <link name="${name}">
      <collision><geometry><sphere radius="${radius}"/></geometry></collision>
      <inertial>
        <mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
      </inertial>
    </link>
  </xacro:macro>
  <xacro:part name="base_link" radius="0.1"/>
  <xacro:if value="$(arg has_caster)">
    <xacro:part name="caster" radius="0.15"/>
    <joint name="caster_joint" type="fixed"><parent link="base_link"/><child link="caster"/></joint>
  </xacro:if>
</robot>
"""
OUT = ("--out", "out")
LONG = ("--scenario", "long.scenario.yaml")
SHORT = ("--scenario", "drive.scenario.yaml")


@pytest.fixture(autouse=True)
def folder(drive_folder: Path) -> Path:
    """The working directory, with scenarios of one second and of 100 seconds."""
    drive = (drive_folder / "drive.scenario.yaml").read_text()
    (drive_folder / "long.scenario.yaml").write_text(drive.replace("duration: 1", "duration: 100"))
    (drive_folder / "stand.scenario.yaml").write_text("duration: 1\nexpect:\n  - final_forward: {max: 0.1}\n")
    (drive_folder / "caster.xacro").write_text(CASTER)
    return drive_folder


@pytest.fixture
def rehearsed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of runs of each rehearsal, none of which is simulated. Each rehearsal takes 100 s."""
    counts: list[int] = []

    def run(pool: object, tasks: Any, **options: object) -> list[TrialResult]:
        counts.append(len(tasks))
        return [TrialResult(task.scenario.name, task.seed) for task in tasks]

    clock = SimpleNamespace(perf_counter=itertools.count(0.0, 100.0).__next__)
    monkeypatch.setattr(rehearsal, "time", clock)
    monkeypatch.setattr(rehearsal, "run_tasks", run)
    return counts


def run(*words: str) -> Result:
    return CliRunner().invoke(
        sweep_command, [*words, "-j", "1"], catch_exceptions=False, standalone_mode=False
    )


def error(*words: str) -> str:
    with pytest.raises(KbotError) as raised:
        run(*words)
    return str(raised.value)


def test_fewer_than_a_thousand_long_runs_must_be_confirmed(rehearsed: list[int]) -> None:
    """900 runs of 100 s take 25 hours."""
    found = error("kbot", "--set", "wheel_radius=0.02:0.05:900", *LONG, *OUT)
    expected = "the sweep has 900 runs, which take about 1 day on this machine. Add --yes to run it anyway"
    assert found == expected
    assert rehearsed == [1]
    assert not Path("out", "sweep.json").exists()


def test_the_duration_of_the_scenario_may_vary(rehearsed: list[int]) -> None:
    dimensions = ("--set", "wheel_radius=0.02:0.05:450", "--set", "scenario.duration=1,100")
    assert "the sweep has 900 runs (450 x 2), which take about 1 day" in error(
        "kbot", *dimensions, *SHORT, *OUT
    )


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((), "1800 runs (30 x 30 designs x 2 runs), which take about 2 days"),
        (("--runs", "880"), "1760 runs (880 designs x 2 runs), which take about 2 days"),
    ],
)
def test_the_printed_product_is_the_number_of_runs(
    words: tuple[str, ...], expected: str, rehearsed: list[int]
) -> None:
    dimensions = ("--set", "wheel_radius=0.02:0.05:30", "--set", "wheel_mass=0.1:0.5:30")
    assert f"the sweep has {expected} " in error("kbot", *dimensions, *LONG, *SHORT, *OUT, *words)


def test_only_missing_runs_count(rehearsed: list[int]) -> None:
    words = ("kbot", "--set", "wheel_radius=0.02:0.05", "--method", "random", *SHORT, *OUT)
    run(*words, "--runs", "2")
    expected = "the sweep has 100003 runs, and 100001 of them are missing. They take about 116 days on"
    assert error(*words, "--runs", "100003").startswith(expected)
    assert rehearsed == [1]


def test_another_sweep_and_a_finished_one_simulate_nothing(rehearsed: list[int]) -> None:
    words = ("kbot", "--set", "wheel_radius=0.03,0.04", *SHORT, *OUT, "--objective", "support/left_wheel")
    run(*words)
    rehearsed.clear()
    run(*words)
    assert "has another sweep" in error(*words, "--set", "wheel_mass=0.1,0.2")
    assert rehearsed == []


def test_rehearsed_runs_are_not_run_again(monkeypatch: pytest.MonkeyPatch) -> None:
    rehearsed: list[int] = []

    def counted(pool: Any, tasks: Any, **options: Any) -> list[TrialResult | None]:
        rehearsed.append(len(tasks))
        return run_tasks(pool, tasks, **options)

    monkeypatch.setattr(rehearsal, "run_tasks", counted)
    words = ("kbot", "--set", "wheel_radius=0.03,0.04", "--set", "seed=0,1")
    run(*words, *SHORT, "--scenario", "straight", "--objective", "energy", *OUT)
    assert rehearsed == [2], "the first run of each scenario"
    run(*words, *SHORT, "--scenario", "straight", "--out", "without")
    assert rehearsed == [2]
    assert Path("out/runs.jsonl").read_bytes().count(b"\n") == 8
    assert parquet.read_table("out/results.parquet").equals(parquet.read_table("without/results.parquet"))


@pytest.mark.parametrize("values", ["true,false", "false,true"])
def test_a_part_of_only_some_designs_is_an_objective(values: str) -> None:
    words = ("caster.xacro", "--set", f"has_caster={values}", "--scenario", "stand.scenario.yaml")
    with notes_sent_to(lambda text: None):
        assert run(*words, "--objective", "support/caster:max", *OUT).return_value == 0
    rows = {row["has_caster"]: row for row in parquet.read_table("out/results.parquet").to_pylist()}
    assert rows["true"]["support/caster"] == pytest.approx(2 * 9.81, rel=0.01)  # m g of both links
    assert rows["false"]["support/caster"] is None
    assert "support/cster" in error(*words, "--objective", "support/cster", "--out", "other")


def test_an_objective_without_a_value_is_reported_before_the_other_runs() -> None:
    notes: list[str] = []
    with notes_sent_to(notes.append):
        run("kbot", "--set", "wheel_radius=0.03,0.04", "--scenario", "stand.scenario.yaml", *OUT,
            "--objective", "slip", "--objective", "energy")  # fmt: skip
    expected = (
        "--objective slip: the first design has no value of it. A design without one cannot be the best"
    )
    assert [note for note in notes if "--objective" in note] == [expected]
