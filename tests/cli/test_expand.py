"""Tests that `kbot expand` has the options and the output of the `xacro` command."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import xacro
from kbot.cli import start
from kbot.cli.main import run

TEXT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="size" default="1"/>
  <!-- note -->

  <xacro:property name="s" value="$(arg size)"/>
  <b z="${s}" a="&lt;&quot;"/>
</robot>
"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "a--robot.xacro"
    path.write_text(TEXT)
    return path


def test_byte_for_byte(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["expand", str(robot), "size:= 3 "]) == 0
    official = xacro.process_file(str(robot), mappings={"size": "3"}).toprettyxml(indent="  ")
    assert capsys.readouterr().out == official


@pytest.mark.parametrize("words", [[], ["--inorder"]])
def test_as_a_process(robot: Path, words: list[str]) -> None:
    """With and without an option, the code is different but the result is the same."""
    command = [
        sys.executable,
        "-c",
        "from kbot.cli.start import main; main()",
        "expand",
        str(robot),
        "size:=2",
    ]
    ran = subprocess.run([*command, *words], capture_output=True, text=True, check=True, encoding="utf-8")
    assert '<b a="&lt;&quot;" z="2"/>' in ran.stdout
    assert ran.stderr == ""


def test_plain_omits_the_banner(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["expand", "--plain", str(robot)]) == 0
    assert capsys.readouterr().out.splitlines()[1] == '<robot name="r">'


def test_into_a_file_in_a_new_folder(robot: Path, tmp_path: Path) -> None:
    assert run(["expand", str(robot), "-o", str(tmp_path / "new/out.urdf")]) == 0
    assert (tmp_path / "new/out.urdf").read_text().startswith("<?xml")


def test_a_failure_does_not_change_the_file(
    robot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot.write_text(TEXT.replace("${s}", "${gone}"))
    out = tmp_path / "out.urdf"
    out.write_text("old")
    assert run(["expand", str(robot), "-o", str(out), "--source-map", str(tmp_path / "map.json")]) == 2
    assert out.read_text() == "old"
    assert not (tmp_path / "map.json").exists()
    captured = capsys.readouterr()
    assert captured.out == ""
    assert f"{robot}:6:9: error: unknown property 'gone'" in captured.err


def test_dependencies(robot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "b.xacro").write_text("<r/>")
    robot.write_text(TEXT.replace("<b ", '<xacro:include filename="b.xacro"/><b '))
    assert run(["expand", "--deps", str(robot)]) == 0
    assert capsys.readouterr().out == str(tmp_path / "b.xacro")


def test_root_dir(robot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["expand", robot.name, "--root-dir", str(tmp_path)]) == 0
    assert '<b a="&lt;&quot;" z="1"/>' in capsys.readouterr().out


def test_quiet_omits_warnings(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["expand", str(robot), "sise:=2"]) == 0
    assert "the description declares no argument 'sise'" in capsys.readouterr().err
    assert run(["expand", str(robot), "sise:=2", "-q"]) == 0
    assert run(["expand", str(robot), "sise:=2", "--verbosity", "0"]) == 0
    assert capsys.readouterr().err == ""


def test_verbosity_logs_properties(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["expand", str(robot), "-v", "-v"]) == 0
    assert "set s: " in capsys.readouterr().err


def test_source_map(robot: Path, tmp_path: Path) -> None:
    out, source_map = tmp_path / "out.urdf", tmp_path / "map.json"
    assert run(["expand", str(robot), "-o", str(out), "--source-map", str(source_map)]) == 0
    entry = next(e for e in json.loads(source_map.read_text())["elements"] if e["tag"] == "b")
    line, column = entry["output"][:2]
    assert out.read_text().splitlines()[line - 1][column - 1 :].startswith("<b ")
    assert entry["source"][1:3] == [6, 3]


@pytest.mark.parametrize("words", [[], ["a", "b"], ["x", "a=b"], ["x", ":=1"], ["none.xacro"]])
def test_invalid_arguments(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["expand", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "error:" in captured.err
    assert "Traceback" not in captured.err


@pytest.mark.parametrize("option", ["-o", "--source-map"])
def test_the_sources_of_a_robot_are_not_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    part, robot, link = (tmp_path / name for name in ("part.xacro", "robot.xacro", "link.xacro"))
    part.write_text('<robot><link name="a"/></robot>')
    whole = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="part.xacro"/></robot>'
    )
    robot.write_text(whole)
    link.symlink_to(robot)
    for target in (robot, part, link):
        assert run(["expand", str(robot), option, str(target)]) == 2
        assert f"{target} is an input of this command and would be overwritten" in capsys.readouterr().err
    assert (robot.read_text(), part.read_text()) == (whole, '<robot><link name="a"/></robot>')


def test_two_outputs_need_two_files(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = robot.with_name("out")
    assert run(["expand", str(robot), "-o", str(out), "--source-map", str(out)]) == 2
    assert "Choose two different files" in capsys.readouterr().err
    assert not out.exists()


def test_into_a_pipe_by_its_name(robot: Path) -> None:
    command = [sys.executable, "-m", "kbot", "expand", str(robot), "-o", "/dev/stdout"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == xacro.process_file(str(robot)).toprettyxml(indent="  ")


def test_a_file_with_errors_is_expanded_once(
    robot: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """If `kbot.cli.start` finds errors, they are reported without a second expansion."""

    def expanded_again(*_: object, **__: object) -> None:
        raise AssertionError

    robot.write_text(TEXT.replace("${s}", "${unknown}"))
    monkeypatch.setattr(sys, "argv", ["kbot", "expand", str(robot)])
    monkeypatch.setattr("kbot.cli.expand.expand", expanded_again)
    with pytest.raises(SystemExit) as stop:
        start.main()
    assert stop.value.code == 2
    assert capsys.readouterr().err.count("error: ") == 1
