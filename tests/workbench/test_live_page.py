"""`sim.serve()`: the page of a program that runs its own simulation."""

import signal
import sys
import time
from pathlib import Path

import pytest

import kbot
from kbot.text import KbotError

from .conftest import until
from .scripted import needs_signals, running, watching


def test_steps_keep_real_time_while_served_and_end_in_the_same_state(
    capsys: pytest.CaptureFixture[str],
) -> None:
    free = kbot.Simulation("kbot")
    sim = kbot.Simulation("kbot")
    for each in (free, sim):
        each.cmd_vel(0.2, 0.3)
    free.run(0.4)
    with sim.serve(browser=False, port=0) as page:
        assert f"kbot is at  {page.url}" in capsys.readouterr().out
        with watching(page.url) as watcher:
            before = time.monotonic()
            sim.run(0.4)
            assert time.monotonic() - before >= 0.4  # each slice of 0.01 s starts when it is over
            sim.plot("a", 1.0)
            sys.stdout.write("hello\n")
            sim.run(0.2)
            until(lambda: watcher.time > 0.4)
            watcher.send("subscribe", topic="/log")
            sim.run(0.1)  # the page is served while the simulation steps
            until(lambda: "/log" in watcher.newest)
            assert [line["msg"] for line in watcher.newest["/log"]["message"]["lines"]] == ["hello"]
            with pytest.raises(KbotError, match="already served at http"):
                sim.serve(browser=False)
    free.run(0.3)
    assert sim.state_sha256() == free.state_sha256()
    assert sys.stdout.write.__self__ is sys.stdout  # the output is the user's own again
    page.close()
    page.wait()  # returns at once
    before = sim.steps
    sim.run(1.0)
    assert sim.steps == before + 500
    assert sim.stepping.pace is None  # as fast as possible again


PROGRAM = """
import kbot
sim = kbot.Simulation("kbot")
with sim.serve(browser=False, port=0) as page:
    sim.cmd_vel(0.2, 0.0)
    sim.run(0.2)
    sim.cmd_vel(0.0, 0.0)
    print("waiting at", sim.steps)
    page.wait()
    try:
        print("continues", sim.steps > 100)
        while True: sim.time
    except KeyboardInterrupt:
        print("interrupted")
print("closed")
"""


@needs_signals
def test_wait_serves_until_ctrl_c_and_a_page_interrupts_the_program(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(PROGRAM)
    with running("own.py", cwd=tmp_path) as run, watching(run.url) as page:
        until(lambda: run.printed("waiting at 100") and page.phase == "finished")
        page.send("drive", linear=-0.2, angular=0.0)  # the page's keys drive now
        until(lambda: page.newest["state"]["command"][0] < 0.0)
        page.send("set_world", world="boxes", seed=1)
        until(lambda: page.refused)
        assert page.refused[0].endswith("only the program can choose the world")
        page.send("run_program")
        until(lambda: len(page.refused) == 2)
        assert page.refused[1] == "start own.py again where you started it"
        page.send("stop")
        until(lambda: page.newest["state"]["command"] == [0.0, 0.0])
        assert not run.printed("continues"), "only Ctrl-C ends the waiting"
        run.process.send_signal(signal.SIGINT)
        until(lambda: run.printed("continues True") and page.phase == "running")
        page.send("stop")
        until(lambda: run.printed("interrupted"))
        until(lambda: run.printed("closed"))
        assert run.process.wait(60) == 0
    assert run.err == []


@needs_signals
def test_a_page_of_a_program_that_computes_shows_the_start_and_the_line_that_runs(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "import kbot\nsim = kbot.Simulation('kbot')\n"
        "with sim.serve(browser=False, port=0):\n    while True: pass\n"
    )
    with running("own.py", cwd=tmp_path) as run, watching(run.url) as page:
        until(lambda: page.newest.get("program", {}).get("note"))
        still = "own.py:4 is running, but has not called sim.run for"
        assert still in page.newest["program"]["note"]
        assert page.newest["state"]["poses"]
        page.send("stop")
        run.process.wait(60)


SERVED = """
import kbot
sim = kbot.Simulation("kbot")
{0}sim.serve(browser=False, port=0){1}
{2}print("ready")
{2}{3}
"""
CLOSED = 1001
"""The code with which KBot closes the connections when it ends: the page shows "KBot has ended"."""


def served(folder: Path, end: str, *, with_block: bool) -> str:
    """Write a program that serves a page, with or without a `with` block. Returns its file name."""
    parts = ("with ", ":", "    ", end.replace("\n", "\n    ")) if with_block else ("", "", "", end)
    (folder / "own.py").write_text(SERVED.format(*parts))
    return "own.py"


@needs_signals
@pytest.mark.parametrize("with_block", [False, True])
def test_a_program_that_ends_closes_its_page(tmp_path: Path, with_block: bool) -> None:
    end = "input()\nsim.run(0.1)\nsim.cmd_vel(0.2, 0.0)\nprint('done')"
    name = served(tmp_path, end, with_block=with_block)
    with running(name, cwd=tmp_path) as run, watching(run.url) as page:
        until(lambda: run.printed("ready") and page.phase == "running")
        page.send("subscribe", topic="/log")
        run.process.stdin.write("\n")
        run.process.stdin.flush()
        assert run.process.wait(60) == 0
        until(lambda: page.closed == CLOSED)
        assert page.phase == "finished"
        assert page.time == pytest.approx(0.1)
        assert page.newest["/log"]["message"]["lines"][-1]["msg"] == "done"
    assert run.err == []


@needs_signals
@pytest.mark.parametrize("with_block", [False, True])
def test_an_error_of_a_served_program_is_shown_in_its_page(tmp_path: Path, with_block: bool) -> None:
    name = served(tmp_path, "input()\nsim.run(0.1)\nspeed = 0.5\nassert speed < 0.4", with_block=with_block)
    with running(name, cwd=tmp_path) as run, watching(run.url) as page:
        until(lambda: page.phase == "running")
        run.process.stdin.write("\n")
        run.process.stdin.flush()
        assert run.process.wait(60) == 1
        until(lambda: page.closed == CLOSED)
        assert page.phase == "failed"
        assert page.newest["program"]["error"] == (
            "own.py:9: assertion failed at 0.100 s: speed < 0.4\n    speed = 0.5"
        )
    assert run.reported("Traceback")
    assert run.reported("AssertionError")
    assert not run.reported("kbot/"), "KBot's own code is not in the traceback"


@needs_signals
@pytest.mark.parametrize("with_block", [False, True])
@pytest.mark.parametrize("loop", ["while True: sim.run(0.1)", "while True: pass"])
@pytest.mark.parametrize("by_page", [False, True])
def test_stop_and_ctrl_c_end_a_served_program_with_one_line(
    tmp_path: Path, loop: str, by_page: bool, with_block: bool
) -> None:
    name = served(tmp_path, loop, with_block=with_block)
    with running(name, cwd=tmp_path) as run, watching(run.url) as page:
        until(lambda: run.printed("ready") and page.phase == "running")
        if by_page:
            page.send("stop")
        else:
            run.process.send_signal(signal.SIGINT)
        assert run.process.wait(60) == 130
        until(lambda: page.closed == CLOSED)
        assert page.phase == "stopped"
    assert run.err == ["own.py was stopped\n"]


def test_the_hook_for_errors_is_the_user_s_own_again(monkeypatch: pytest.MonkeyPatch) -> None:
    reported = []
    monkeypatch.setattr(sys, "excepthook", lambda *error: reported.append(error[1]))
    mine = sys.excepthook
    first, second = kbot.Simulation("kbot"), kbot.Simulation("kbot")
    first.serve(browser=False, port=0)
    second.serve(browser=False, port=0)
    error = ValueError("a")
    sys.excepthook(ValueError, error, None)  # as Python does at the end of a program
    assert reported == [error]
    assert sys.excepthook is mine
    assert first.stepping.pace is second.stepping.pace is None
