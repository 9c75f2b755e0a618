"""Errors of expressions are worded for a reader who does not know Python."""

from __future__ import annotations

import pytest

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
        ("sizes['x']", "'sizes' is a list: its index must be a whole number, not 'x'", "write sizes[0]", 8),
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
