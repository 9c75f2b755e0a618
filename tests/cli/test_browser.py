"""Tests which browser the verbs open, when, and at which address."""

import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from os import environ
from pathlib import Path

import click
import pytest

from kbot.cli.ros.launch.command import command as launch
from kbot.cli.sim.command import command as sim
from kbot.cli.view import command as view
from kbot.text import DescriptionError, KbotError

ROBOT = "<robot name='r'><link name='a'/></robot>"
BROKEN = "<robot name='r'><link name='a'/><joint name='j' type='fixed'/></robot>"
LAUNCH = "<launch><param name='robot_description' textfile='{}'/></launch>"
SPAWN = "<node name='s' pkg='gazebo_ros' type='spawn_model' args='-urdf -param robot_description -model r'/>"
GAZEBO = """<include file="$(find gazebo_ros)/launch/empty_world.launch">
<arg name="world_name" value="{}"/></include>"""
BROWSER = """
import sys, urllib.request
with open(sys.argv[1], "a") as log:
    log.write(f"{sys.argv[2]} {urllib.request.urlopen(sys.argv[2]).status}\\n")
"""
"""Writes down the address, and what is answered there, once the page was served."""
needs_signals = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    file = tmp_path / "r.urdf"
    file.write_text(ROBOT)
    (tmp_path / "r.launch").write_text(LAUNCH.format(file))
    return file


@contextmanager
def running(folder: Path, *words: str) -> Iterator[str]:
    """The address of a running verb, with a browser that writes the addresses it gets to `asked`."""
    (folder / "browser.py").write_text(BROWSER)
    browser = [sys.executable, str(folder / "browser.py"), str(folder / "asked")]
    environment = {**environ, "DISPLAY": ":0", "BROWSER": f"{shlex.join(browser)} %s"}
    command = [sys.executable, "-m", "kbot", *words, "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        lines = iter(process.stdout.readline, "")
        try:
            yield next(found.group() for line in lines if (found := re.search(r"http://\S+", line)))
            process.send_signal(signal.SIGINT)
            process.wait(60)
        finally:
            process.kill()


@needs_signals
@pytest.mark.parametrize("verb", ["view", "sim", "launch"])
def test_a_browser_is_opened_once_and_gets_the_page(file: Path, verb: str) -> None:
    name = "r.launch" if verb == "launch" else "r.urdf"
    asked = file.with_name("asked")
    with running(file.parent, verb, str(file.with_name(name))) as address:
        end = time.monotonic() + 60.0
        while not (asked.exists() and asked.read_text()) and time.monotonic() < end:
            time.sleep(0.02)
    assert asked.read_text() == f"{address} 200\n"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (view, ["missing.urdf"]),
        (view, ["r.urdf", "-d", "broken.rviz"]),
        (view, ["missing.mcap"]),
        (sim, ["missing.urdf"]),
        (sim, ["r.urdf", "--world", "boxs"]),
        (sim, ["r.urdf", "-d", "broken.rviz"]),
        (launch, ["broken.launch"]),
        (launch, ["sim.launch", "--world", "boxs"]),
        (launch, ["place.launch"]),
        (launch, ["r.launch", "--record", "run.mcap"]),
    ],
)
def test_no_browser_opens_after_an_error(
    file: Path, monkeypatch: pytest.MonkeyPatch, command: click.Command, words: list[str]
) -> None:
    monkeypatch.chdir(file.parent)
    Path("broken.urdf").write_text(BROKEN)  # only a launch file needs a usable robot
    Path("broken.rviz").write_text("Visualization Manager: [")
    Path("broken.launch").write_text(LAUNCH.format("broken.urdf"))
    spawned = LAUNCH.format(file).replace("</launch>", f"{SPAWN}</launch>")
    Path("sim.launch").write_text(spawned)
    world = file.with_name("broken.world")
    world.write_text("<sdf version='1.9'><world>")
    Path("place.launch").write_text(spawned.replace("</launch>", f"{GAZEBO.format(world)}</launch>"))
    asked: list[str] = []
    monkeypatch.setattr("kbot.workbench.address.bound", lambda *given, **named: asked.append(command.name))
    with pytest.raises((DescriptionError, KbotError, click.exceptions.Exit)):
        command.main(words, standalone_mode=False)
    assert asked == []


@pytest.mark.parametrize("words", [["view", "r.urdf"], ["sim", "r.urdf"], ["launch", "r.launch"]])
@pytest.mark.parametrize("wanted", [True, False])
def test_no_browser_option_opens_no_browser(
    file: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], *, wanted: bool
) -> None:
    """The verb stops at the address, which raises here."""
    monkeypatch.chdir(file.parent)
    asked: list[bool] = []

    def refuse(host: str, port: int | None, *, open_browser: bool) -> None:
        asked.append(open_browser)
        raise KbotError("no address")

    monkeypatch.setattr("kbot.workbench.address.bound", refuse)
    verb = {"view": view, "sim": sim, "launch": launch}[words[0]]
    with pytest.raises(KbotError, match="no address"):
        verb.main([words[1], *([] if wanted else ["--no-browser"])], standalone_mode=False)
    assert asked == [wanted]
