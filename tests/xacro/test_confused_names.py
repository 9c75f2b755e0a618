"""A name used as another kind of name: following the advice gives the value that is meant, as in xacro."""

from __future__ import annotations

from pathlib import Path
from xml.dom import minidom

import pytest

from kbot.checks import Config, check_file, check_text
from kbot.text import Diagnostic, Fix
from kbot.text.edits import apply_edits
from kbot.xacro import expand_text

from . import xacro_official

HEAD = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    '  <xacro:arg name="kind" default="gz"/>\n'
    '  <xacro:arg name="radius" default="0.05"/>\n'
    '  <xacro:arg name="down" default="-2"/>\n'
    '  <xacro:arg name="use" default="true"/>\n'
    '  <xacro:arg name="empty" default=""/>\n'
    '  <xacro:arg name="stack" default="2dnav"/>\n'
    '  <xacro:arg name="which" default="some_radius"/>\n'
    '  <xacro:arg name="size" default="5cm"/>\n'
    '  <xacro:property name="wheel_r" value="0.05"/>\n'
    '  <xacro:property name="kinds" value="${dict(gz=1)}"/>\n'
)


def robot(value: str) -> str:
    return f'{HEAD}  <link name="base" value="{value}"/>\n</robot>\n'


def the_error(text: str) -> Diagnostic:
    (error,) = (d for d in expand_text(text, "robot.xacro").diagnostics if d.is_error)
    return error


def the_fix(text: str) -> Fix:
    (fix,) = (d.fix for d in check_text(text, "robot.xacro", config=Config()) if d.code[0] == "X")
    assert fix is not None
    return fix


def official_value(text: str) -> str:
    """The value of the link's attribute in the output of the official xacro."""
    written = xacro_official.expand_text(text)
    assert written is not None, text
    return minidom.parseString(written).getElementsByTagName("link")[0].getAttribute("value")


IS_ARGUMENT = "'{}' is an argument, not a property"
IS_PROPERTY = "'{}' is a property, not an argument"
UNQUOTED = "the text '{}' of $(arg {}) has no quotes, so it is read as an expression"

CONFUSED = [
    # an argument used as a property
    ("${kind == 'gz'}", IS_ARGUMENT.format("kind"), "'$(arg kind)'", "${'$(arg kind)' == 'gz'}", "True"),
    ("${radius * 2}", IS_ARGUMENT.format("radius"), "$(arg radius)", "${$(arg radius) * 2}", "0.1"),
    ("${down**2}", IS_ARGUMENT.format("down"), "($(arg down))", "${($(arg down))**2}", "4"),
    # a text without quotes
    ("${$(arg kind) == 'gz'}", UNQUOTED.format("gz", "kind"),
     "'$(arg kind)'", "${'$(arg kind)' == 'gz'}", "True"),
    ("${$(arg empty) == 'gz'}", UNQUOTED.format("", "empty"),
     "'$(arg empty)'", "${'$(arg empty)' == 'gz'}", "False"),
    ("${$(arg stack) in ['a', '2dnav']}", UNQUOTED.format("2dnav", "stack"), "'$(arg stack)'",
     "${'$(arg stack)' in ['a', '2dnav']}", "True"),
    ("${kinds[$(arg kind)]}", UNQUOTED.format("gz", "kind"), "'$(arg kind)'", "${kinds['$(arg kind)']}", "1"),
    ("${'a_' + $(arg kind)}", UNQUOTED.format("gz", "kind"),
     "'$(arg kind)'", "${'a_' + '$(arg kind)'}", "a_gz"),
    # a property read as an argument
    ("$(arg wheel_r)", IS_PROPERTY.format("wheel_r"), "${wheel_r}", "${wheel_r}", "0.05"),
    ("${$(arg wheel_r) * 2}", IS_PROPERTY.format("wheel_r"), "name: wheel_r", "${wheel_r * 2}", "0.1"),
    ("$(eval wheel_r * 2)", "'wheel_r' is a property, and $(eval …) knows only arguments", "${wheel_r * 2}",
     "${wheel_r * 2}", "0.1"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "message", "hint", "right", "value"), CONFUSED, ids=[c[0] for c in CONFUSED]
)
def test_the_form_in_the_hint_has_the_value_that_the_author_means(
    wrong: str, message: str, hint: str, right: str, value: str
) -> None:
    error = the_error(robot(wrong))
    assert (error.message, error.origin and error.origin.span.text) == (message, wrong)
    assert hint in error.hint
    assert xacro_official.expand_text(robot(wrong)) is None
    assert official_value(robot(right)) == value


@pytest.mark.parametrize("name", ["kind", "radius", "down", "use"])
def test_fix_defines_a_property_with_the_value_of_the_argument(name: str) -> None:
    wrong = robot(f"${{{name}}}")
    line = f'<xacro:property name="{name}" value="$(arg {name})"/>'
    assert line in the_error(wrong).hint

    fix = the_fix(wrong)
    assert not fix.safe
    text = apply_edits(wrong, fix.edits)
    assert f"\n  {line}\n" in text
    expected = {"kind": "gz", "radius": "0.05", "down": "-2", "use": "True"}[name]
    assert official_value(text) == expected


def test_no_short_form_is_suggested_for_a_truth_value() -> None:
    """`${$(arg use)}` is `${true}`, and `true` is not a name of xacro."""
    assert xacro_official.expand_text(robot("${$(arg use)}")) is None
    assert the_error(robot("${use}")).hint.startswith("define a property")


def test_fix_reads_a_property_at_every_place() -> None:
    text = robot("$(arg wheel_r)").replace("</robot>", '<link name="b" value="1 $(arg  wheel_r)"/></robot>')
    after = apply_edits(text, the_fix(text).edits)
    assert after == text.replace("$(arg wheel_r)", "${wheel_r}").replace("$(arg  wheel_r)", "${wheel_r}")


def test_parameter_of_a_macro_is_read_without_arg() -> None:
    macro = (
        '<xacro:macro name="m" params="side n:=3"><link name="$(arg side)" value="$(arg n)"/></xacro:macro>'
    )
    text = f'{HEAD}{macro}<xacro:m side="left"/></robot>'
    errors = [d for d in expand_text(text, "robot.xacro").diagnostics if d.is_error]
    assert [(d.message, d.hint) for d in errors] == [
        ("'side' is a parameter of the macro, not an argument", "write ${side}"),
        ("'n' is a parameter of the macro, not an argument", "write ${n}"),
    ]


def test_argument_of_an_included_file_has_no_fix_in_the_other_file(tmp_path: Path) -> None:
    """Its property would be in the namespace of the include."""
    (tmp_path / "part.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="kind" default="gz"/></robot>',
        "utf-8",
    )
    path = tmp_path / "robot.xacro"
    path.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="part.xacro" ns="p"/>'
        '<link name="base"/><xacro:if value="${kind == \'gz\'}"/></robot>',
        "utf-8",
    )
    error = next(d for d in check_file(str(path), config=Config()) if d.code == "X103")
    assert error.message == "'kind' is an argument, not a property"
    assert error.fix is None


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        (
            '<link name="${late}"/><xacro:arg name="late" default="a"/>',
            "'late' is an argument, not a property",
            "declare it before its first use, and write '$(arg late)'",
        ),
        (
            '<link name="$(arg late)"/><xacro:property name="late" value="a"/>',
            "'late' is a property, not an argument",
            "define it before its first use, and write ${late}",
        ),
        (
            '<xacro:arg name="late" default="a"/><link name="${late}"/>'
            '<xacro:property name="late" value="$(arg late)"/>',
            "unknown property 'late'",
            "it is defined only further down. Define it before its first use",
        ),
    ],
)
def test_name_that_is_declared_further_down(text: str, message: str, hint: str) -> None:
    error = the_error(f"{HEAD}{text}</robot>")
    assert error.message == message
    assert error.hint.startswith(hint)


@pytest.mark.parametrize(
    ("value", "hint", "is_true"),
    [
        ("$(arg kind) == 'gz'", "write ${'$(arg kind)' == 'gz'}", True),
        ("wheel_r == 3", "write ${wheel_r == 3}", False),
        ("$(arg kind)", "write true, false, or a comparison: ${a == b}", None),
    ],
)
def test_condition_without_braces(value: str, hint: str, is_true: bool | None) -> None:
    text = f'{HEAD}<xacro:if value="{value}"><link name="in"/></xacro:if><link name="base"/></robot>'
    assert the_error(text).hint == hint
    if is_true is not None:
        right = xacro_official.expand_text(text.replace(value, hint.removeprefix("write ")))
        assert right is not None
        assert ('name="in"' in right) is is_true


@pytest.mark.parametrize(
    ("value", "message", "hint"),
    [
        # quotes would not help where a number is needed
        ("${$(arg which) * 2}", "unknown property 'some_radius', which is the value of $(arg which)",
         "give it a number or the name of a property"),
        ("${$(arg size) * 2}", "invalid expression: the number 5cm has a unit", "write 0.05"),
        ("${'$(arg kind)' == 'gz' and missing}", "unknown property 'missing'",
         'Define it with <xacro:property name="missing" value="…"/>'),
    ],
)  # fmt: skip
def test_fault_that_is_not_a_missing_quote(value: str, message: str, hint: str) -> None:
    error = the_error(robot(value))
    assert (error.message, error.hint) == (message, hint)
