"""Tests that the source map leads from the result to the source."""

import json
from pathlib import Path

import pytest

from kbot.xacro import Expansion, expand_text
from kbot.xacro.definitions import definitions

TEXT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="radius" value="${size / 2}"/>
  <xacro:property name="size" value="0.3"/>
  <xacro:macro name="wheel" params="side">
    <link name="${side}_wheel">
      <cylinder radius="${radius}" length="0.1"/>
    </link>
  </xacro:macro>
  <xacro:wheel side="left"/>
</robot>
"""


@pytest.fixture
def expansion() -> Expansion:
    return expand_text(TEXT, "robot.xacro").require()


def test_an_element_by_name(expansion: Expansion) -> None:
    (trace,) = expansion.source_map.find("left_wheel", "link")
    assert str(trace.origin) == "robot.xacro:5:5"
    assert [(call.name, str(call.span)) for call in trace.origin.stack] == [("wheel", "robot.xacro:9:3")]


def test_an_attribute_by_its_position_in_the_result(expansion: Expansion) -> None:
    lines = expansion.text.splitlines()
    number = next(n for n, line in enumerate(lines, 1) if "cylinder" in line)
    column = lines[number - 1].index('radius="') + 3
    trace = expansion.source_map.at(number, column)
    assert trace is not None
    assert trace.attribute == "radius"
    assert [span.text for span in trace.expressions] == ["${radius}"]
    (radius,) = trace.inputs
    assert (radius.name, radius.value, str(radius.origin)) == ("radius", 0.15, "robot.xacro:2:40")
    assert [(b.name, b.value) for b in radius.inputs] == [("size", 0.3)]


def test_a_line_without_column_is_its_first_element(expansion: Expansion) -> None:
    number = next(n for n, line in enumerate(expansion.text.splitlines(), 1) if "<link" in line)
    trace = expansion.source_map.at(number)
    assert trace is not None
    assert trace.name == "link 'left_wheel'"


def test_every_element_of_the_result_has_a_source(expansion: Expansion) -> None:
    for trace in expansion.source_map.elements():
        assert trace.origin.span.text.startswith(f"<{trace.element.tag}")
        assert trace.output.text.startswith(f"<{trace.element.tag}")


def test_definitions(expansion: Expansion) -> None:
    found = {(d.kind, d.name): str(d.origin) for d in definitions(expansion)}
    assert found[("property", "size")] == "robot.xacro:3:38"
    assert found[("macro", "wheel")] == "robot.xacro:4:3"


def test_json(expansion: Expansion) -> None:
    document = json.loads(expansion.source_map.to_json())
    assert document["version"] == 1
    assert document["files"] == ["robot.xacro"]
    link = next(e for e in document["elements"] if e.get("name") == "left_wheel")
    assert link["source"][:3] == [0, 5, 5]
    assert document["calls"][link["call"]]["name"] == "wheel"
    cylinder = next(e for e in document["elements"] if e["tag"] == "cylinder")
    radius = document["bindings"][cylinder["attributes"]["radius"]["bindings"][0]]
    assert (radius["name"], radius["value"]) == ("radius", 0.15)


def test_attributes_set_by_a_tag_have_the_tag_as_origin(tmp_path: Path) -> None:
    text = '<r xmlns:xacro="http://www.ros.org/wiki/xacro"><l>\n<xacro:attribute name="a" value="b"/></l></r>'
    document = expand_text(text, "f").require().document
    assert document is not None
    element = document.find("l")
    assert element is not None
    assert str(element.attribute_origin("a")) == "f:2:34"
