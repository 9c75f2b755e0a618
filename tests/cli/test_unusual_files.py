"""Tests files that are not regular, names that are not ASCII, and locales that are not UTF-8."""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

H = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">'


def run_kbot(
    *words: str | bytes, cwd: Path | None = None, env: Mapping[str, str] | None = None, text: bytes = b""
) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-m", "kbot", *words],
        cwd=cwd,
        env=os.environ | (env or {}),
        input=text,
        capture_output=True,
        timeout=300,
        check=False,
    )


NOT_FILES = ("/proc/self/mem", "/proc/kmsg", "/proc/*/*", "/dev/*", "/dev/fd/*", "/*/*/*/*/*/*", "/usr/**/*")


@pytest.mark.skipif(sys.platform != "linux", reason="these are files of Linux")
def test_including_something_that_is_not_a_file(tmp_path: Path, measured_kbot: Callable[..., Any]) -> None:
    includes = "".join(f'<xacro:include filename="{name}"/>' for name in NOT_FILES)
    (tmp_path / "robot.xacro").write_text(f"{H}{includes}</robot>")
    for verb in ("expand", "check"):
        result = measured_kbot(verb, "robot.xacro")
        assert result.is_refusal(), result


@pytest.mark.parametrize("kind", ["pipe", "folder", "large file", "device"])
def test_an_option_that_names_something_that_is_not_a_file(
    kind: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    (tmp_path / "robot.urdf").write_text(f'{H}<link name="base_link"/></robot>')
    name = tmp_path / "given"
    if kind == "pipe":
        os.mkfifo(name)
    elif kind == "folder":
        name.mkdir()
    elif kind == "large file":
        with name.open("wb") as file:
            file.truncate(10 << 30)
    else:
        name.symlink_to("/dev/zero")
    result = measured_kbot("check", "robot.urdf", "--baseline", name)
    assert result.is_refusal(), result
    assert f"error: {name} cannot be read: it is" in result.err


def test_a_description_may_come_from_a_pipe() -> None:
    text = f'{H}<link name="base_link" colour="red"/></robot>'
    for words, status in (("expand",), 0), (("check", "-v"), 1):
        done = run_kbot(*words, "/dev/stdin", text=text.encode())
        assert done.returncode == status, done
        assert b"colour" in done.stdout


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_every_verb_prints_utf_8(encoding: str, tmp_path: Path) -> None:
    """XML without a declared encoding is UTF-8 in every locale. So is the output of all verbs."""
    (tmp_path / "röbot.urdf").write_text(f'{H}<link name="bäse" colour="ö"/></robot>', encoding="utf-8")
    for words in (
        ("expand", "röbot.urdf"),
        ("expand", "röbot.urdf", "no:=argument"),
        ("check", "röbot.urdf"),
        ("check", "röbot.urdf", "--json"),
        ("info", "röbot.urdf", "--json"),
        ("where", "röbot.urdf", "bäse"),
        ("info", "nöthing.urdf"),
    ):
        done = run_kbot(*words, cwd=tmp_path, env={"PYTHONIOENCODING": encoding})
        printed = (done.stdout + done.stderr).decode("utf-8")
        assert "Traceback" not in printed
        assert any(word in printed for word in ("bäse", "röbot", "nöthing")), words


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes on Linux alone")
def test_a_file_name_that_is_not_utf_8_is_printed(tmp_path: Path) -> None:
    name = os.fsencode(tmp_path) + b"/b\xffd.urdf"
    Path(os.fsdecode(name)).write_text(f'{H}<link name="base_link" colour="red"/></robot>')
    for words in (["expand"], ["check", "-v"], ["check", "--json"], ["check", "--output-format", "sarif"]):
        done = run_kbot(*words, name)
        assert b"Traceback" not in done.stderr, done
        assert b"colour" in done.stdout
