"""Errors of expressions are worded for a reader who does not know Python."""

from __future__ import annotations

import pytest

from kbot.checks import Config, check_text
from kbot.text import Diagnostic
from kbot.text.edits import apply_edits
from kbot.xacro import expand_text

HEAD = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    '<xacro:property name="comma" value="0,035"/>\n'
    '<xacro:property name="offset" value="-0.0125"/>\n'
    '<xacro:property name="doubled" value="-${offset}"/>\n'
    '<xacro:property name="side" value="front"/>\n'
    '<xacro:property name="n" value="2"/>\n'
    '<xacro:property name="sizes" value="${[1, 2]}"/>\n'
)
PYTHONS_WORDS = ("concatenate", "NoneType", "'str'", "'int'", "'float'", "operand", "object", "subscript")


def test_a_letter_in_place_of_a_digit_is_reported_where_it_is_written() -> None:
    text = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="r" value="O.035"/>'
        '<link name="a"><inertial><mass value="${3*r*r}"/></inertial></link><link name="l${r*2}"/></robot>'
    )
    (found,) = expand_text(text, "f").diagnostics
    assert found.message == "r: 'O.035' is text, not a number: a letter is in place of a digit"
    assert found.hint == "write 0.035"
    assert found.fix is not None
    assert found.fix.edits[0].replacement == "0.035"


@pytest.mark.parametrize(
    ("expression", "message", "hint", "line"),
    [
        ("comma + 0.005", "comma: '0,035' is text, not a number", "write 0.035", 2),
        ("n * 0.5 * comma", "comma: '0,035' is text, not a number", "write 0.035", 2),
        ("-comma", "comma: '0,035' is text, not a number", "write 0.035", 2),
        ("sqrt(comma)", "comma: '0,035' is text, not a number", "write 0.035", 2),
        ("comma &lt; 1", "comma: '0,035' is text, not a number", "write 0.035", 2),
        (
            "doubled / 2",
            "'--0.0125' is text, not a number: offset is negative, so '-${offset}' has two minus signs",
            "write the minus sign inside the expression: ${-offset}",
            4,
        ),
        (
            "side + 1",
            "'side' is the text 'front', not a number, in 'side + 1'",
            "its value is written at f:5:36",
            8,
        ),
        ("1 / (n - 2)", "division by zero: 'n - 2' is 0, in '1 / (n - 2)'", "", 8),
        ("n / 0", "division by zero, in 'n / 0'", "", 8),
        ("n ^ 0.5", "'^' is not a power in an expression, in 'n ^ 0.5'", "write n**0.5", 8),
        ("sin * 2", "'sin' is a function, in 'sin * 2'", "call it: sin(…)", 8),
        ("2(n)", "2 is a number, not a function, in '2(n)'", "to multiply, write 2*(n)", 8),
        ("n(2)", "'n' is a number, not a function, in 'n(2)'", "to multiply, write n*(2)", 8),
        ("sqrt(-1)", "sqrt(-1) is not defined", "'sqrt(-1)' has no real result for this value", 8),
        ("sqrt(1, 2)", "sqrt() takes one argument, not 2, in 'sqrt(1, 2)'", "", 8),
        ("sizes[5]", "'sizes' has 2 entries, so there is no entry 5, in 'sizes[5]'", "count from 0", 8),
        ("max()", "max() takes at least 1 argument, not 0", "", 8),
        ("[n][5]", "'[n]' has 1 entry, so there is no entry 5, in '[n][5]'", "count from 0", 8),
        (
            "sizes['x']",
            "'sizes' is a list: its index must be a whole number, not 'x'",
            "entries have the numbers 0 to 1",
            8,
        ),
        (
            "side['x']",
            "'side' is text, so it has no entry 'x', in 'side['x']'",
            "pass a list or dictionary",
            8,
        ),
        ("n.x", "'n' is a number, so it has no '.x', in 'n.x'", "", 8),
        ("0,035 + n", "invalid expression: a decimal comma", "write 0.035", 8),
        ("n * (2", "invalid expression: a '(' is not closed", "add ')'", 8),
        ("n * 2)", "invalid expression: one ')' too many", "remove it, or add the '(' that it closes", 8),
        ("n n", "invalid expression: an operator is missing between 'n' and 'n'", "write n * n", 8),
        ("2n", "invalid expression: an operator is missing in '2n'", "write 2*n", 8),
        ("5 mm", "invalid expression: the number 5 mm has a unit", "write 0.005", 8),
        ("90 deg", "invalid expression: the number 90 deg has a unit", "write radians(90)", 8),
        ("5 cm + 1", "invalid expression: the number 5 cm has a unit", "write 0.05", 8),
        ("2m", "the number 2m has a unit", "write 2, or 2*m if 'm' is a property", 8),
        ("sin 3", "invalid expression: brackets are missing after 'sin'", "write sin(3)", 8),
        ("sin 3*n", "invalid expression: brackets are missing after 'sin'", "write sin(…)", 8),
        ("1e5 n", "an operator is missing between '1e5' and 'n'", "write 1e5 * n", 8),
        ("2effort", "an operator is missing in '2effort'", "write 2*effort", 8),
        ("pi()", "'pi' is a number, not a function, in 'pi()'", "write pi without brackets", 8),
        (
            "sizes[n/4]",
            "'sizes' is a list: its index must be a whole number, not '0.5'",
            "entries have the numbers 0 to 1",
            8,
        ),
        ("float('90deg')", "'90deg' is text, not a number", "write radians(90)", 8),
        ("5mm", "invalid expression: the number 5mm has a unit", "write 0.005", 8),
        ("n +", "invalid expression: a value is missing after '+'", "write the value", 8),
        ("n = 2", "invalid expression: '=' is not a comparison", "write ==", 8),
        ("n &amp;&amp; 2", "invalid expression: '&&' is not an operator", "write and", 8),
        ("n \N{MULTIPLICATION SIGN} 2", "'\N{MULTIPLICATION SIGN}' is not an operator", "write *", 8),
        ("'abc", "invalid expression: a quote is not closed", "write '", 8),
        ("[i + comma for i in sizes]", "a value is not a number", "", 8),
    ],
)
def test_an_error_is_worded_for_a_student(expression: str, message: str, hint: str, line: int) -> None:
    found = expand_text(f'{HEAD}<a x="${{{expression}}}"/></robot>', "f").diagnostics
    (error,) = [d for d in found if d.is_error]
    assert message in error.message
    assert error.hint.startswith(hint)
    assert error.origin is not None
    assert error.origin.span.line == line
    assert not any(word in error.message for word in PYTHONS_WORDS)


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("1e5m", "invalid expression: '1e5m' is not a number"),
        ("1e", "invalid expression: '1e' is not a number"),
        ("0b12", "invalid expression: '0b12' is not a number"),
        ("1__0", "invalid expression: '1__0' is not a number"),
        ("'%d' % 'a'", "the value after '%' does not fit the format '%d', in ''%d' % 'a''"),
        ("len(5)", "'5' is a number, and len() needs a list or text, in 'len(5)'"),
        ("max()", "max() takes at least 1 argument, not 0"),
        ("n(1, 2)", "'n' is a number, not a function, in 'n(1, 2)'"),
    ],
)
def test_an_error_without_a_certain_correction_has_no_suggestion(expression: str, message: str) -> None:
    (error,) = expand_text(f'{HEAD}<a x="${{{expression}}}"/></robot>', "f").diagnostics
    assert (error.message, error.hint, error.fix) == (message, "", None)


def errors_of(link: str, joint: str = "") -> list[Diagnostic]:
    text = f'{HEAD}<link name="a">{link}</link>{joint}</robot>'
    return [d for d in check_text(text, "f", config=Config()) if d.is_error]


@pytest.mark.parametrize(
    ("expression", "reason", "hint"),
    [
        ("2,5*n", "'2,5*n' has several values: the comma separates them", "write 2.5 with a decimal point"),
        ("1,5", "'1,5' has several values: the comma separates them", "write 1.5 with a decimal point"),
        (
            "n*1,500",
            "'n*1,500' has several values: the comma separates them",
            "write 1.500 with a decimal point, or 1500",
        ),
        ("3,14*n**2", "'3,14*n**2' has several values: the comma separates them", "write 3.14 with"),
        ("n-0,1", "'n-0,1' has several values: the comma separates them", "write 0.1 with"),
        ("2*(n+0,5)", "'2*(n+0,5)' has several values: the comma separates them", "write 0.5 with"),
        ("n,5", "'n,5' has several values: the comma separates them", "the comma makes a list of two values"),
        (
            "max(1,2),n",
            "'max(1,2),n' has several values: the comma separates them",
            "the comma makes a list of two values",
        ),
        ("sin", "'sin' is a function", "write sin(…)"),
        ("math.sin", "'math.sin' is a function", "write math.sin(…)"),
        ("lambda: 1", "'lambda: 1' is a function", "write an expression that evaluates to a number"),
    ],
)
@pytest.mark.parametrize("shape", ['<sphere radius="{}"/>', '<box size="1 {} 1"/>'])
def test_a_value_that_is_not_a_number_is_explained(
    shape: str, expression: str, reason: str, hint: str
) -> None:
    shown = shape.format(f"${{{expression}}}")
    (error,) = errors_of(f"<visual><geometry>{shown}</geometry></visual>")
    assert error.message.endswith(f"is not a number: {reason}")
    assert error.hint.startswith(hint)
    assert error.fix is None


def test_several_values_are_reported_at_their_property() -> None:
    shape = '<xacro:property name="r" value="${n*2,5}"/><sphere radius="${r}"/>'
    (error,) = errors_of(f"<visual><geometry>{shape}</geometry></visual>")
    assert error.message == "r: 'n*2,5' has several values: the comma separates them"
    assert error.hint == "write 2.5 with a decimal point"


def test_a_long_number_is_shortened() -> None:
    (error,) = errors_of('<visual><geometry><sphere radius="${10**400}"/></geometry></visual>')
    assert error.message.startswith("'radius' of <sphere> is not a finite number: '1000")
    assert len(error.message) < 120


REVOLUTE, PRISMATIC = (
    f'<link name="b"/><joint name="j" type="{kind}"><parent link="a"/><child link="b"/>'
    '<limit lower="{}" upper="9" effort="{}" velocity="1"/></joint>'
    for kind in ("revolute", "prismatic")
)
VISUAL = '<visual><origin xyz="0 0 {}" rpy="0 0 {}"/><geometry><sphere radius="1"/></geometry></visual>'
INERTIAL = (
    '<inertial><mass value="{}"/><inertia ixx="{}" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
)


@pytest.mark.parametrize(
    ("link", "joint", "right"),
    [
        (VISUAL.format(0, "90deg"), "", "1.570796"),  # pi/2
        (VISUAL.format("5cm", 0), "", "0.05"),
        (VISUAL.format(0, "5cm"), "", ""),
        (VISUAL.format("90deg", 0), "", ""),
        (INERTIAL.format("250g", 1), "", "0.25"),
        (INERTIAL.format("5mm", 1), "", ""),
        (INERTIAL.format(1, "5mm"), "", ""),
        (INERTIAL.format(1, "5kg"), "", ""),
        ("", REVOLUTE.format("-180 deg", 1), "-3.141593"),
        ("", REVOLUTE.format("-5mm", 1), ""),
        ("", REVOLUTE.format(-1, "10deg"), ""),
        ("", REVOLUTE.format(-1, "10mm"), ""),
        ("", PRISMATIC.format("-5mm", 1), "-0.005"),
        ("", PRISMATIC.format("-90deg", 1), ""),
    ],
)
def test_a_number_with_a_unit_is_fixed_where_the_unit_fits(link: str, joint: str, right: str) -> None:
    (error,) = errors_of(link, joint)
    if right:
        assert error.hint.startswith(f"write {right}: ")
        assert error.fix is not None
        assert error.fix.safe
        assert [edit.replacement for edit in error.fix.edits] == [right]
    else:
        assert error.hint.startswith("write a number without a unit: ")
        assert error.fix is None


@pytest.mark.parametrize(
    ("value", "use", "hint", "right"),
    [
        ("90deg", "${2*p}", "write 1.570796: angles are in radians", ""),
        ("5mm", "${2*p}", "write 0.005: ", "0.005"),
        ("5mm", "${p}", "write 0.005: ", "0.005"),
        ("5kg", "${p}", "write a number without a unit: kg is a unit of mass", ""),
    ],
)
def test_the_fix_of_a_property_fits_its_use(value: str, use: str, hint: str, right: str) -> None:
    (error,) = errors_of(f'<xacro:property name="p" value="{value}"/>{VISUAL.format(use, 0)}')
    assert error.hint.startswith(hint)
    assert ([e.replacement for e in error.fix.edits] if error.fix else []) == [right] * bool(right)


def test_all_uses_of_a_text_are_one_error_with_a_fix() -> None:
    text = f'{HEAD}<a x="${{comma + 1}}" y="${{comma / 2}}"/>\n<b z="${{1 - comma}}"/></robot>'
    (error,) = expand_text(text, "f").diagnostics
    assert [str(related.origin) for related in error.related] == ["f:8:7", "f:8:24", "f:9:7"]
    assert error.fix is not None
    assert [(str(e.span), e.replacement) for e in error.fix.edits] == [("f:2:37", "0.035")]


def test_a_text_is_traced_through_the_parameters_of_macros() -> None:
    text = (
        f'{HEAD}<xacro:macro name="inner" params="r"><a x="${{2*r*r}}"/></xacro:macro>\n'
        '<xacro:macro name="outer" params="radius"><xacro:inner r="${radius}"/></xacro:macro>\n'
        '<xacro:outer radius="${comma}"/></robot>'
    )
    (error,) = expand_text(text, "f").diagnostics
    assert (str(error.origin), error.hint) == ("f:2:37", "write 0.035")


ARGUMENT = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    '<xacro:arg name="length" default="{}"/>\n'
    '<xacro:property name="length" value="$(arg length)"/>\n'
    '<a x="${{length + 1}}"/></robot>'
)


def test_a_text_is_reported_and_fixed_at_the_default_of_its_argument() -> None:
    text = ARGUMENT.format("0,3")
    (error,) = expand_text(text, "f").diagnostics
    assert (str(error.origin), error.message) == ("f:2:35", "length: '0,3' is text, not a number")
    assert error.fix is not None
    assert apply_edits(text, error.fix.edits) == ARGUMENT.format("0.3")


def test_a_text_from_the_default_of_another_argument_is_reported_there() -> None:
    text = ARGUMENT.format("$(arg l)").replace("\n", '\n<xacro:arg name="l" default="0,3"/>\n', 1)
    (error,) = expand_text(text, "f").diagnostics
    assert (str(error.origin), error.message) == ("f:2:30", "l: '0,3' is text, not a number")


@pytest.mark.parametrize("kind", ["arguments", "properties"])
def test_a_text_that_the_caller_gives_has_no_fix_in_the_file(kind: str) -> None:
    given = {kind: {"length": "0,4"}}
    (error,) = expand_text(ARGUMENT.format("0.3"), "f", **given).diagnostics
    assert error.message == "length: the given value '0,4' is text, not a number"
    assert (error.hint, error.fix) == ("write 0.4", None)


def test_a_text_that_is_composed_has_no_fix_that_cuts_the_argument_off() -> None:
    text = ARGUMENT.format("0").replace("$(arg length)", "$(arg length),3")
    (error,) = expand_text(text, "f").diagnostics
    assert (str(error.origin), error.hint, error.fix) == ("f:3:38", "write 0.3", None)


def test_an_expression_in_round_brackets_has_a_hint() -> None:
    text = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(r + 0.005)"/></robot>'
    (found,) = expand_text(text, "f").diagnostics
    assert (found.code, found.hint) == ("X110", "write ${r + 0.005} for an expression")
