"""Tests that hostile descriptions end with one clear error."""

import contextlib

import pytest

from kbot.xacro import Limits, expand_text
from kbot.xacro.expressions.compiler import compiled
from kbot.xacro.expressions.operations import InvalidExpression
from kbot.xacro.packages import Packages
from kbot.xacro.run import Run
from kbot.xacro.scope import Scope
from kbot.xacro.xacro_error import XacroError

HEAD = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">'


def evaluate(expression: str, limits: Limits | None = None) -> object:
    run = Run("", {}, Packages(), limits or Limits(), ".")
    return compiled(expression)(Scope(run))


def codes(body: str, limits: Limits | None = None) -> list[str]:
    expansion = expand_text(f"{HEAD}{body}</robot>", limits=limits or Limits())
    return [d.code for d in expansion.diagnostics if d.is_error]


@pytest.mark.parametrize(
    "expression",
    [
        "9**9**9",
        "2**(10**10)",
        "(-3)**100000",
        "1 << 10**9",
        "10**4000 * 10**4000 * 10**4000",
        "'ab' * 10**10",
        "10**10 * 'ab'",
        "[0] * 10**10",
        "(1,) * 10**10",
        "python.range(10**15)",
        "[i for i in python.range(10**4) for j in python.range(10**4)]",
        "python.sum(i for i in python.range(10**4) for j in python.range(10**4))",
        "math.factorial(10**7)",
        "round(12345, -10**9)",
        "round(12345, ndigits=-10**9)",
        "math.comb(10**7, 5 * 10**6)",
        "math.perm(10**7, 10**7)",
        "math.prod([10**4000] * 20)",
        "list(map(math.factorial, [10**7]))",
        "python.sorted([10**7], key=math.factorial)",
        "str.ljust('a', 10**10)",
        "'a'.zfill(10**10)",
        "'a'.center(10**10)",
        "('\\t' * 1000).expandtabs(10**7)",
        "('a' * 10**6).replace('a', 'b' * 10**6)",
        "('x' * 10**6).join(['y'] * 10**6)",
        "'%0999999999d' % 1",
        "'%*d' % (10**9, 1)",
        "'{:999999999}'.format(1)",
        "'{:{}}'.format(1, 999999999)",
        "str.format('{:999999999}', 1)",
        "f'{1:999999999}'",
        "(5).to_bytes(10**9, 'big')",
        "(lambda f: f(f))(lambda f: f(f))",
        "[x.extend(x) for x in [[1]] for i in python.range(40)]",
        "str(" + "[" * 20 + "0" + "] * 9" * 20 + ")",
        "[('b' * 10**6).count('a') for i in python.range(10**5)]",
    ],
)
def test_expressions_are_limited(expression: str) -> None:
    with pytest.raises(XacroError) as caught:
        evaluate(expression)
    assert caught.value.code == "X190"


@pytest.mark.parametrize(
    "expression",
    [
        "''.__class__",
        "().__class__.__bases__[0].__subclasses__()",
        "__builtins__",
        "__import__('os')",
        "(lambda: 0).__globals__",
        "[x.__class__ for x in [1]]",
        "python.vars()",
        "python.type('A', (), {})",
    ],
)
def test_expressions_cannot_reach_python(expression: str) -> None:
    with pytest.raises(XacroError) as caught:
        evaluate(expression)
    assert caught.value.code == "X191"


@pytest.mark.parametrize(
    "expression",
    [
        "(lambda: 0).func_globals",
        "(x for x in [1]).gi_frame",
        "'{0.__class__}'.format(1)",
        "'{0.real.__class__}'.format(1)",
        "'{a.__init__}'.format_map(dict(a=1))",
        "str.format('{0.__class__}', 1)",
        "list(map(str.format, ['{0.__class__}'], [1]))",
        "math.loader",
        "len.real",
        "str.mro",
        "int.mro()",
        "python.type(1).mro()",
        "xacro.load_yaml.func",
        "(1).from_bytes.im_self",
    ],
)
def test_attributes_lead_only_to_data(expression: str) -> None:
    with pytest.raises((AttributeError, XacroError)):
        evaluate(expression)


@pytest.mark.parametrize(
    "name", ["open", "eval", "exec", "getattr", "print", "input", "compile", "globals", "object"]
)
def test_dangerous_functions_do_not_exist(name: str) -> None:
    with pytest.raises(XacroError) as caught:
        evaluate(name)
    assert caught.value.code == "X103"


@pytest.mark.parametrize(
    "expression",
    [
        "(" * 500 + "1" + ")" * 500,
        "-" * 5000 + "1",
        "1" + "+1" * 9999,
        "[" * 150 + "]" * 150,
        "a" * 30_000,
        "x if " * 1000 + "1" + " else 1" * 1000,
        "yield 1",
        "await x",
        "a.b.c = 1",
        "*a",
        "lambda *, k: k",
        "\0",
    ],
)
def test_odd_syntax_ends_in_a_value_or_a_typed_error(expression: str) -> None:
    with contextlib.suppress(InvalidExpression, XacroError, RecursionError):
        evaluate(expression)


@pytest.mark.parametrize("separators", ["x](a+)+$[", "\\\\", "z-a", ""])
def test_tokenize_takes_no_patterns(separators: str) -> None:
    with pytest.raises(ValueError, match="not a set of characters"):
        evaluate(f"xacro.tokenize('aaaa', '{separators}')")


def test_limits_can_be_raised() -> None:
    with pytest.raises(XacroError):
        evaluate("2**40000")
    assert evaluate("2**40000", Limits(bits=50_000)) == 2**40000


def test_doubling_macros_are_limited() -> None:
    macros = "".join(
        f'<xacro:macro name="m{i}"><xacro:m{i + 1}/><xacro:m{i + 1}/></xacro:macro>' for i in range(40)
    )
    body = f'{macros}<xacro:macro name="m40"><a/></xacro:macro><xacro:m0/>'
    assert codes(body, Limits(nodes=50_000)) == ["X190"]


def test_macro_recursion_is_as_deep_as_in_the_official_package() -> None:
    body = """<xacro:macro name="m" params="n">
      <xacro:if value="${n > 0}"><a n="${n}"/><xacro:m n="${n - 1}"/></xacro:if></xacro:macro>"""
    assert codes(body + '<xacro:m n="320"/>') == []
    assert codes(body + '<xacro:m n="100000"/>') == ["X190"]


def test_the_total_text_is_limited() -> None:
    leaves = '<a x="${s}"/>' * 100
    body = f"""<xacro:property name="s" value="${{'x' * 1000}}"/>{leaves}"""
    assert codes(body, Limits(text=50_000)) == ["X190"]


def test_deep_nesting_is_limited() -> None:
    assert codes("<a>" * 900 + "</a>" * 900) == []
    assert codes("<a>" * 2000 + "</a>" * 2000) == ["P005"]


def test_a_nested_list_with_shared_parts_is_not_written() -> None:
    properties = "".join(f'<xacro:property name="l{i + 1}" value="${{[l{i}] * 10}}"/>' for i in range(12))
    body = f'<xacro:property name="l0" value="${{[1]}}"/>{properties}<a x="${{l12}}"/>'
    assert codes(body) == ["X190"]


def test_a_file_with_too_many_nodes_is_rejected() -> None:
    assert codes("<a/>" * 600, Limits(nodes=500)) == ["P006"]
    assert codes("<!---->" * 600, Limits(nodes=500)) == ["P006"]


def test_a_text_with_too_many_expressions_is_rejected() -> None:
    assert codes("${1}" * 60_000) == ["X190"]


def test_too_many_errors_stop_the_expansion() -> None:
    body = "".join(f'<a x="${{undefined_{i}}}"/>' for i in range(100))
    assert codes(body, Limits(errors=10)) == ["X103"] * 10 + ["X199"]


def test_entities_are_rejected() -> None:
    text = '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><r>&b;</r>'
    assert [d.code for d in expand_text(text).diagnostics] == ["P003"]
