"""Tests that `kbot where` leads from a name or a position in the result to the source."""

import json
from pathlib import Path

import pytest

from kbot.cli.main import run

TEXT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="width" value="2"/>
  <xacro:macro name="wheel" params="side"><link name="${side}_wheel" w="${width}"/></xacro:macro>
  <xacro:wheel side="left"/>
</robot>
"""


@pytest.fixture
def robot(tmp_path: Path) -> str:
    path = tmp_path / "r.xacro"
    path.write_text(TEXT)
    return str(path)


def test_a_link(robot: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["where", robot, "left_wheel"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{robot}:3:43: link 'left_wheel'"
    assert lines[1] == f"  from macro 'wheel', called at {robot}:4:3"


@pytest.mark.parametrize(("name", "place"), [("width", "2:39: property"), ("wheel", "3:3: macro")])
def test_a_definition(robot: str, name: str, place: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["where", robot, name]) == 0
    assert f"{robot}:{place} '{name}'" in capsys.readouterr().out


def test_a_position_in_the_result(robot: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["where", robot, "7:30", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["found"]
    assert (found["name"], found["line"]) == ("link@w", 3)
    assert found["bindings"][0]["name"] == "width"


def test_an_unknown_name_has_a_suggestion(robot: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["where", robot, "left_whel"]) == 2
    assert "did you mean 'left_wheel'" in capsys.readouterr().err
