"""Every verb answers a hostile file within 10 s of CPU time and 1 GB of memory."""

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

VERBS = {
    "expand": ("expand", "FILE"),
    "where": ("where", "FILE", "base_link"),
    "info": ("info", "FILE"),
    "export": ("export", "FILE", "--to", "glb", "-o", "-"),
    "check": ("check", "FILE"),
    "view": ("view", "FILE", "--shot", "robot.png"),  # the page opens on files with errors
    "sim headless": ("sim", "FILE", "--headless", "--duration", "0.1"),
}

H = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">'


@pytest.mark.parametrize("verb", VERBS)
def test_a_file_that_is_not_a_robot_is_rejected(
    verb: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    file = tmp_path / "robot.xacro"
    file.write_text(f'{H}<link name="${{1 +}}"/></robot>')
    result = measured_kbot(*(str(file) if word == "FILE" else word for word in VERBS[verb]))
    assert result.is_refusal(), result


DIGITS = f'{H}<link name="base_link"/><link name="${{2**20000}}"/></robot>'
SEARCH = f"{H}<link name=\"${{('a'*3000000).rfind('ab'+'a'*1000000)}}\"/></robot>"
KEYS = "range(0, 2305843009213693951 * 100000, 2305843009213693951)"
COLLISIONS = f'{H}<link name="${{len(dict.fromkeys({KEYS}))}}"/></robot>'


def doubled(count: int) -> str:
    """A robot with properties that double each other."""
    properties = "".join(
        f'<xacro:property name="p{i + 1}" value="${{p{i}}}${{p{i}}}"/>' for i in range(count)
    )
    first = '<xacro:property name="p0" value="aaaaaaaaaa"/>'
    return f'{H}{first}{properties}<link name="${{p{count}}}"/></robot>'


@pytest.mark.parametrize("verb", VERBS)
def test_a_number_of_too_many_digits_is_one_error(
    verb: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    file = tmp_path / "robot.xacro"
    file.write_text(DIGITS)
    result = measured_kbot(*(str(file) if word == "FILE" else word for word in VERBS[verb]))
    assert result.is_refusal(), result
    assert f"robot.xacro:1:{DIGITS.index('${') + 1}" in result.out + result.err


@pytest.mark.parametrize(
    "text", [SEARCH, COLLISIONS, doubled(27), doubled(60)], ids=["search", "collisions", "p27", "p60"]
)
def test_the_work_and_size_of_expressions_are_bounded(
    text: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    file = tmp_path / "robot.xacro"
    file.write_text(text)
    result = measured_kbot("expand", file)
    assert result.is_refusal(), result
    assert result.err.count("error") == 1


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("a.launch", '<param name="a" value="$(eval {})"/>'),
        ("a.launch.xml", "<let name='a' value='$(eval \"{}\")'/>"),
    ],
)
def test_expressions_of_launch_files_are_bounded(
    name: str, line: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    expression = "('a' * 3000000).rfind('ab' + 'a' * 1000000)"
    if name == "a.launch.xml":
        expression = expression.replace("'", "&apos;")
    (tmp_path / name).write_text(f"<launch>{line.format(expression)}</launch>")
    result = measured_kbot("launch", tmp_path / name, "--no-browser")
    assert result.is_refusal(), result
    assert "too many steps" in result.err
    assert "L014" in result.err


def test_remarks_of_the_image_library_are_not_printed(tmp_path: Path, run_kbot: Callable[..., Any]) -> None:
    (tmp_path / "big.pgm").write_bytes(b"P5\n10000 10000\n255\n")
    (tmp_path / "big.yaml").write_text(
        "image: big.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    ended = run_kbot("sim", "kbot", "--headless", "--world", "big.yaml")
    assert ended.status == 2
    assert ended.err.splitlines() == [
        "error: the image big.pgm has 10000 x 10000 pixels, more than 50000000 pixels"
    ]


@pytest.fixture
def deep_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with 1100 nested ones. Python nests 1000 calls."""
    folder = tmp_path / "deep"
    folder.mkdir()
    with monkeypatch.context() as inner:
        inner.chdir(folder)
        for _ in range(1100):  # the system takes shorter paths only
            os.mkdir("a")  # noqa: PTH102 - relative to the working directory
            os.chdir("a")
    yield folder
    with monkeypatch.context() as inner:
        inner.chdir(folder)
        for _ in range(1100):
            os.chdir("a")
        for _ in range(1100):
            os.chdir("..")
            os.rmdir("a")  # noqa: PTH106


@pytest.mark.skipif(sys.platform == "win32", reason="paths of Windows have 260 characters")
def test_a_folder_may_be_nested_deeply(deep_folder: Path, measured_kbot: Callable[..., Any]) -> None:
    for words in (
        ("check", "deep"),
        ("try", "deep"),
        ("try", "deep", "--battery", "all"),
        ("compare", "deep", "deep"),
        ("launch", "deep", "x.launch"),
        ("launch", "deep"),
    ):
        result = measured_kbot(*words)
        assert (result.status, result.is_bounded()) == (2, True), result
        assert "error" in result.out + result.err
        assert "internal error" not in result.err, result
