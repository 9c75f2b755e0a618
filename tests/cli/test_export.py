"""Tests `kbot export`: it writes one complete file, or nothing."""

import io
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from kbot.cli.main import run

HEADS = {"png": b"\x89PNG", "html": b"<!doctype html>", "glb": b"glTF"}


@pytest.mark.parametrize("kind", HEADS)
def test_the_suffix_selects_the_format(kind: str, tmp_path: Path) -> None:
    out = tmp_path / f"robot.{kind}"
    assert run(["export", "kbot", "-o", str(out), "--size", "64x48"]) == 0
    assert out.read_bytes().startswith(HEADS[kind])


def test_a_picture_of_the_exact_size_on_stdout() -> None:
    words = ["export", "kbot", "--to", "png", "-o", "-", "--size", "123x45", "--transparent"]
    made = subprocess.run([sys.executable, "-m", "kbot", *words], capture_output=True, check=True)
    image = Image.open(io.BytesIO(made.stdout))
    assert (image.size, image.mode) == ((123, 45), "RGBA")


def test_without_an_output_the_file_has_the_robots_name_and_overwrites_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["export", "kbot", "--to", "tree"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["kbot.svg"]
    assert run(["export", "kbot", "--to", "tree"]) == 2
    assert "kbot.svg already exists" in capsys.readouterr().err
    (tmp_path / "odd.urdf").write_text('<robot name="../odd"><link name="base"/></robot>')
    assert run(["export", "odd.urdf", "--to", "tree"]) == 0
    assert (tmp_path / "___odd.svg").is_file()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to", "jpg"], "'jpg' is not one of"),
        (["-o", "robot.step"], "the suffix of 'robot.step' does not select a format"),
        (
            ["-o", "robot.svg"],
            "Use .png, .html or .glb, or add --to tree for an SVG drawing of the kinematic tree",
        ),
        ([], "the output format is missing. Add --to"),
        (["--to", "png", "--size", "big"], "--size takes WxH in pixels"),
        (["--to", "png", "--size", "0x9"], "1 to 8192 pixels"),
        (["--to", "png", "--from", "north"], "--from takes AZ,EL in degrees"),
        (["--to", "png", "--from", "0,100"], "the elevation within -90 to 90"),
        (["--to", "glb", "--joint", "left_wheel_jiont:=1"], "did you mean 'left_wheel_joint'"),
        (["--to", "glb", "--joint", "left_wheel_joint:=much"], "takes a number in rad or m, not 'much'"),
        (["--to", "glb", "--joint", "left_wheel_joint"], "--joint takes NAME:=VALUE"),
        (["-o", "nowhere/robot.glb"], "nowhere/robot.glb cannot be written"),
    ],
)
def test_invalid_options_are_one_clear_error(
    words: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["export", "kbot", *words]) == 2
    err = capsys.readouterr().err
    assert message in err
    assert "Traceback" not in err
    assert not list(tmp_path.iterdir())


def test_a_broken_robot_does_not_change_the_file(tmp_path: Path) -> None:
    (tmp_path / "broken.urdf").write_text('<robot name="r"><link name="a">')
    out = tmp_path / "robot.glb"
    out.write_text("mine")
    assert run(["export", str(tmp_path / "broken.urdf"), "-o", str(out)]) == 2
    assert out.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["broken.urdf", "robot.glb"]


def test_shot_writes_a_picture_instead_of_showing_the_page(tmp_path: Path) -> None:
    out = tmp_path / "robot.png"
    assert run(["view", "kbot", "--shot", str(out), "--size", "80x60", "--transparent"]) == 0
    with Image.open(out) as image:
        assert (image.size, image.mode) == ((80, 60), "RGBA")


def test_shot_writes_a_picture_of_the_end_of_a_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sim", "kbot", "--headless", "--world", "boxes", "--duration", "0.1"]
    out = tmp_path / "end.png"
    assert run([*words, "--shot", str(out)]) == 0
    with Image.open(out) as image:
        assert image.size == (1280, 720)
    assert run(["sim", "kbot", "--shot", str(out)]) == 2
    assert "--shot needs --headless" in capsys.readouterr().err
