"""Tests launches without a robot, as processes: the messages of their nodes are received."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

TELEOP = '<node pkg="teleop_twist_keyboard" type="teleop_twist_keyboard.py" name="keys"/>'
FRAME = '<node pkg="tf2_ros" type="static_transform_publisher" name="f" args="1 2 3 0 0 0 map odom"/>'
SERVER = '<node pkg="map_server" type="map_server" name="m" args="$(dirname)/map.yaml"/>'
PARAMETER = '<param name="speed" value="0.5"/>'
MAP = """image: map.pgm
resolution: 0.25
origin: [0, 0, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.2
"""

RunKbot = Callable[..., Any]

pytestmark = pytest.mark.skipif(os.name == "nt", reason="there are no such terminals")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    for name in ("ROS_MASTER_URI", "ROS_VERSION", "ROS_DISTRO", "KBOT_TRANSPORT", "KBOT_AT"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.2)


@contextmanager
def running(folder: Path, *words: str, keyboard: int | None = None) -> Iterator[Callable[[], str]]:
    """What it has told so far; Ctrl-C ends it at the end, with status 0."""
    log = folder / f"{words[0]}.log"
    with log.open("w") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "kbot", *words], stdin=keyboard, stdout=file, stderr=file
        )
    try:
        yield lambda: log.read_text()
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0, log.read_text()
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    import pty

    ours, theirs = pty.openpty()
    yield ours, theirs
    os.close(ours)
    os.close(theirs)


def test_frames_maps_and_parameters_exist_without_a_robot(folder: Path, run_kbot: RunKbot) -> None:
    """Their time is wall-clock time, because no simulation publishes a clock."""
    (folder / "map.pgm").write_bytes(b"P5\n2 2\n255\n\xfe\xfe\x00\x00")
    (folder / "map.yaml").write_text(MAP)
    (folder / "a.launch").write_text(f"<launch>{FRAME}{SERVER}{PARAMETER}</launch>")
    before = time.time()
    with running(folder, "launch", str(folder / "a.launch")):
        until(lambda: run_kbot("node", "list").status == 0)
        topics = run_kbot("topic", "list").out.split()
        assert {"/tf_static", "/map", "/map_metadata"} == {*topics}
        assert run_kbot("param", "list").out.split() == ["/speed"]
        assert run_kbot("tf", "tree").out.splitlines() == ["map", "  odom (static)"]
        assert "Translation: [1.000, 2.000, 3.000]" in run_kbot("tf", "echo", "map", "odom", "--once").out
        output = yaml.safe_load(run_kbot("topic", "echo", "/tf_static", "--once").out.removesuffix("---\n"))
        assert before <= output["transforms"][0]["header"]["stamp"]["sec"] + 1 <= time.time() + 1
        output = run_kbot("topic", "echo", "/map", "--once", "--field", "info.resolution").out
        assert output == "0.25\n---\n"


def test_keys_are_read_without_a_robot(folder: Path, terminal: tuple[int, int], run_kbot: RunKbot) -> None:
    ours, theirs = terminal
    (folder / "a.launch").write_text(f"<launch>{TELEOP}</launch>")
    with running(folder, "launch", str(folder / "a.launch"), keyboard=theirs) as output:
        until(lambda: "The launch file has no robot" in output())
        os.write(ours, b"i")
        assert run_kbot("topic", "echo", "/cmd_vel", "--once", "--field", "linear.x").out == "0.5\n---\n"


def test_keys_drive_the_running_kbot(folder: Path, terminal: tuple[int, int], run_kbot: RunKbot) -> None:
    ours, theirs = terminal
    (folder / "a.launch").write_text(f"<launch>{TELEOP}{FRAME}</launch>")
    with running(folder, "sim", "kbot", "--no-browser", "--port", "0"):
        until(lambda: run_kbot("node", "list").status == 0)
        with running(folder, "launch", str(folder / "a.launch"), keyboard=theirs) as output:
            until(lambda: "The launch file has no robot" in output())
            assert "The running KBot receives /cmd_vel." in output()
            assert "Frames of the launch file are not published" in output()
            os.write(ours, b"i")
            until(lambda: speed(run_kbot) > 0.2)
            os.write(ours, b"k")
            until(lambda: speed(run_kbot) < 0.01)


def speed(run_kbot: RunKbot) -> float:
    output = run_kbot("topic", "echo", "/odom", "--once", "--field", "twist.twist.linear.x").out
    found = re.match(r"\S+", output)
    assert found is not None
    return float(found[0])
