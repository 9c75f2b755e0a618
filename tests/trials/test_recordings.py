"""Recordings of failed trials: which trials have one, their files, and that the run is the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from kbot.trials import Bound, Command, RobotSource, Scenario, Step, TrialResult
from kbot.trials.pool import Pool, Task, run_task, run_tasks
from kbot.trials.recordings import record_failures

SHORT = Scenario(
    "a / short", 0.5, [Step(Command(0.2))], [Bound("final_forward", max=0.01)], RobotSource("kbot")
)


def test_failed_trials_are_recorded_as_they_ran(tmp_path: Path) -> None:
    passes = replace(SHORT, name="passes", expect=[Bound("final_forward", min=0.01)])
    tasks = [Task(SHORT, 3), Task(passes), Task(SHORT, 3), Task(SHORT, error="cannot run")]
    with Pool(1) as pool:
        results = [result for result in run_tasks(pool, tasks) if result is not None]
        recorded = record_failures(pool, tasks, results, tmp_path / "kept")
    assert [Path(each.recording).name for each in recorded] == [
        "a_short-seed3.mcap", "", "a_short-seed3~2.mcap", "",
    ]  # fmt: skip
    assert [replace(each, recording="") for each in recorded] == [replace(each) for each in results]
    again = run_task((replace(tasks[0], record=str(tmp_path / "again.mcap")), 60.0))
    assert again.state_sha256 == results[0].state_sha256


@pytest.mark.parametrize("result", [TrialResult("own", 0, error="ended its process"), TrialResult("own", 0)])
def test_nothing_is_written_if_nothing_can_be_recorded(tmp_path: Path, result: TrialResult) -> None:
    with Pool(1) as pool:
        assert record_failures(pool, [Task(SHORT)], [result], tmp_path / "kept") == [result]
    assert not (tmp_path / "kept").exists()


def test_recordings_of_several_robots_have_the_robot_in_their_names(tmp_path: Path) -> None:
    tasks = [Task(SHORT, robot="students/ann/"), Task(SHORT, robot="students/bob/")]
    results = [TrialResult("a / short", 0, state_sha256="1", failed_at=0.3)] * 2
    with Pool(2) as pool:
        recorded = record_failures(pool, tasks, results, tmp_path)
    assert [Path(each.recording).name for each in recorded] == [
        "students_ann_-a_short-seed0.mcap", "students_bob_-a_short-seed0.mcap",
    ]  # fmt: skip
