"""The process that reads for a server: limits, errors, and its end."""

import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from kbot.model.load import read_urdf_text
from kbot.text import DescriptionError, KbotError, Span
from kbot.worker import LimitExceeded, Worker
from kbot.world.sdf.reach import Reach

TAKES_MEMORY = "(b'x' * 400_000_000, __import__('time').sleep(60))"


@pytest.fixture
def worker() -> Iterator[Worker]:
    worker = Worker()
    yield worker
    worker.end()


def test_its_process_is_kept(worker: Worker) -> None:
    first = worker.call(os.getpid)
    assert first != os.getpid()
    assert worker.call(math.hypot, 3.0, 4.0) == 5.0
    assert worker.call(os.getpid) == first


def test_it_works_in_the_folder_and_environment_of_the_caller(
    worker: Worker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    worker.call(os.getcwd)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/somewhere")
    assert worker.call(os.getcwd) == str(tmp_path)
    assert worker.call(os.getenv, "ROS_PACKAGE_PATH") == "/somewhere"
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    assert worker.call(os.getenv, "ROS_PACKAGE_PATH") is None


def test_it_imports_nothing_from_the_working_directory(
    worker: Worker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("kbot", "json", "pickle"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a stranger wrote this')")
    monkeypatch.chdir(tmp_path)
    assert worker.call(math.sqrt, 4.0) == 2.0


def test_errors_are_raised_in_the_caller(worker: Worker) -> None:
    with pytest.raises(ValueError, match="math domain error") as error:
        worker.call(math.sqrt, -1.0)
    assert "Traceback" in error.value.__notes__[0]
    with pytest.raises(DescriptionError) as described:
        worker.call(read_urdf_text, "<robot name='r'>\n <link/></robot>", "r.urdf", Reach())
    origin = described.value.diagnostics[0].origin
    assert origin is not None
    assert isinstance(origin.span, Span)
    assert origin.span.line == 2


def test_errors_that_cannot_be_copied_are_raised_as_their_text(worker: Worker) -> None:
    with pytest.raises(RuntimeError, match="SystemExit: 3"):
        worker.call(sys.exit, 3)
    with pytest.raises(RuntimeError, match="Odd: own"):
        worker.call(exec, "class Odd(TypeError): pass\nraise Odd('own')")
    assert worker.call(math.sqrt, 4.0) == 2.0


def test_a_call_that_takes_too_long_is_stopped(worker: Worker) -> None:
    first = worker.call(os.getpid)
    worker.limits = replace(worker.limits, seconds=0.3)
    with pytest.raises(LimitExceeded, match=r"took longer than 0\.3 s and was stopped"):
        worker.call(eval, "sum(iter(int, 1))")  # zeros without an end
    assert not psutil.pid_exists(first)
    with pytest.raises(LimitExceeded, match=r"waited longer than 3 s and was stopped"):
        worker.call(time.sleep, 3600.0)
    worker.limits = replace(worker.limits, seconds=60.0)
    assert worker.call(os.getpid) != first


def test_the_time_of_earlier_calls_does_not_count(worker: Worker) -> None:
    busy = "any(now > {0} for now in iter(__import__('time').process_time, None))"
    worker.limits = replace(worker.limits, seconds=1.0)
    for _ in range(3):
        assert worker.call(eval, busy.format(worker.call(time.process_time) + 0.4))


def test_a_call_that_takes_too_much_memory_is_stopped(worker: Worker) -> None:
    worker.limits = replace(worker.limits, memory=300_000_000)
    with pytest.raises(LimitExceeded, match=r"took more than 0\.3 GB of memory and was stopped"):
        worker.call(eval, TAKES_MEMORY)


def test_a_call_that_ends_the_process_is_reported(worker: Worker) -> None:
    with pytest.raises(LimitExceeded, match="ended its process, with status 7"):
        worker.call(os._exit, 7)
    assert worker.call(math.sqrt, 4.0) == 2.0


def test_calls_of_several_threads_get_their_own_answers(worker: Worker) -> None:
    found: dict[float, float] = {}

    def ask(number: float) -> None:
        found[number] = worker.call(math.sqrt, number)

    threads = [threading.Thread(target=ask, args=(float(n),)) for n in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {float(n): math.sqrt(n) for n in range(20)}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT of one process")
def test_ctrl_c_ends_a_call_and_the_next_one_gets_its_own_answer(worker: Worker) -> None:
    worker.call(os.getpid)
    timer = threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        worker.call(eval, "(__import__('time').sleep(60), 'late')[1]")
    timer.join()
    assert worker.call(math.sqrt, 9.0) == 3.0


@pytest.mark.parametrize("work", ["os.getpid", "time.sleep, 3600"], ids=["idle", "busy"])
def test_it_ends_when_its_caller_is_killed(tmp_path: Path, work: str) -> None:
    """Nobody else could end it. The script has no main guard, and does not run a second time."""
    script = tmp_path / "script.py"
    script.write_text(
        "import os, time\nfrom kbot.worker import Worker\n"
        f"worker = Worker()\nprint(worker.call(os.getpid), flush=True)\nworker.call({work})\ntime.sleep(3600)"
    )
    program = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    try:
        assert program.stdout is not None
        process = psutil.Process(int(program.stdout.readline()))
    finally:
        program.kill()
        program.communicate()
    process.wait(60)


@pytest.mark.skipif(os.name == "nt", reason="needs a shell")
def test_what_other_programs_print_and_read_is_not_part_of_the_answers(worker: Worker) -> None:
    assert worker.call(os.system, "echo an answer; cat") == 0
    assert worker.call(os.write, 1, b"an answer\n") == 10
    assert worker.call(os.read, 0, 8) == b""
    assert worker.call(math.sqrt, 4.0) == 2.0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_copy_of_the_process_does_not_answer(worker: Worker) -> None:
    assert worker.call(os.fork) > 0
    assert worker.call(math.sqrt, 4.0) == 2.0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs process groups")
def test_processes_that_it_started_end_with_it(worker: Worker) -> None:
    text = "__import__('subprocess').Popen([__import__('sys').executable, '-c', 'input()'], stdin=-1).pid"
    pid = worker.call(eval, text)
    worker.end()
    with suppress(psutil.NoSuchProcess):
        psutil.Process(pid).wait(10.0)
    assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


def test_a_process_that_only_closes_its_answers_is_ended(worker: Worker) -> None:
    text = "import os, time\nos.closerange(0, 200)\ntime.sleep(60)"
    with pytest.raises(LimitExceeded, match="ended its process, with status"):
        worker.call(exec, text)
    assert worker.call(math.sqrt, 4.0) == 2.0


def test_an_error_that_cannot_be_copied_keeps_its_kind(worker: Worker) -> None:
    text = "from kbot.sim.script_errors import ScriptError\nraise ScriptError('drive.py', 3, 'no drive')"
    with pytest.raises(KbotError, match=r"^drive\.py:3: no drive$"):
        worker.call(exec, text)
