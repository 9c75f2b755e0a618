"""Tests the folder of a sweep: what it accepts, what it writes, and what it leaves."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from kbot.sweep.designs import Method
from kbot.sweep.folder import PLAN, opened_folder
from kbot.sweep.journal import Row
from kbot.sweep.objectives import Objective
from kbot.sweep.plan import Plan
from kbot.sweep.space import parse_space
from kbot.text import KbotError
from kbot.trials.pool import Task
from kbot.trials.scenario import RobotSource, Scenario

PLANNED = Plan(
    RobotSource("robot.xacro"),
    parse_space(["a=0.0:1.0"]),
    (Task(Scenario("drive", 1.0)),),
    (),
    Method.RANDOM,
    3,
    versions={"kbot": "1.0", "numpy": "2.1.0"},
)


@pytest.fixture
def out(tmp_path: Path) -> str:
    """A folder with one finished run."""
    folder = str(tmp_path / "out")
    with opened_folder(folder, PLANNED) as journal:
        journal.append(Row(0, 0, (0.5,), "drive", 0, True, None, "", {}))
    return folder


def test_a_robot_whose_file_name_is_not_unicode_can_be_continued(tmp_path: Path) -> None:
    plan = replace(PLANNED, robot=RobotSource("caf\udce9.xacro"))
    for _ in range(2):
        with opened_folder(str(tmp_path / "out"), plan) as journal:
            if 0 not in journal:
                journal.append(Row(0, 0, (0.5,), "drive", 0, True, None, "", {}))
            assert journal.count == 1


def test_the_description_is_written_only_if_it_changes(out: str) -> None:
    file = Path(out, PLAN)
    before = file.stat().st_ino  # a new file replaces the old one
    with opened_folder(out, PLANNED):
        assert file.stat().st_ino == before
    with opened_folder(out, replace(PLANNED, objectives=(Objective("energy"),))):
        assert "energy:min" in file.read_text()


def test_another_version_of_a_program_is_named(out: str) -> None:
    versions = {"kbot": "1.0", "numpy": "2.2.0"}
    with pytest.raises(KbotError) as raised, opened_folder(out, replace(PLANNED, versions=versions)):
        pass
    assert str(raised.value) == (
        f"{out} was begun with numpy 2.1.0. Now it would run with numpy 2.2.0, which may give other results. "
        "Install the earlier version, or choose another folder with --out"
    )


def test_a_folder_without_a_run_takes_another_sweep(tmp_path: Path) -> None:
    """An error or Ctrl-C before the first run must not reserve the folder."""
    folder = str(tmp_path / "out")
    with opened_folder(folder, PLANNED):
        pass
    with opened_folder(folder, replace(PLANNED, method=Method.LHS)) as journal:
        assert journal.count == 0


def test_a_folder_with_a_run_refuses_another_sweep(out: str) -> None:
    with (
        pytest.raises(KbotError, match="has another sweep: its method is random, not lhs"),
        opened_folder(out, replace(PLANNED, method=Method.LHS)),
    ):
        pass


def refused(folder: str, plan: Plan = PLANNED) -> str:
    with pytest.raises(KbotError) as raised, opened_folder(folder, plan):
        pass
    return str(raised.value)


@pytest.mark.parametrize("name", ["runs.jsonl", "results.parquet"])
def test_a_file_of_the_user_is_not_overwritten(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("mine")
    error = f"{tmp_path} has {name}, but not sweep.json. Choose another folder with --out"
    assert refused(str(tmp_path)) == error
    assert (tmp_path / name).read_text() == "mine"
    assert not (tmp_path / PLAN).exists()


@pytest.mark.parametrize("name", ["sweep.json", "runs.jsonl", "results.parquet", ".lock"])
def test_links_and_pipes_are_refused(name: str, out: str, tmp_path: Path) -> None:
    """A link would change a file elsewhere, and a pipe may never end."""
    file, elsewhere = Path(out, name), tmp_path / "elsewhere"
    file.unlink(missing_ok=True)
    file.symlink_to(elsewhere)
    assert refused(out) == f"{file} is a link. Choose another folder with --out"
    assert not elsewhere.exists()
    file.unlink()
    if hasattr(os, "mkfifo"):
        os.mkfifo(file)
        assert refused(out) == f"{file} is not a regular file. Choose another folder with --out"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "Expecting property name"),
        ("[" * 200_000, "it is nested too deeply"),
        ('{"schema": ' + "1" * 5000 + "}", "Exceeds the limit"),
        ("[]", "that this version of KBot can continue"),
        ('{"schema": 2, "designs": "3"}', "its 'designs' has the wrong type"),
        ('{"schema": 2, "versions": []}', "its 'versions' has the wrong type"),
    ],
)
def test_a_damaged_description_is_refused(text: str, reason: str, out: str) -> None:
    Path(out, PLAN).write_text(text)
    error = refused(out)
    assert error.startswith(f"{out}/sweep.json is not the description of a sweep")
    assert reason in error


def test_the_table_of_no_runs_does_not_reserve_the_folder(tmp_path: Path) -> None:
    """Ctrl-C before the first run writes an empty table."""
    with opened_folder(str(tmp_path), PLANNED):
        (tmp_path / "results.parquet").write_text("no rows")
    with opened_folder(str(tmp_path), replace(PLANNED, method=Method.LHS)) as journal:
        assert journal.count == 0
