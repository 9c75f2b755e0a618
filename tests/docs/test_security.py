"""The page on security names the files that run code, and the verbs that run none of them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

FILES = {
    "python.scenario.py": "from kbot.trials import RobotSource, Scenario\n{mark}\n"
    "x = Scenario('x', 0.1, robot=RobotSource('kbot'))\n",
    "script.scenario.yaml": "robot: kbot\nduration: 0.1\nsteps:\n  - script: script.py\n",
    "program.scenario.yaml": "robot: kbot\nduration: 0.1\nprograms:\n  - file: program.py\n",
    "script.py": "{mark}\ndef drive(sim):\n    pass\n",
    "program.py": "{mark}\n",
    "python.launch.py": "from launch import LaunchDescription\n{mark}\n"
    "def generate_launch_description():\n    return LaunchDescription([])\n",
    "robot.urdf": '<robot name="r"><link name="a"/></robot>',
}  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with files of each kind. Each Python file creates a file NAME.ran."""
    for name, text in FILES.items():
        mark = f"import pathlib; pathlib.Path({str(tmp_path / name)!r} + '.ran').touch()"
        (tmp_path / name).write_text(text.replace("{mark}", mark))
    return tmp_path


def ran(folder: Path) -> set[str]:
    return {path.stem for path in folder.glob("*.ran")}


def test_scenarios_run_code_when_they_are_tried(folder: Path, run_kbot: Callable[..., Any]) -> None:
    ended = run_kbot("try", ".", cwd=folder)
    assert ran(folder) == {"python.scenario.py", "script.py", "program.py"}, ended


@pytest.mark.skipif(sys.platform == "win32", reason="a process is slow to start there")
@pytest.mark.parametrize(
    "words",
    [
        ("check", "."),
        ("check", "python.launch.py"),
        ("launch", "python.launch.py"),
        ("info", "robot.urdf"),
        ("expand", "robot.urdf"),
        ("compare", "robot.urdf", "robot.urdf"),
    ],
)
def test_other_verbs_run_none_of_the_files(
    words: tuple[str, ...], folder: Path, run_kbot: Callable[..., Any]
) -> None:
    run_kbot(*words, cwd=folder)
    assert ran(folder) == set()


@pytest.mark.skipif(sys.platform == "win32", reason="links to programs need a privilege there")
def test_a_search_for_modules_runs_no_file_of_the_working_directory(
    folder: Path, run_kbot: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A Python that is started without a file imports from the working directory first."""
    (folder / "python3").symlink_to(sys.executable)
    monkeypatch.setenv("PATH", str(folder), prepend=":")
    for name in ("warnings.py", "contextlib.py", "types.py"):
        (folder / name).write_text(f"open({str(folder / name)!r} + '.ran', 'w')\n")  # imports nothing
    (folder / "package.xml").write_text(
        "<package format='3'><name>p</name><version>0.1.0</version></package>"
    )
    (folder / "node").write_text("#!/usr/bin/env python3\nimport rclpy, missing_module\n")
    (folder / "node").chmod(0o755)
    (folder / "a.launch.xml").write_text(
        "<launch><node pkg='p' exec='node' name='n'><param from='missing.yaml'/></node></launch>"
    )
    ended = run_kbot("check", "a.launch.xml", cwd=folder)
    assert "L059" in ended.out + ended.err  # it has searched for the node's modules
    assert ran(folder) == set()
