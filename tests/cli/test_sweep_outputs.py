"""Tests what `kbot sweep` writes after the runs: the report and the best design."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from pyarrow import parquet

from kbot.cli import main
from kbot.cli.sweep import command as sweep_command
from kbot.sweep.journal import Journal, Row
from kbot.text import KbotError
from kbot.text.extras import needs_extra
from kbot.text.notes import notes_sent_to
from kbot.trials import RobotSource, run_trial
from kbot.trials.scenario_file import read_scenarios
from kbot.trials.trial import load_source

SWEEP = (
    "kbot",
    *("--set", "wheel_radius=0.03,0.04"),
    *("--scenario", "drive.scenario.yaml"),
    *("--out", "out"),
    *("-j", "1"),
)
RADIUS = ("--objective", "wheel_radius")


@pytest.fixture(autouse=True)
def folder(drive_folder: Path) -> Path:
    return drive_folder


def run(*words: str) -> Result:
    return CliRunner().invoke(sweep_command, [*SWEEP, *words], catch_exceptions=False, standalone_mode=False)


def refused(*words: str) -> str:
    with pytest.raises(KbotError) as raised:
        run(*words)
    return str(raised.value)


def test_the_best_design_is_shown_and_written() -> None:
    """The lowest radius is the best, as the objective is the radius itself."""
    result = run(*RADIUS, "--write", "best.xacro", "--html", "report.html")
    assert result.return_value == 0
    assert "wheel_radius: 0.035 → 0.03 (" in result.stderr
    assert "wrote design 0: best.xacro" in result.stderr
    assert 'name="wheel_radius" default="0.03"' in Path("best.xacro").read_text("utf-8")
    (scenario,) = read_scenarios("drive.scenario.yaml")
    with notes_sent_to(lambda text: None):  # the note about the shipped package
        again = run_trial(scenario, 0, load_source(RobotSource("best.xacro")))
    simulated = parquet.read_table("out/results.parquet")["state_sha256"][0].as_py()
    assert again.state_sha256 == simulated
    report = Path("report.html").read_text("utf-8")
    assert "Run of design 0" in report
    assert "data:image/webp" in report or "There is no film" in report


def test_the_finished_runs_are_read_once_for_the_table_and_once_for_the_results(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A million runs have gigabytes of measures."""
    reads: list[Journal] = []
    rows = Journal.rows

    def counted(journal: Journal) -> Iterator[Row]:
        reads.append(journal)
        return rows(journal)

    monkeypatch.setattr(Journal, "rows", counted)
    result = run(*RADIUS, "--write", "best.xacro", "--html", "report.html")
    assert "2 passed, 0 failed in" in result.stdout
    assert len(reads) == 2


def test_existing_files_are_overwritten_only_if_the_user_agrees(folder: Path) -> None:
    (folder / "best.xacro").write_text("mine")
    error = "best.xacro exists. Add --yes to overwrite it, or --diff to see the changes"
    assert refused(*RADIUS, "--write", "best.xacro") == error
    assert not (folder / "out").exists()
    result = run(*RADIUS, "--write", "best.xacro", "--diff")
    assert '-  <xacro:arg name="wheel_radius" default="0.035"/>' in result.stdout
    assert '+  <xacro:arg name="wheel_radius" default="0.03"/>' in result.stdout
    assert (folder / "best.xacro").read_text() == "mine"
    run(*RADIUS, "--write", "best.xacro", "--yes")
    assert 'default="0.03"' in (folder / "best.xacro").read_text()


def test_one_of_several_best_designs_is_chosen() -> None:
    both = ("--objective", "wheel_radius:max", "--objective", "energy")
    assert refused(*both, "--write", "best.xacro").startswith(
        "2 designs are best. Choose one with --design N: "
    )
    assert not Path("best.xacro").exists()
    assert refused(*both, "--write", "best.xacro", "--design", "7").startswith(
        "design 7 is not one of the best."
    )
    result = run(*both, "--write", "best.xacro", "--design", "1")
    assert "wrote design 1: best.xacro" in result.stderr


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--write", "best.xacro"), "--write needs --objective MEASURE"),
        ((*RADIUS, "--write", "nowhere/best.xacro"), "the folder nowhere does not exist"),
        (("--html", "nowhere/report.html"), "the folder nowhere does not exist"),
        (("--html", "drive.scenario.yaml"), "drive.scenario.yaml exists and is not a report"),
        ((*RADIUS, "--html", "a", "--write", "./a"), "two outputs of this command are the same file: ./a"),
        ((*RADIUS, "--diff"), "--diff shows the changes of --write FILE, which is missing"),
        ((*RADIUS, "--design", "1"), "--design chooses what --write and --html show"),
        (("--on", "somewhere"), "--on somewhere is not the address of a cluster"),
    ],
)
def test_what_cannot_be_written_is_an_error_before_the_runs(words: tuple[str, ...], error: str) -> None:
    assert error in refused(*words)
    assert not Path("out", "runs.jsonl").exists()


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "ray", None)
    assert refused("--on", "ray") == needs_extra("--on ray", "ray")


def test_a_folder_in_place_of_a_file_is_reported_before_the_runs(folder: Path) -> None:
    (folder / "results").mkdir()
    assert refused("--html", "results") == "results cannot be written: it is a folder"
    assert not (folder / "out").exists()


def test_the_json_is_printed_once_if_a_later_output_fails(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = ["sweep", *SWEEP, "--json", "--objective", "wheel_radius:max", "--objective", "energy"]
    assert main.run([*words, "--write", "best.xacro"]) == 2  # two designs are best
    printed = capfd.readouterr().out
    assert json.loads(printed)["passed"] == 2


@pytest.mark.parametrize("name", ["results.parquet", "runs.jsonl", "sweep.json"])
def test_the_files_of_the_folder_are_not_overwritten(name: str, folder: Path) -> None:
    (folder / "out").mkdir()
    assert refused("--html", f"out/{name}").startswith("two outputs of this command are the same file")
    assert refused(*RADIUS, "--write", f"out/{name}", "--yes").startswith("two outputs of this command are")


def test_a_report_is_overwritten_by_the_next_one() -> None:
    for _ in range(2):
        assert run("--html", "report.html").return_value == 0


def test_an_empty_name_is_not_a_folder() -> None:
    assert refused("--out", "").startswith("--out DIR is missing")
