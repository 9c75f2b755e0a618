"""Checking unsaved texts, as an editor does at each keystroke."""

from __future__ import annotations

import gc
import tracemalloc
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kbot.checks import Config, OpenFiles, check_file, check_text
from kbot.text import Diagnostic
from kbot.xacro import clear_cache, files

from .robots import ROVERS, rover

LIBRARY = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="ball" params="name radius">
    <link name="${name}">
      <inertial>
        <mass value="1"/>
        <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.004"/>
      </inertial>
      <visual><geometry><sphere radius="${radius}"/></geometry></visual>
      <collision><geometry><sphere radius="${radius}"/></geometry></collision>
    </link>
  </xacro:macro>
</robot>
"""
ROBOT = """<robot name="one" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="library.xacro"/>
  <link name="base"/>
  <xacro:ball name="tip" radius="0.1"/>
  <joint name="hinge" type="fixed"><parent link="base"/><child link="tip"/></joint>
</robot>
"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    (tmp_path / "library.xacro").write_text(LIBRARY)
    (tmp_path / "robot.xacro").write_text(ROBOT)
    return tmp_path / "robot.xacro"


def keys_of(found: tuple[Diagnostic, ...]) -> list[tuple[str, str, str]]:
    return [(d.code, d.message, str(d.origin)) for d in found]


def test_unsaved_text_is_checked_until_the_file_is_closed(robot: Path) -> None:
    files_open = OpenFiles(config=Config())
    assert files_open.check(str(robot)) == ()
    files_open.edit(str(robot), ROBOT.replace('child link="tip"', 'child link="tap"'))
    assert [d.code for d in files_open.check(str(robot))] == ["U007"]
    files_open.close(str(robot))
    assert files_open.check(str(robot)) == ()


def test_unsaved_included_file_is_checked_with_its_robot(robot: Path) -> None:
    files_open = OpenFiles(config=Config())
    library = str(robot.parent / "library.xacro")
    files_open.edit(library, LIBRARY.replace("<visual>", "<viusal>").replace("</visual>", "</viusal>"))
    (finding,) = files_open.check(str(robot))
    assert finding.code == "U201"
    assert finding.origin is not None
    assert finding.origin.span.file == library
    assert finding.origin.span.line == 8
    assert check_file(str(robot), config=Config()) == ()


def test_change_on_disk_of_a_closed_file_is_noticed(robot: Path) -> None:
    files_open = OpenFiles(config=Config())
    files_open.edit(str(robot), ROBOT)
    assert files_open.check(str(robot)) == ()
    (robot.parent / "library.xacro").write_text(LIBRARY.replace('mass value="1"', 'mass value="-1"'))
    assert "I102" in {d.code for d in files_open.check(str(robot))}


def test_missing_file_is_a_finding_unless_it_is_open(tmp_path: Path) -> None:
    files_open = OpenFiles(config=Config())
    path = str(tmp_path / "new.urdf")
    assert [d.code for d in files_open.check(path)] == ["F001"]
    files_open.edit(path, '<robot name="new"><link name="base"/></robot>')
    assert files_open.check(path) == ()


def test_edit_of_one_file_parses_only_that_file(robot: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parses: Counter[str] = Counter()
    parse = files.parse_document

    def counted(source, *limits, **options):
        parses[Path(source.path).name] += 1
        return parse(source, *limits, **options)

    clear_cache()
    monkeypatch.setattr(files, "parse_document", counted)
    files_open = OpenFiles(config=Config())
    files_open.check(str(robot))
    assert parses == {"robot.xacro": 1, "library.xacro": 1}
    for blanks in range(1, 4):
        files_open.edit(str(robot), ROBOT + " " * blanks)
        files_open.check(str(robot))
        assert parses == {"robot.xacro": 1 + blanks, "library.xacro": 1}
    files_open.edit(str(robot.parent / "library.xacro"), LIBRARY + " ")
    files_open.check(str(robot))
    assert parses == {"robot.xacro": 4, "library.xacro": 2}
    files_open.check(str(robot))
    assert parses == {"robot.xacro": 4, "library.xacro": 2}


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_findings_after_edits_equal_those_of_a_fresh_start(data: st.DataObject) -> None:
    files_open = OpenFiles(config=Config())
    text = rover(ROVERS[0])
    for _ in range(3):
        at = data.draw(st.integers(0, len(text) - 1))
        cut = data.draw(st.integers(0, 3))
        text = text[:at] + data.draw(st.sampled_from(["", "x", "0", "<", '"', "}", "$"])) + text[at + cut :]
        files_open.edit("rover.xacro", text)
        warm = keys_of(files_open.check("rover.xacro"))
        clear_cache()
        assert keys_of(check_text(text, "rover.xacro", config=Config())) == warm


def test_many_edits_do_not_increase_memory() -> None:
    files_open = OpenFiles(config=Config())
    text = rover(ROVERS[0])

    def type_on(start: int, count: int) -> None:
        for number in range(start, start + count):
            files_open.edit("rover.xacro", text.replace("</robot>", f"<!-- {number} --></robot>"))
            files_open.check("rover.xacro")

    type_on(0, 30)
    tracemalloc.start()
    try:
        type_on(30, 10)
        gc.collect()
        before = tracemalloc.get_traced_memory()[0]
        type_on(40, 100)
        gc.collect()
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert grown < 5 * len(text)  # a hundred cached texts would take more than a hundred times as much
