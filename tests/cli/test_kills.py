"""SIGKILL of any verb, while its children work, leaves no process, and no folder after the next start.

The children are in a call in C that holds Python's lock, so that nothing in them can notice the end of the
parent, and have started processes of their own.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from kbot.model.load import SHIPPED_PACKAGE

from ..record.hostile import ros2_folder

START_SECONDS, END_SECONDS = 240.0, 60.0
"""Until all verbs work, and until what they started has ended. With a load of 30 they took 90 s and 1 s."""
VERB, RUN = "KBOT_TEST_VERB", "KBOT_TEST_RUN"
"""Variables that all processes of a verb, and of this test, inherit."""

HANG = f"""#!{sys.executable}
import ctypes, os, subprocess
from pathlib import Path


def hang(*_):
    subprocess.Popen(["sleep", "3600"])
    Path(os.environ[{RUN!r}], os.environ[{VERB!r}] + ".begun").touch()
    ctypes.PyDLL(None).sleep(3600)


drive = hang
if __name__ == "__main__":
    hang()
"""
SHELL = f'sleep 3600 & touch "${RUN}/${VERB}.begun"; wait'
LEARN = f"""
import os
from pathlib import Path
import gymnasium
import kbot.learn

options = {{"num_envs": 2, "vectorization_mode": "vector_entry_point", "processes": 2, "world": "empty"}}
made = gymnasium.make_vec("kbot/Goal-v0", **options)
made.reset(seed=1)
Path(os.environ[{RUN!r}], os.environ[{VERB!r}] + ".begun").touch()
while True:
    made.step(made.action_space.sample())
"""
LAUNCH = "<launch>{}</launch>"
PAGE = ("--no-browser", "--port", "0")
KBOT = (sys.executable, "-m", "kbot")
VERBS: dict[str, tuple[str, ...]] = {
    "try": (*KBOT, "try", "hang.scenario.yaml", "-j", "1"),
    "try programs": (*KBOT, "try", "program.scenario.yaml", "-j", "1"),
    "compare": (*KBOT, "compare", "HEAD:", ".", "--scenario", "../hang.scenario.yaml", "-j", "1"),
    "compare git": (*KBOT, "compare", "HEAD:", "."),
    "sweep": (
        *(*KBOT, "sweep", "kbot", "--set", "wheel_radius=0.03:0.04:2", "--out", "out", "-j", "1"),
        *("--scenario", "hang.scenario.yaml"),
    ),
    "launch": (*KBOT, "launch", "node.launch"),
    "launch command": (*KBOT, "launch", "command.launch", "--allow-commands"),
    "view": (*KBOT, "view", "view.urdf", *PAGE),
    "sim": (*KBOT, "sim", "sim.urdf", *PAGE),
    "learn": (sys.executable, "-c", LEARN),
    "view recording": (*KBOT, "view", "recording", *PAGE),
}
FOLDERS = {"compare": "compare", "try programs": "program", "launch": "launch", "view recording": "recording"}
"""Temporary folders of verbs, by the beginning of their name."""

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL, and no sh")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The files of all verbs. The working directory of `compare` is a repository in it."""
    (tmp_path / "hang.py").write_text(HANG)
    (tmp_path / "hang.py").chmod(0o755)
    (tmp_path / "hang.scenario.yaml").write_text("duration: 3\nrobot: kbot\nsteps: [{script: hang.py}]\n")
    (tmp_path / "program.scenario.yaml").write_text(
        "duration: 3\nrobot: kbot\nprograms: [{file: hang.py, time_limit: 900}]\n"
    )
    (tmp_path / "package.xml").write_text("<package><name>p</name></package>")
    (tmp_path / "scripts").mkdir()
    shutil.copy(tmp_path / "hang.py", tmp_path / "scripts" / "node.py")
    (tmp_path / "node.launch").write_text(LAUNCH.format('<node pkg="p" type="node.py" name="n"/>'))
    command = shlex.join(["sh", "-c", SHELL]).replace("&", "&amp;").replace('"', "&quot;")
    (tmp_path / "command.launch").write_text(LAUNCH.format(f'<param name="a" command="{command}"/>'))
    for verb in ("view", "sim"):
        (tmp_path / f"{verb}.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    ros2_folder(tmp_path / "recording", mode="file")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "git").write_text(f"#!/bin/sh\n{SHELL}\n")
    (tmp_path / "bin" / "git").chmod(0o755)
    repository = tmp_path / "repository"
    shutil.copytree(SHIPPED_PACKAGE, repository, copy_function=shutil.copyfile)
    identity = ("-c", "user.name=a", "-c", "user.email=a@b")
    for words in (("init", "-q"), ("add", "."), (*identity, "commit", "-qm", "a")):
        subprocess.run(["git", *words], cwd=repository, check=True)
    robot = repository / "urdf" / "kbot.xacro"
    robot.write_text(robot.read_text().replace('default="0.035"', 'default="0.03"'))
    return tmp_path


def begin(verb: str, folder: Path) -> subprocess.Popen[bytes]:
    environment = {
        **os.environ,
        **{RUN: str(folder), VERB: verb, "TMPDIR": str(folder / verb), "KBOT_TRANSPORT": "local"},
        "XDG_RUNTIME_DIR": str(folder / verb),
    }
    if verb == "compare git":
        environment["PATH"] = f"{folder / 'bin'}:{os.environ['PATH']}"
    (folder / verb).mkdir()
    where = folder / "repository" if verb.startswith("compare") else folder
    with (folder / f"{verb}.log").open("wb") as log:
        return subprocess.Popen(
            VERBS[verb], cwd=where, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log
        )


def processes(folder: Path) -> dict[str, list[psutil.Process]]:
    """The processes of this test that run, by their verb."""
    found: dict[str, list[psutil.Process]] = {}
    for process in psutil.process_iter():
        with suppress(psutil.Error):  # it has ended, or belongs to another user
            environment = process.environ()
            if environment.get(RUN) == str(folder) and process.status() != psutil.STATUS_ZOMBIE:
                found.setdefault(environment[VERB], []).append(process)
    return found


def works(verb: str, folder: Path, running: dict[str, list[psutil.Process]]) -> bool:
    """Whether the children of a verb work."""
    if verb in ("view", "sim"):  # another process reads the file again
        with (folder / f"{verb}.urdf").open("a") as file:
            file.write(" ")
        return any("kbot.worker.child" in " ".join(process.cmdline()) for process in running.get(verb, ()))
    if verb == "view recording":  # without a child: the description of its frames is in a folder
        return "http://" in (folder / f"{verb}.log").read_text()
    return (folder / f"{verb}.begun").exists()


def wait_until(met: Callable[[], bool], seconds: float, problem: Callable[[], str]) -> None:
    end = time.monotonic() + seconds
    while not met():
        assert time.monotonic() < end, problem()
        time.sleep(0.2)


@pytest.fixture
def started(folder: Path) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    """All verbs, at the same time."""
    started = {verb: begin(verb, folder) for verb in VERBS}
    yield started
    for process in started.values():
        process.kill()
        process.wait()
    for left in processes(folder).values():
        for each in left:
            with suppress(psutil.Error):
                each.kill()


def test_nothing_is_left(folder: Path, started: dict[str, subprocess.Popen[bytes]]) -> None:
    waiting = set(VERBS)

    def all_are_killed() -> bool:
        running = processes(folder)
        for verb in list(waiting):
            if started[verb].poll() is not None:
                pytest.fail(f"{verb}: {(folder / f'{verb}.log').read_text()}")
            with suppress(psutil.Error):
                if works(verb, folder, running):
                    started[verb].kill()  # at once: `launch` ends a command after a minute
                    started[verb].wait()
                    waiting.remove(verb)
        return not waiting

    wait_until(all_are_killed, START_SECONDS, lambda: f"{sorted(waiting)} did not begin")
    wait_until(
        lambda: not processes(folder),
        END_SECONDS,
        lambda: f"left: {[(verb, each) for verb, left in processes(folder).items() for each in left]}",
    )
    for verb, name in FOLDERS.items():
        (place,) = (folder / verb).glob("kbot-*")
        assert any(place.glob(f"{name}-*.lock")), "else this test does not show that it is removed"
        environment = {**os.environ, "TMPDIR": str(folder / verb)}
        subprocess.run([*KBOT, "rule", "U001"], env=environment, capture_output=True, check=True)
        assert list(place.iterdir()) == []
