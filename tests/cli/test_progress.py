"""Tests that terminals show long operations, and that pipes do not."""

from __future__ import annotations

import errno
import gc
import io
import os
import sys
import threading
import time

import pytest

from kbot.cli import progress
from kbot.text.progress import working_on


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "PATIENCE", 0.0)


def test_a_pipe_gets_no_progress(capsys: pytest.CaptureFixture[str], at_once: None) -> None:
    with progress.busy("loading it"):
        time.sleep(0.1)
    assert capsys.readouterr() == ("", "")


@pytest.mark.skipif(sys.platform == "win32", reason="terminals are opened otherwise on Windows")
def test_a_terminal_shows_long_operations(monkeypatch: pytest.MonkeyPatch, at_once: None) -> None:
    master, slave = os.openpty()
    with os.fdopen(slave, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        monkeypatch.setenv("TERM", "xterm")
        shown = b""
        with progress.busy("loading it"):
            while b"loading it" not in shown:
                shown += os.read(master, 1000)
        terminal.flush()
    os.close(master)


@pytest.mark.skipif(sys.platform == "win32", reason="terminals are opened otherwise on Windows")
def test_the_text_can_be_replaced_and_is_not_markup(monkeypatch: pytest.MonkeyPatch, at_once: None) -> None:
    master, slave = os.openpty()
    with os.fdopen(slave, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        monkeypatch.setenv("TERM", "xterm")
        shown = b""
        with progress.busy("reading a[/x].urdf") as replace:
            while b"reading a[/x].urdf" not in shown:
                shown += os.read(master, 1000)
            replace("reading b[0].urdf")
            while b"reading b[0].urdf" not in shown:
                shown += os.read(master, 1000)
        terminal.flush()
    os.close(master)


def test_a_pipe_gets_the_step_of_a_slow_operation(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The line appears after a time of processor time, not of a wait on a busy machine."""
    monkeypatch.setattr(progress, "SLOW", 0.01)
    used, printed = [0.0], threading.Event()
    monkeypatch.setattr(progress, "process_time", lambda: used[0])

    def note(text: str) -> None:
        lines.append(text)
        printed.set()

    lines: list[str] = []
    monkeypatch.setattr(progress, "print_note", note)
    with progress.loading("it.sdf"):
        working_on("step 1 of 2")
        assert not printed.wait(0.1)
        working_on("step 2 of 2")
        used[0] = 1.0
        assert printed.wait(60.0)
    assert lines == ["loading it.sdf: step 2 of 2 …"]
    gc.unfreeze()


@pytest.mark.skipif(sys.platform == "win32", reason="terminals are opened otherwise on Windows")
def test_a_terminal_shows_how_many_parts_are_done(monkeypatch: pytest.MonkeyPatch, at_once: None) -> None:
    master, slave = os.openpty()
    with os.fdopen(slave, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        monkeypatch.setenv("TERM", "xterm")
        shown = b""
        with progress.counting("running", 7) as advance:
            advance()
            advance()
            while b"2/7" not in shown:
                shown += os.read(master, 1000)
        terminal.flush()
    os.close(master)
    assert b"running" in shown


@pytest.mark.skipif(sys.platform == "win32", reason="terminals are opened otherwise on Windows")
def test_lines_are_printed_above_the_progress_which_is_cleared(
    monkeypatch: pytest.MonkeyPatch, at_once: None
) -> None:
    import termios  # not on Windows

    master, slave = os.openpty()
    termios.tcsetwinsize(slave, (24, 20))
    with os.fdopen(slave, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        shown = b""
        with progress.busy("loading a file with a long name"):
            while b"loading" not in shown:
                shown += os.read(master, 1000)
            sys.stderr.write("a note\n")
            sys.stderr.write("no break")
        assert sys.stderr is terminal
        terminal.flush()
        while not shown.endswith(b"no break"):
            shown += os.read(master, 1000)
    os.close(master)
    drawn, *after = shown.decode().split("\r\x1b[2K")
    assert drawn == ""
    lines = {text[2:] for text in after if text[:2] in ("- ", "\\ ", "| ", "/ ")}
    assert lines == {"loading a file wi"}, "one column less than the terminal, or it would wrap"
    assert "a note\r\n" in after, "on a line of its own"
    assert after[-1] == "no break", "on a cleared line"


def test_a_terminal_that_cannot_clear_a_line_shows_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], at_once: None
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")
    with progress.busy("loading it"):
        time.sleep(0.1)
    assert capsys.readouterr() == ("", "")


class _Closed(io.StringIO):
    """A terminal or pipe that was closed."""

    def write(self, text: str) -> int:
        raise OSError(errno.EIO, os.strerror(errno.EIO))


@pytest.mark.parametrize("is_terminal", [True, False])
def test_progress_stops_if_the_terminal_or_pipe_is_closed(
    is_terminal: bool, monkeypatch: pytest.MonkeyPatch, at_once: None
) -> None:
    closed, errors = _Closed(), list[object]()
    closed.isatty = lambda: is_terminal  # type: ignore[method-assign]
    monkeypatch.setattr(sys, "stderr", closed)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "SLOW", 0.0)
    monkeypatch.setattr(threading, "excepthook", errors.append)
    before = threading.active_count()
    with progress.busy("loading it"):
        while threading.active_count() > before:
            time.sleep(0.01)
    assert errors == []
    assert sys.stderr is closed


def test_a_pipe_gets_no_bar(capsys: pytest.CaptureFixture[str], at_once: None) -> None:
    with progress.counting("running", 7) as advance:
        advance()
    assert capsys.readouterr() == ("", "")


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time in seconds."""
    now = [1000.0]
    monkeypatch.setattr(progress, "monotonic", lambda: now[0])
    return now


def test_a_pipe_gets_a_line_a_minute(capsys: pytest.CaptureFixture[str], clock: list[float]) -> None:
    with progress.counting("running", 9) as advance:
        for seconds in (50.0, 50.0, 10.0, 50.0, 40.0):
            clock[0] += seconds
            advance()
    # 100 s for 2 of 9 leave 350 s; 160 s for 4 of 9 leave 200 s
    expected = [
        "running: 2 of 9 done, about 0:05:50 left",
        "running: 4 of 9 done, about 0:03:20 left",
    ]
    assert capsys.readouterr() == ("", "\n".join(expected) + "\n")


def test_the_time_left_is_that_of_the_mean_part() -> None:
    left = progress._TimeLeft(total=24, now=0.0)
    assert left.seconds(0.0) is None, "nothing is known before the first part is done"
    for _ in range(8):  # of eight processes that end together
        left.advance(600.0)
    assert left.seconds(600.0) == 1200.0
    assert left.seconds(700.0) == 1100.0
    assert left.seconds(5000.0) == 0.0


def test_errors_inside_the_block_are_raised() -> None:
    with pytest.raises(ValueError, match="so it is"), progress.busy("loading it"):
        raise ValueError("so it is")


def test_garbage_collection_is_off_while_loading() -> None:
    assert gc.isenabled()
    try:
        with progress.loading("it"):
            assert not gc.isenabled()
        assert gc.isenabled()
        assert gc.get_freeze_count() > 0
    finally:
        gc.unfreeze()


def test_garbage_collection_is_on_again_after_an_error() -> None:
    try:
        with pytest.raises(ValueError, match="so it is"), progress.loading("it"):
            raise ValueError("so it is")
        assert gc.isenabled()
    finally:
        gc.unfreeze()
