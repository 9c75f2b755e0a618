"""Tests `name:=value`: it sets an argument or else a top-level property. Other names are errors."""

from pathlib import Path

import pytest

from kbot.text import DescriptionError
from kbot.xacro import expand
from kbot.xacro.assignments import Assignments, resolve_names

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join((HEAD, *lines, "</robot>\n")))
    return path


def expanded(file: Path, given: Assignments) -> list[dict[str, str]]:
    """The attributes of the plain elements, expanded with the typed values."""
    document = expand(file, given.arguments, properties=given.properties).require().document
    assert document is not None
    return [element.attributes for element in document.elements()]


def test_an_argument_is_an_argument_and_a_property_is_overridden(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro",
        '<xacro:property name="radius" value="0.035"/>',
        '<xacro:arg name="height" default="1"/>',
        '<a r="${2 * radius}" h="$(arg height)"/>',
    )
    given = resolve_names(file, {"radius": "0.06", "height": "2"}).require()
    assert given.properties == {"radius": "0.06"}
    assert given.notes == (f"the property radius is set to 0.06; {file}:2 has 0.035",)
    assert expanded(file, given) == [{"r": "0.12", "h": "2"}]
    assert expand(file, given.arguments, properties=given.properties).diagnostics == ()


def test_an_argument_that_is_declared_after_a_property_of_its_name_is_an_argument(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro",
        '<xacro:property name="radius" value="7"/>',
        '<xacro:arg name="radius" default="1"/>',
        '<a r="${radius}" arg="$(arg radius)"/>',
    )
    given = resolve_names(file, {"radius": "2"}).require()
    assert (given.properties, given.notes) == ({}, ())
    assert expanded(file, given) == [{"r": "7", "arg": "2"}]


@pytest.mark.parametrize(
    ("lines", "note"),
    [
        (['<xacro:property name="p" value="1"/>', '<xacro:property name="p" value="2"/>'], "r.xacro:3 has 2"),
        (['<xacro:property name="p" default="1"/>'], "r.xacro:2 has 1"),
        (
            ['<xacro:property name="p" value="1"/>', '<xacro:property name="p" default="2"/>'],
            "r.xacro:2 has 1",
        ),
        (['<xacro:property name="p" value="${1 + 2}" lazy_eval="false"/>'], "r.xacro:2 has 3"),
        (['<xacro:property name="p" value="${1 + 2}"/>'], "r.xacro:2 has 3"),
        (['<xacro:property name="p" value="${[1]}"/>'], "r.xacro:2 has ${[1]}"),
        (['<xacro:if value="true"><xacro:property name="p" value="1"/></xacro:if>'], "r.xacro:2 has 1"),
        (['<xacro:include filename="part.xacro"/>'], "part.xacro:2 has 5"),
        (
            [
                '<xacro:macro name="m"><xacro:property name="p" value="1" scope="global"/></xacro:macro>',
                "<xacro:m/>",
            ],
            "r.xacro:2 has 1",
        ),
    ],
)
def test_every_top_level_definition_is_overridden(
    tmp_path: Path, lines: list[str], note: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "part.xacro", '<xacro:property name="p" value="5"/>')
    file = write(Path("r.xacro"), *lines, '<a p="${p + 1}"/>')
    given = resolve_names(file, {"p": "8"}).require()
    assert given.notes == (f"the property p is set to 8; {note}",)
    assert expanded(file, given) == [{"p": "9"}]


def test_intermediate_values_of_a_property_are_overridden_too(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro",
        '<xacro:property name="p" value="1"/><a p="${p}"/><xacro:property name="p" value="2"/><a p="${p}"/>',
        '<xacro:property name="q" value="1"/><a p="${q}"/><xacro:property name="q" remove="true"/>',
    )
    given = resolve_names(file, {"p": "8", "q": "9"}).require()
    assert expanded(file, given) == [{"p": "8"}, {"p": "8"}, {"p": "9"}]
    assert given.notes[1] == "the property q is set to 9"


def test_properties_of_macros_and_namespaces_and_blocks_are_not_overridden(tmp_path: Path) -> None:
    write(tmp_path / "part.xacro", '<xacro:property name="inner" value="5"/>')
    file = write(
        tmp_path / "r.xacro",
        '<xacro:macro name="m" params="param"><xacro:property name="local" value="1"/></xacro:macro>',
        '<xacro:include filename="part.xacro" ns="n"/><xacro:m param="2"/>',
        '<xacro:property name="block"><b/></xacro:property>',
    )
    names = ("param", "local", "inner", "block")
    assert tuple(resolve_names(file, dict.fromkeys(names, "8")).unknown) == names


def test_a_local_property_of_the_same_name_is_not_changed(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro",
        '<xacro:property name="p" value="1"/>',
        '<xacro:macro name="m" params="q"><xacro:property name="p" value="2"/><a p="${p}"/></xacro:macro>',
        '<xacro:m q="1"/><a p="${p}"/>',
    )
    assert expanded(file, resolve_names(file, {"p": "8"})) == [{"p": "2"}, {"p": "8"}]


def test_an_override_may_lead_to_the_declaration_of_another_name(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro",
        '<xacro:property name="lidar" value="false"/>',
        '<xacro:if value="${lidar}"><xacro:arg name="range" default="1"/><a r="$(arg range)"/></xacro:if>',
        '<xacro:if value="${lidar}"><xacro:property name="rays" value="4"/><a r="${rays}"/></xacro:if>',
    )
    given = resolve_names(file, {"range": "3", "lidar": "true", "rays": "8"}).require()
    assert given.properties == {"lidar": "true", "rays": "8"}
    assert expanded(file, given) == [{"r": "3"}, {"r": "8"}]
    assert [*resolve_names(file, {"range": "3"}).unknown] == ["range"]


def test_any_other_name_is_an_error_with_the_nearest_names(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro",
        '<xacro:arg name="wheel_width" default="1"/><xacro:property name="wheel_radius" value="2"/>',
    )
    with pytest.raises(DescriptionError) as raised:
        resolve_names(file, {"wheel_raduis": "3", "wheel_width": "2"}).require()
    assert str(raised.value) == (
        f"{file}:1:1: error: there is no argument or top-level property 'wheel_raduis'; "
        "the nearest names are wheel_radius (property), wheel_width (argument) [X206]"
    )
    with pytest.raises(DescriptionError, match="the file declares no arguments and no properties"):
        resolve_names(write(file, "<a/>"), {"a": "1"}).require()


@pytest.mark.parametrize("value", ["0,05", "", "abc", "${0.05}"])
def test_a_text_for_a_property_that_is_a_number_is_one_error(tmp_path: Path, value: str) -> None:
    file = write(
        tmp_path / "r.xacro", '<xacro:property name="p" value="0.035"/>', '<a p="${p + 1}" q="${2.0 * p}"/>'
    )
    with pytest.raises(DescriptionError) as raised:
        resolve_names(file, {"p": value})
    assert (
        str(raised.value) == f"{file}:2:33: error: the value given for p, '{value}', is not a number [X206]"
    )
    assert raised.value.diagnostics[0].hint == "the file has 0.035. Write a number, with a decimal point"


@pytest.mark.parametrize("value", ["left", "true", " 2 ", "1e-3"])
def test_a_number_may_become_a_word_that_causes_no_error(tmp_path: Path, value: str) -> None:
    file = write(tmp_path / "r.xacro", '<xacro:property name="p" value="1"/>', '<a p="${p}_wheel"/>')
    assert resolve_names(file, {"p": value}).properties == {"p": value}


def test_in_a_file_with_errors_no_name_is_unknown(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro",
        '<xacro:include filename="none.xacro"/>',
        '<xacro:property name="p" value="0"/><a p="${1 / p}"/>',
    )
    given = resolve_names(file, {"elsewhere": "1", "p": "2"}).require()
    assert given.properties == {"p": "2"}
    diagnostics = expand(file, given.arguments, properties=given.properties).diagnostics
    assert [d.code for d in diagnostics if d.is_error] == ["X117"]


def test_the_origin_of_an_override_is_the_property_s_own_line(tmp_path: Path) -> None:
    file = write(
        tmp_path / "r.xacro", '<xacro:property name="p" value="1"/>', '<a p="${p}"/>', '<b q="${p}"/>'
    )
    expansion = expand(file, properties={"p": "8"}).require()
    trace = expansion.source_map.at(7, 6)
    assert trace is not None
    assert [(b.name, b.value, str(b.origin)) for b in trace.inputs] == [("p", 8, f"{file}:2:33")]
