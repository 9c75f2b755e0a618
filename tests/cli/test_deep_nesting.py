"""Gives files nested deeper than Python's stack to every verb: it prints a result or one clear message."""

from pathlib import Path

import pytest

from kbot.cli.main import run

DEEP = 985
XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="b"/>{}</robot>'


def nested(tag: str, count: int = DEEP) -> str:
    return f"<{tag}>" * count + f"</{tag}>" * count


@pytest.mark.parametrize("tag", ["other", "link", "visual", "gazebo"])
@pytest.mark.parametrize("words", [["expand"], ["check"], ["info"], ["where", "b"]], ids=lambda w: w[0])
def test_elements(words: list[str], tag: str, tmp_path: Path) -> None:
    path = tmp_path / "deep.xacro"
    path.write_text(XACRO.format(nested(tag)))
    assert run([words[0], str(path), *words[1:]]) in (0, 1, 2)


def test_launch_files_and_worlds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    launch, world = tmp_path / "deep.launch", tmp_path / "deep.sdf"
    launch.write_text(f"<launch>{nested('group')}</launch>")
    world.write_text(f'<sdf version="1.7"><world name="w">{nested("model")}</world></sdf>')
    assert run(["launch", str(launch), "--nodes"]) == 2
    assert run(["check", str(launch)]) == 2
    assert run(["sim", "kbot", "--headless", "--world", str(world)]) == 2
    captured = capsys.readouterr()
    assert (captured.out + captured.err).count("[P005]") == 3


def test_yaml(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "deep.yaml").write_text("a: " + "[" * 1100 + "]" * 1100)
    launch = tmp_path / "deep.launch"
    launch.write_text('<launch><rosparam command="load" file="$(dirname)/deep.yaml"/></launch>')
    assert run(["launch", str(launch), "--dump-params"]) == 2
    assert "nested more than 100 levels deep" in capsys.readouterr().err


def test_a_long_chain_of_properties(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each value is computed from the previous one: the source map leads through all of them."""
    steps = "".join(f'<xacro:property name="p{i}" value="${{p{i - 1} + 1}}"/>' for i in range(1, 1200))
    path = tmp_path / "chain.xacro"
    path.write_text(XACRO.format(f'<xacro:property name="p0" value="0"/>{steps}<link name="l${{p1199}}"/>'))
    words = ["expand", str(path), "--source-map", str(tmp_path / "map.json"), "-o", str(tmp_path / "out")]
    assert run(words) in (0, 2), capsys.readouterr()
