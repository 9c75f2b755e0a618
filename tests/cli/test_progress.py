"""Tests that terminals show long operations, and that pipes do not."""

from __future__ import annotations

import gc
import os
import sys
import time

import pytest

from kbot.cli import progress


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


def test_a_pipe_gets_no_bar(capsys: pytest.CaptureFixture[str], at_once: None) -> None:
    with progress.counting("running", 7) as advance:
        advance()
    assert capsys.readouterr() == ("", "")


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
