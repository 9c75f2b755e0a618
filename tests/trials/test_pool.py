"""Trials in parallel processes: their order, their limits, and Ctrl-C."""

from __future__ import annotations

import os
import re
import signal
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from kbot.record.run_outputs import RunOutputs
from kbot.text import KbotError
from kbot.text.notes import notes_sent_to
from kbot.trials import Bound, Command, RobotSource, RunScript, Scenario, Step, run_trial
from kbot.trials.pool import FILM_SECONDS, Pool, Task, run_tasks
from kbot.trials.recordings import record_failures
from kbot.trials.results import TrialResult
from kbot.trials.scenario_file import python_scenarios

KBOT = RobotSource("kbot")
SHORT = Scenario("short", 0.2, [Step(Command(0.2))], [Bound("final_forward", 0.0)], KBOT)


def scripted(folder: Path, name: str, text: str) -> Task:
    """A trial that runs a script."""
    path = folder / f"{name}.py"
    path.write_text(text)
    return Task(Scenario(name, 5.0, [Step(RunScript(str(path)))], robot=KBOT))


def test_the_time_limit_is_that_of_the_duration_that_runs() -> None:
    """30 s, and 2 s for each simulated second."""
    task = Task(replace(SHORT, duration=6.0))
    assert task.limit() == 42.0
    assert replace(task, keys={"duration": 1000}).limit() == 2030.0
    assert replace(task, keys={"duration": "long"}).limit() == 42.0, "the run reports the wrong value"
    assert replace(task, keys={"steps.0.linear": 0.1}).limit() == 42.0


def test_a_film_may_take_longer_than_the_run() -> None:
    task = Task(replace(SHORT, duration=6.0), with_film=True)
    assert task.limit() == 42.0 + FILM_SECONDS
    assert task.limit(5.0) == 5.0 + FILM_SECONDS
    assert replace(task, with_film=False).limit(5.0) == 5.0


def test_results_are_in_order_and_equal_to_those_of_this_process() -> None:
    long = replace(SHORT, name="long", duration=3.0)
    tasks = [Task(long), Task(SHORT), Task(SHORT, seed=1)]
    order: list[int] = []
    with Pool(2) as pool:
        results = run_tasks(pool, tasks, lambda index, result: order.append(index))
    assert [(r.name, r.seed) for r in results if r] == [("long", 0), ("short", 0), ("short", 1)]
    assert sorted(order) == [0, 1, 2]
    assert results[0] is not None
    assert results[0].state_sha256 == run_trial(long).state_sha256


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "def drive(sim):\n    while True:\n        pass\n",
            r"script\.py:[23]: the trial took longer than 3 s and was stopped here",
        ),
        (
            "def drive(sim):\n    sum(iter(int, 1))\n",
            r"the trial took longer than 3 s and was stopped\. --limit-time raises the limit",
        ),
        ("import os\ndef drive(sim):\n    os._exit(3)\n", "the trial ended its process, with status 3"),
        (
            "def drive(sim):\n    sim.run(1)\n    1 / 0\n",
            r"script\.py:3: ZeroDivisionError: division by zero",
        ),
        (
            "def drive(sim):\n    raise KeyboardInterrupt\n",
            r"script\.py:2: KeyboardInterrupt",
        ),
        ("def drive(sim):\n    raise ValueError('x' * 100_000)\n", r"ValueError: x+…$"),
    ],
    ids=["endless", "in C", "exit", "error", "interrupt", "long error"],
)
def test_a_script_that_fails_is_one_line_and_the_others_continue(
    tmp_path: Path, text: str, reason: str
) -> None:
    with Pool(1) as pool:
        bad, good = run_tasks(pool, [scripted(tmp_path, "script", text), Task(SHORT)], limit=3.0)
    assert bad is not None
    assert not bad.passed
    assert re.search(reason, bad.error)
    assert "\n" not in bad.error
    # a cut line has 2000 characters and the ellipsis, however long the path of the script is
    assert bad.error.endswith("…") == (len(bad.error) == 2001)
    assert good is not None
    assert good.passed, good.reason


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT of one process")
def test_ctrl_c_returns_what_is_done(tmp_path: Path) -> None:
    endless = scripted(tmp_path, "endless", "def drive(sim):\n    while True:\n        pass\n")
    interrupt: Callable[[int, object], object] = lambda index, result: threading.Timer(  # noqa: E731
        0.1, signal.raise_signal, (signal.SIGINT,)
    ).start()
    with Pool(1) as pool:
        first, second, third = run_tasks(pool, [Task(SHORT), endless, Task(SHORT)], interrupt)
    assert pool.interrupted
    assert first is not None
    assert (second, third) == (None, None)


def test_a_python_file_is_loaded_again_in_each_process(tmp_path: Path) -> None:
    path = tmp_path / "functions.py"
    path.write_text(
        "from kbot.trials import *\n"
        "own = Scenario('own', 1.0, [Step(RunScript(lambda sim: sim.cmd_vel(0.2, 0.0)))],\n"
        "    [Check('way', lambda trace: trace['forward'][-1], 0.1)], RobotSource('kbot'))\n"
    )
    (found,) = python_scenarios(str(path))
    with Pool(1) as pool:
        (result,) = run_tasks(pool, [Task(found.scenario, 0, found.python_file, found.index)])
    assert result is not None
    assert result.passed, result.reason
    assert [measure.name for measure in result.measures] == ["way"]


def test_an_error_in_a_function_of_a_scenario_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "functions.py"
    path.write_text(
        "from kbot.trials import *\n"
        "def drive(sim):\n    raise ValueError('odd')\n"
        "own = Scenario('own', 1.0, [Step(RunScript(drive))], robot=RobotSource('kbot'))\n"
    )
    with Pool(1) as pool:
        (result,) = run_tasks(pool, [Task(Scenario("own", 1.0, robot=KBOT), 0, str(path))])
    assert result is not None
    assert "functions.py:3: ValueError: odd" in result.error


def test_a_recording_that_is_not_complete_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    task = Task(SHORT)
    failed = TrialResult("short", 0, failed_at=0.1, error="it fell over")

    def run(pool: Pool, tasks: Sequence[Task], *_: object) -> list[TrialResult | None]:
        Path(tasks[0].record).write_bytes(b"the disk is full from here")
        return [replace(failed, recording="")]

    monkeypatch.setattr("kbot.trials.recordings.run_tasks", run)
    notes: list[str] = []
    with Pool(1) as pool, notes_sent_to(notes.append):
        (kept,) = record_failures(pool, [task], [failed], tmp_path)
    assert kept == failed
    assert list(tmp_path.iterdir()) == []
    assert notes == [f"{tmp_path / 'short-seed0.mcap'} could not be written completely, and was removed"]


def test_a_full_disk_gives_no_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def close(outputs: RunOutputs) -> None:
        outputs.failure = KbotError("No space left on device")

    monkeypatch.setattr(RunOutputs, "close", close)
    result = run_trial(SHORT, record=str(tmp_path / "run.mcap"))
    assert (result.recording, result.error) == ("", "")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_a_process_that_is_killed_is_replaced_and_its_trial_runs_again(tmp_path: Path) -> None:
    marks = tmp_path / "marks"
    killed = scripted(
        tmp_path,
        "killed",
        "import os, signal\nfrom pathlib import Path\ndef drive(sim):\n"
        f"    with Path({str(marks)!r}).open('a') as file:\n        file.write('x')\n"
        f"    if len(Path({str(marks)!r}).read_text()) < 3:\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n",
    )
    with Pool(1) as pool:
        (result,) = run_tasks(pool, [killed])
    assert result is not None
    assert result.passed, result.reason
    assert marks.read_text() == "xxx"
    Path(tmp_path / "killed.py").write_text(
        "import os, signal\ndef drive(sim):\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    with Pool(1) as pool:
        (result,) = run_tasks(pool, [killed])
    assert result is not None
    assert result.error == "the trial ended its process, with status -9"
