"""Tests the command `kbot view`."""

import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.cli.main import run
from kbot.workbench.session.session import Session
from kbot.worker import PEER_READING, READING

ROBOT = "<robot name='r'><link name='a'/></robot>"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("missing.xacro", None, "does not exist"),
        ("text.yaml", b"a: 1\n", "not well-formed"),
        ("picture.png", b"\x89PNG\r\n\x1a\n\xff\xfe", "not UTF-8"),
        ("world.sdf", b"<sdf/>", "not a robot"),
    ],
)
def test_a_file_that_is_not_a_robot_is_reported_with_exit_status_2(
    tmp_path: Path, name: str, content: bytes | None, message: str, run_kbot: Callable[..., Any]
) -> None:
    file = tmp_path / name
    if content is not None:
        file.write_bytes(content)
    ended = run_kbot("view", file, "--no-browser")
    assert ended.status == 2
    assert message in ended.err
    assert "Traceback" not in ended.err
    assert ended.out == ""


def test_limit_time_is_the_time_of_later_readings(monkeypatch: pytest.MonkeyPatch) -> None:
    for worker in (READING, PEER_READING):
        monkeypatch.setattr(worker, "limits", worker.limits)  # restores them
    assert run(["view", "missing.urdf", "--limit-time", "300"]) == 2
    assert (READING.limits.seconds, PEER_READING.limits.seconds) == (300.0, 300.0)


def test_name_equals_value_is_explained(run_kbot: Callable[..., Any]) -> None:
    ended = run_kbot("view", "kbot", "wheel_radius=0.04", "--no-browser")
    assert ended.status == 2
    assert "wheel_radius:=0.04" in ended.err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
@pytest.mark.parametrize("verb", ["view", "sim"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("<robot name='r'></robot>", "the robot has no link"),
        ("<robot name='r'><link name='a'/>", "not well-formed"),
    ],
)
def test_an_empty_or_broken_description_opens_the_page(
    tmp_path: Path, verb: str, text: str, message: str, start_kbot: Callable[..., subprocess.Popen[str]]
) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(text)
    running = start_kbot(verb, file, "--no-browser", "--port", "0")
    assert running.stdout is not None
    assert running.stderr is not None
    line = running.stdout.readline()
    assert "does not describe a robot yet" in line
    with urllib.request.urlopen(line.split()[-1], timeout=60) as answer:
        assert message.encode() in answer.read(), "the page shows the error"
    running.send_signal(signal.SIGINT)
    assert running.wait(60) == 0
    assert message in running.stderr.read()


def test_a_picture_of_a_broken_description_is_refused(tmp_path: Path, run_kbot: Callable[..., Any]) -> None:
    file = tmp_path / "r.urdf"
    file.write_text("<robot name='r'></robot>")
    ended = run_kbot("view", file, "--shot", tmp_path / "r.png")
    assert ended.status == 2
    assert "the robot has no link" in ended.err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_view_serves_until_it_is_stopped(
    tmp_path: Path, ending: signal.Signals, start_kbot: Callable[..., subprocess.Popen[str]]
) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(ROBOT)
    running = start_kbot("view", file, "--no-browser", "--port", "0")
    assert running.stdout is not None
    assert running.stderr is not None
    address = re.search(r"http://127\.0\.0\.1:\d+/", running.stdout.readline())
    assert address
    with urllib.request.urlopen(address[0], timeout=60) as answer:
        assert b"<script" in answer.read()
    running.send_signal(ending)
    assert running.wait(60) == 0
    assert running.stderr.read() == ""


def test_a_recording_opens_at_a_time(recording: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Session] = []
    monkeypatch.setattr("kbot.workbench.serve.serve_session", lambda session, address: shown.append(session))
    assert run(["view", recording, "--at", "1.5", "--no-browser", "--port", "0"]) == 0
    (session,) = shown
    timeline = session.timeline()
    assert timeline is not None
    assert (timeline.at, timeline.paused) == (1.5, True)
