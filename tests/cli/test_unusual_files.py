"""Tests files that are not regular, names that are not ASCII, and locales that are not UTF-8."""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

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


# --- names that are not UTF-8 --------------------------------------------------------------------

NAME = os.fsdecode(b"r\xfe")
ROBOT = (
    f'{H}<xacro:property name="width" value="0.1"/><link name="base_link" colour="red"><visual><geometry>'
    '<box size="${width} 1 1"/></geometry></visual></link></robot>'
)
SCENARIO = "robot: kbot\nduration: 0.1\nexpect:\n  - final_forward: {min: 100}\n"
SHORT = ("--headless", "--duration", "0.2")
WRITERS: dict[str, tuple[list[tuple[str, ...]], list[str]]] = {
    # commands in which @ is a name that is not UTF-8, and the files that they write
    "expand": ([("expand", "@.xacro", "-o", "@.urdf", "--source-map", "@.json")], ["@.urdf", "@.json"]),
    "expand to a new folder": ([("expand", "@.xacro", "-o", "@/@/x.urdf")], ["@/@/x.urdf"]),
    "expand to stdout": ([("expand", "@.xacro"), ("expand", "@.xacro", "--deps")], []),
    "check": ([("check", "@.xacro"), ("check", ".", "-v")], []),
    "check --output-format": (
        [("check", "@.xacro", "--output-format", form) for form in ("json", "sarif", "github", "junit")], [],
    ),
    "check --baseline": (
        [("check", "@.xacro", "--write-baseline", "@.base"), ("check", "@.xacro", "--baseline", "@.base")],
        ["@.base"],
    ),
    "check --fix": ([("check", "@.xacro", "--unsafe-fixes", "--diff"), ("check", "@.xacro", "--fix")], []),
    "info and where": ([("info", "@.xacro", "--json"), ("where", "@.xacro", "base_link")], []),
    "export": (
        [("export", "@.xacro", "--to", form, "-o", f"@.{form}") for form in ("html", "glb", "png", "tree")],
        ["@.html", "@.glb", "@.png", "@.tree"],
    ),
    "view --shot": ([("view", "@.xacro", "--shot", "@.png")], ["@.png"]),
    "sim": (
        [
            ("sim", "kbot", *SHORT, "--record", "@.bag", "--plot", "@.png", "--json"),
            ("sim", "kbot", *SHORT, "--record", "@"),
            ("bag", "info", "@"),
        ],
        ["@.bag", "@.png", "@/metadata.yaml"],
    ),
    "sim of such a file": ([("sim", "@.xacro", *SHORT, "--record", "@.mcap")], ["@.mcap"]),
    "bag": (
        [
            ("sim", "kbot", *SHORT, "--record", "@.mcap"),
            ("bag", "info", "@.mcap", "--json"),
            ("bag", "convert", "@.mcap", "@2.bag"),
            ("bag", "convert", "@.mcap", "@2"),
            ("bag", "cut", "@.mcap", "@3.mcap", "--end", "0.1"),
            *(("bag", "export", "@.mcap", "--topic", "/odom", "-o", f"@.{form}")
              for form in ("csv", "parquet")),
            ("bag", "replay", "@.mcap"),
            ("compare", "@.mcap", "@.mcap", "--markdown", "@.md"),
        ],
        ["@2.bag", "@2/metadata.yaml", "@3.mcap", "@.csv", "@.parquet", "@.md"],
    ),
    "try": (
        [
            ("try", "@.scenario.yaml", "--junit", "@.xml", "--html", "@.html", "--json", "--keep", "@kept"),
            ("try", "kbot", "--battery", "@.scenario.yaml", "--csv", "@.csv"),
        ],
        ["@.xml", "@.html", "@.csv", "@kept"],
    ),
    "compare": (
        [("compare", "kbot", "kbot", "wheel_radius:=0.04", "--scenario", "@.scenario.yaml", "--markdown",
          "@.md")],
        ["@.md"],
    ),
    "sweep": (
        [("sweep", "kbot", "--set", "wheel_radius=0.03,0.04", "--scenario", "@.scenario.yaml", "--out",
          "@out", "--html", "@.html")] * 2,
        ["@out/results.parquet", "@out/runs.jsonl", "@out/sweep.json", "@.html"],
    ),
    "new": ([("new", "my_robot")], ["my_robot/package.xml"]),
}  # fmt: skip


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes on Linux alone")
@pytest.mark.parametrize("case", WRITERS)
def test_a_name_that_is_not_utf_8_is_read_written_and_printed(
    case: str, tmp_path: Path, run_kbot: Callable[..., Any]
) -> None:
    """The folder and all files have such a name. What is printed and written is valid UTF-8."""
    commands, files = WRITERS[case]
    folder = tmp_path / os.fsdecode(b"f\xff")
    folder.mkdir()
    (folder / f"{NAME}.xacro").write_text(ROBOT)
    (folder / f"{NAME}.scenario.yaml").write_text(SCENARIO)
    for words in commands:
        ended = run_kbot(*(word.replace("@", NAME) for word in words), cwd=folder)
        assert ended.status in (0, 1), (words, ended)
        assert "internal error" not in ended.err, (words, ended)
        assert "\N{REPLACEMENT CHARACTER}" not in ended.out + ended.err, (words, ended)
        if words[0] == "check" and "--output-format" not in words:
            assert "Traceback" not in ended.err
    for name in files:
        written = folder / name.replace("@", NAME)
        assert written.exists(), list(folder.iterdir())
        if written.suffix in (".urdf", ".html", ".md", ".xml", ".csv", ".json", ".svg", ".base", ".jsonl"):
            written.read_text("utf-8")
        if written.suffix in (".urdf", ".xml", ".svg"):
            ElementTree.parse(written)


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes on Linux alone")
def test_a_value_cannot_have_a_name_that_is_not_utf_8(tmp_path: Path, run_kbot: Callable[..., Any]) -> None:
    package = tmp_path / os.fsdecode(b"f\xff") / "pack"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>pack</name></package>")
    (package / "r.xacro").write_text(
        f'{H}<link name="a"/><gazebo><p>$(find pack)/c.yaml</p></gazebo></robot>'
    )
    ended = run_kbot("expand", "r.xacro", "-o", "r.urdf", cwd=package)
    assert ended.status == 2
    assert "error: the text contains a file or folder name that is not UTF-8 [X104]" in ended.err
    assert not (package / "r.urdf").exists()
