"""Tests that work is charged before it is done: hostile expressions end with X190.

CPU time is that of the process, so the machine's load does not matter. The bound is ten times what any of
these takes. Without the charge each takes far longer, or more memory than the machine has.
"""

# ruff: noqa: E501 - a table of expressions, one to a line

import time
from pathlib import Path

import pytest
import yaml

from kbot.text.recursion import recursion_limit
from kbot.xacro import Limits, expand, expand_text
from kbot.xacro.expressions.compiler import compiled
from kbot.xacro.expressions.costs import FUNCTIONS, METHODS, measured
from kbot.xacro.names import _MATH, _PYTHON
from kbot.xacro.packages import Packages
from kbot.xacro.run import Run
from kbot.xacro.scope import Scope
from kbot.xacro.values import _PUBLIC
from kbot.xacro.xacro_error import LimitFault

HEAD = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
MOST_CPU_S = 5.0
LIMITS = Limits(steps=500_000)
"""A tenth of the default, so that the tests are fast."""
COLLIDING = 2305843009213693951
"""2**61 - 1: all its multiples have the hash 0."""


def codes(body: str) -> list[str]:
    """The error codes of a description, after expanding it in bounded CPU time."""
    start = time.process_time()
    expansion = expand_text(f"{HEAD}{body}</robot>", "f.xacro", limits=LIMITS)
    assert time.process_time() - start < MOST_CPU_S
    for diagnostic in expansion.diagnostics:
        assert diagnostic.origin is not None
        assert len(diagnostic.message) < 500
    return [d.code for d in expansion.diagnostics if d.is_error]


def evaluate(expression: str, limits: Limits) -> object:
    """The value of an expression. It may contain braces, which `${…}` does not allow."""
    run = Run("f.xacro", {}, Packages(), limits, ".")
    with recursion_limit(9000):  # as in an expansion
        return compiled(expression)(Scope(run))


HOSTILE = [
    # searches: quadratic in the length
    "('a' * 3000000).rfind('ab' + 'a' * 1000000)",
    "('a' * 3000000).rindex('ab' + 'a' * 1000000)",
    "('a' * 3000000).find('a' * 1000000 + 'b')",
    "('a' * 3000000).count('ab' + 'a' * 1000000)",
    "('a' * 3000000).rsplit('ab' + 'a' * 1000000)",
    "('a' * 3000000).rsplit(sep='ab' + 'a' * 1000000)",
    "('a' * 3000000).rpartition('ab' + 'a' * 1000000)",
    "('a' * 3000000).replace('ab' + 'a' * 1000000, '')",
    "('ab' + 'a' * 1000000) in 'a' * 3000000",
    "('a' * 3000000).encode().rfind(('ab' + 'a' * 1000000).encode())",
    "str.rfind('a' * 3000000, 'ab' + 'a' * 1000000)",
    "list(map(str.rfind, ['a' * 3000000], ['ab' + 'a' * 1000000]))",
    "list(map(('a' * 3000000).rfind, ['ab' + 'a' * 1000000]))",
    "min(['ab' + 'a' * 1000000], key=('a' * 3000000).rfind)",
    "python.sorted(['ab' + 'a' * 1000000, ''], key=('a' * 3000000).rfind)",
    "list(python.filter(('a' * 3000000).rfind, ['ab' + 'a' * 1000000]))",
    "('\\U0001f600' * 3000000).strip('\\U0001f600' + 'a' * 1000000)",
    "[('a' * 1000000).startswith(('a' * 999999 + 'b',) * 1000) for i in python.range(1000)]",
    "[x == y for x in ['a' * 1000000] for y in ['a' * 999999 + 'b'] for i in python.range(1000000)]",
    "xacro.tokenize('a' * 1000000, 'b' * 1000000)",
    "('\\xe9' * 1000000).encode('punycode')",
    "('\\xe9' * 1000000).encode('ascii', 'namereplace')",
    # keys that share one hash
    f"len(dict.fromkeys(python.range(0, {COLLIDING} * 100000, {COLLIDING})))",
    f"len(python.set(python.range(0, {COLLIDING} * 100000, {COLLIDING})))",
    f"len(python.frozenset(python.range(0, {COLLIDING} * 100000, {COLLIDING})))",
    f"len({{i * {COLLIDING} for i in python.range(100000)}})",
    f"len({{i * {COLLIDING}: 0 for i in python.range(100000)}})",
    f"len(dict([(i * {COLLIDING}, 0) for i in python.range(100000)]))",
    f"len(dict([[i * {COLLIDING}, 0] for i in python.range(100000)]))",
    f"[s.add(i * {COLLIDING}) for s in [python.set()] for i in python.range(100000)]",
    f"[s.setdefault(i * {COLLIDING}) for s in [dict()] for i in python.range(100000)]",
    f"[s.update([i * {COLLIDING}]) for s in [python.set()] for i in python.range(100000)]",
    f"[1 in s for s in [python.set([i * {COLLIDING} + 1 for i in python.range(10000)])] for i in python.range(10**6)]",
    f"[s[1] for s in [dict.fromkeys([i * {COLLIDING} + 1 for i in python.range(10000)])] for i in python.range(10**6)]",
    f"python.set(python.range(10000)) | python.set(python.range(1, {COLLIDING} * 15000, {COLLIDING}))",
    "python.set([(-1 if i & 1 else -2, -1 if i & 2 else -2, i >> 2) for i in python.range(10**5)])",
    "len(python.set([python.complex(-1000003 * k, k) for k in python.range(100000)]))",
    # nested values with shared parts
    "[t := (1,), [t := (t, t) for i in python.range(60)], python.hash(t)]",
    "[t := (1,), [t := (t, t) for i in python.range(60)], {t: 1}]",
    "[t := (1,), u := (1,), [(t := (t, t), u := (u, u)) for i in python.range(60)], t == u]",
    "[t := [1], [t := [t, t] for i in python.range(60)], str(t)]",
    "[t := [1], [t := [t, t] for i in python.range(60)], f'{t}']",
    "[t := [1], [t := [t, t] for i in python.range(60)], '%s' % (t,)]",
    "[t := [1], [t := [t, t] for i in python.range(60)], '{}'.format(t)]",
    "[t := [1], [t := [t, t] for i in python.range(60)], xacro.message(t)]",
    "[t := (str,), [t := (t, t) for i in python.range(60)], python.isinstance(1, t)]",
    "[t := (1,), [t := (t,) for i in python.range(100000)], python.hash(t)]",
    # text that is far longer than its parts
    "'%1000000000d' % 1",
    "'%.1000000000f' % 1",
    "('%999d' * 100000) % ((1,) * 100000)",
    "('%(a)s' * 100000) % dict(a='x' * 1000000)",
    "('{0}' * 100000).format('x' * 1000000)",
    "f'{1:>1000000000}'",
    "'{:>1000000000}'.format(1)",
    "''.join(['x' * 1000000] * 1000)",
    "'a'.translate(['x' * 3000000] * 98) * 2",
    "f'{x}{x}{x}{x}{x}' if [x := 'a' * 1000000] else 0",
    # integers with many digits
    "[x * x for x in [2**16000 - 1] for i in python.range(10**6)]",
    "[x // y for x in [2**16000 - 1] for y in [2**8000 - 1] for i in python.range(10**6)]",
    "[str(x) for x in [2**14000] for i in python.range(10**6)]",
    "[-x for x in [2**16000] for i in python.range(10**6)]",
    "int('f' * 4000000, 16)",
    "python.sum([2**16000] * 1000000)",
    # endless iterators, and iterators that are nested too deeply
    "[x.extend(python.enumerate(x)) for x in [[1]]]",
    "[x.extend(map(str, x)) for x in [[1]]]",
    "[m := [1], [m := map(str, m) for i in python.range(10000)], list(m)]",
    "[m := [1], [m := (lambda g: (i for i in g))(m) for i in python.range(10000)], list(m)]",
    # long bodies of loops and functions
    "[" + "+".join(["1.0"] * 2000) + " for i in python.range(10**6)]",
    "list(map(lambda i: " + "+".join(["1.0"] * 2000) + ", python.range(10**6)))",
    "[{1: 1} for i in python.range(4 * 10**6)]",
    "[x for i in python.range(10**5) for x in [python.range(10**5)] if 1.5 in x]",
    "python.sum([[1]] * 1000000, [])",
    "[x.insert(0, 1) for x in [[0] * 1000000] for i in python.range(1000000)]",
    "python.sorted([[0] * 1000 for i in python.range(1000)] * 100)",
    "python.type(''.encode())(2 * 10**9)",
    # comparisons within Python's own functions
    "[t := (), u := (), [(t := (t, t), u := (u, u)) for i in python.range(40)], python.sorted([0, 1], key=lambda i: t if i else u)]",
    "[t := (), u := (), [(t := (t, t), u := (u, u)) for i in python.range(40)], max([0, 1], key=lambda i: t if i else u)]",
    "[t := (), u := (), [(t := (t, t), u := (u, u)) for i in python.range(40)], [1, 0].sort(key=lambda i: t if i else u)]",
    "[x == y for x in [('a' * 100000).encode()] for y in [('a' * 99999 + 'a').encode()] for i in python.range(1000)]",
    "[d[y] for d in [dict([('a' * 100000, 1)])] for y in ['a' * 99999 + 'a'] for i in python.range(1000)]",
    "[y in s for s in [python.set(['a' * 100000])] for y in ['a' * 99999 + 'a'] for i in python.range(1000)]",
    # functions with many parameters
    f"[f() for f in [lambda {','.join(f'a{i}=1' for i in range(2000))}: 0] for i in python.range(10**5)]",
    f"[f(**d) for f in [lambda {','.join(f'a{i}' for i in range(2500))}: 0] for d in [dict([('a' + str(i), 1) for i in python.range(2500)])] for i in python.range(1000)]",
    # texts that are split into characters, and short texts of wide characters
    "[list(t) for t in ['\u2028' * 100000] for i in python.range(8)]",
    "[python.tuple(t) for t in ['\u2028' * 100000] for i in python.range(8)]",
    "[python.sorted(t) for t in ['\u2028' * 100000] for i in python.range(8)]",
    "[[*t] for t in ['\u2028' * 100000] for i in python.range(8)]",
    "[x.extend(t) for x in [[]] for t in ['\u2028' * 100000] for i in python.range(3)]",
    "[t + t for t in ['\U0001f600' * 32] for i in python.range(100000)]",
    # patterns with many numbers or braces
    "len(('0 ' * 450000) % ())",
    "len(('{{' * 400000).format())",
]


@pytest.mark.parametrize("expression", HOSTILE)
def test_work_is_rejected_before_it_is_done(expression: str) -> None:
    start = time.process_time()
    with pytest.raises(LimitFault):
        evaluate(expression, LIMITS)
    assert time.process_time() - start < MOST_CPU_S


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("'%-5s|%05.1f' % ('a', 2.5)", "a    |002.5"),
        ("'%(a)s-%(a)r' % dict(a='x')", "x-'x'"),
        ("'{0}-{0!r:>4}-{n[0]}'.format('x', n=[7])", "x- 'x'-7"),
        ("python.sorted(['b', 'a'], key=str.upper, reverse=True)", "['b', 'a']"),
        ("list(map(str.upper, ['a', 'b']))", "['A', 'B']"),
        ("max([3, 1], key=lambda x: -x)", "1"),
        ("list(python.zip('ab', python.enumerate('cd')))", "[('a', (0, 'c')), ('b', (1, 'd'))]"),
        ("dict(python.zip('ab', (1, 2)))", "{'a': 1, 'b': 2}"),
        ("dict(map(list, ['ab', 'cd']))", "{'a': 'b', 'c': 'd'}"),
        ("len(python.set(python.range(100000)))", "100000"),
        ("len({(i, -i) for i in python.range(2000)})", "2000"),
        ("python.sum((i * i for i in python.range(4)), 1)", "15"),
        ("python.sum([[1], [2]], [])", "[1, 2]"),
        ("math.comb(100, 98)", "4950"),
        ("math.perm(5, 2)", "20"),
        ("math.perm(4)", "24"),
        ("'a-b_c'.translate('a'.maketrans('-', '+', '_'))", "a+bc"),
        ("'a-b_c'.translate(str.maketrans('-', '+', '_'))", "a+bc"),
        ("str.join('+', ['a', 'b'])", "a+b"),
        ("str('é'.encode('utf-8'), 'utf-8')", "é"),
        ("python.any(i > 1 for i in [0, 2, 'x'])", "True"),
        ("[s.add(1) or s for s in [python.set()]]", "[{1}]"),
        ("-(2**100)", "-1267650600228229401496703205376"),
    ],
)
def test_charged_calls_have_the_results_of_python(expression: str, value: str) -> None:
    assert str(evaluate(expression, Limits())) == value


def test_every_function_has_a_cost() -> None:
    functions = [f for f in (*_PYTHON.values(), *_MATH.values()) if callable(f)]
    assert [f for f in functions if f not in FUNCTIONS] == []


def test_methods_that_search_hash_or_grow_have_a_separate_cost() -> None:
    unlisted = {
        kind.__name__: {n for n in names if METHODS[kind].get(n, measured) is measured} - {"maketrans"}
        for kind, names in _PUBLIC.items()
        if kind in METHODS
    }
    # each of these goes through its arguments once, and its result is at most a few times as large
    assert unlisted["str"] <= {
        *("capitalize", "casefold", "lower", "swapcase", "title", "upper", "removeprefix", "removesuffix"),
        *("isalnum", "isalpha", "isascii", "isdecimal", "isdigit", "isidentifier", "islower", "isnumeric"),
        *("isprintable", "isspace", "istitle", "isupper"),
    }
    assert unlisted["bytes"] <= {*unlisted["str"], "fromhex", "hex"}
    assert unlisted["list"] == {"clear", "copy", "reverse"}
    assert unlisted["dict"] == {"clear", "copy"}
    assert unlisted["set"] == {"clear", "copy"}


@pytest.mark.parametrize("count", [27, 60])
def test_doubling_properties_are_limited(count: int) -> None:
    doubled = "".join(f'<xacro:property name="p{i + 1}" value="${{p{i}}}${{p{i}}}"/>\n' for i in range(count))
    body = f'<xacro:property name="p0" value="aaaaaaaaaa"/>\n{doubled}<a x="${{p{count}}}"/>'
    expansion = expand_text(f"{HEAD}{body}</robot>", "f.xacro")
    assert [(d.code, str(d.origin)) for d in expansion.diagnostics] == [("X190", "f.xacro:21:35")]


@pytest.mark.parametrize(
    "body",
    [
        # lists that double, written out at the end
        '<xacro:property name="p0" value="${[1]}"/>'
        + "".join(f'<xacro:property name="p{i + 1}" value="${{[p{i}, p{i}]}}"/>' for i in range(60))
        + '<a x="${p60}"/>',
        # arguments that double
        '<xacro:arg name="a0" default="aaaaaaaaaa"/>'
        + "".join(f'<xacro:arg name="a{i + 1}" default="$(arg a{i})$(arg a{i})"/>' for i in range(60)),
        # parameters of macros that double
        '<xacro:macro name="m" params="p n"><xacro:if value="${n > 0}"><xacro:m p="${p}${p}" n="${n - 1}"/>'
        '</xacro:if></xacro:macro><xacro:m p="aaaaaaaaaa" n="60"/>',
        # blocks that double
        '<xacro:property name="b0"><a/></xacro:property>'
        + "".join(
            f'<xacro:property name="b{i + 1}"><xacro:insert_block name="b{i}"/>'
            f'<xacro:insert_block name="b{i}"/></xacro:property>'
            for i in range(60)
        )
        + '<xacro:insert_block name="b60"/>',
        # a block without expressions, many times
        '<xacro:property name="b">'
        + "<a/>" * 5000
        + "</xacro:property>"
        + '<xacro:insert_block name="b"/>' * 2000,
        # a macro with a long text, many times
        '<xacro:macro name="m"><a x="' + "a" * 100_000 + '"/></xacro:macro>' + "<xacro:m/>" * 2000,
        # many short elements with long indentation
        "<a>" * 900 + "<b/>" * 50_000 + "</a>" * 900,
        # many empty attributes
        '<xacro:macro name="m"><a '
        + " ".join(f"x{i}=\"${{''}}\"" for i in range(1000))
        + "/></xacro:macro>"
        + "<xacro:m/>" * 5000,
        # many empty pieces
        '<xacro:macro name="m"><a x="' + "${''}" * 40_000 + '"/></xacro:macro>' + "<xacro:m/>" * 500,
        # a macro with a long expression, many times
        '<xacro:macro name="m"><a x="${1' + "+1" * 2400 + '}"/></xacro:macro>' + "<xacro:m/>" * 700,
        # a macro with many default parameters, many times
        '<xacro:macro name="m" params="'
        + " ".join(f"p{i}:=1" for i in range(5000))
        + '">a</xacro:macro>'
        + "<xacro:m/>" * 100,
    ],
    ids=[
        "lists",
        "arguments",
        "parameters",
        "blocks",
        "plain block",
        "text",
        "indentation",
        "attributes",
        "pieces",
        "long expression",
        "default parameters",
    ],
)
def test_growth_by_repetition_is_limited(body: str) -> None:
    assert codes(body) == ["X190"]


@pytest.mark.parametrize("expression", ["2**20000", "[2**20000]", "-(2**20000)"])
def test_a_number_of_too_many_digits_is_one_error(expression: str) -> None:
    for body in (
        f'<a x="${{{expression}}}"/>',
        f'<a x="1 ${{{expression}}}"/>',
        f"<a>${{{expression}}}</a>",
        f'<xacro:property name="p" value="${{{expression}}}"/><a x="${{p}}"/>',
        f'<xacro:arg name="a" default="${{{expression}}}"/>',
        f'<xacro:if value="${{str({expression})}}"/>',
        f'<xacro:element xacro:name="${{{expression}}}"/>',
        f'<a><xacro:attribute name="n" value="${{{expression}}}"/></a>',
        f'<xacro:include filename="${{{expression}}}"/>',
        f'<a x="$(eval {expression})"/>' if "(" not in expression else f"<a>${{{expression}}}</a>",
    ):
        assert codes(body) == ["X104"], body


@pytest.mark.parametrize("text", ["$" * 400_000, "${" * 200_000, "$(" * 200_000], ids=["$", "${", "$("])
def test_a_row_of_dollars_is_read_in_linear_time(text: str) -> None:
    assert codes(f'<a x="{text}"/>') == ["X101"]


MERGES_A_KEY_ONCE = tuple(map(int, yaml.__version__.split(".")[:3])) >= (6, 0, 4)
"""Since then merges do not double the keys of a mapping."""


def test_yaml_data_is_limited(tmp_path: Path) -> None:
    doubling = "a0: &a0 {x: 1, y: 2}\n" + "".join(
        f"a{i + 1}: &a{i + 1} {{<<: [*a{i}, *a{i}], k{i}: 1}}\n" for i in range(40)
    )
    growing = "a0: &a0 {x: 1}\n" + "".join(
        f"a{i + 1}: &a{i + 1} {{<<: *a{i}, k{i}: 1}}\n" for i in range(3_000)
    )
    for text in (
        "\n".join(f"{i * COLLIDING}: 1" for i in range(10_000)),
        doubling,
        growing,
        "[" + "1e5, " * 50_000 + "1]",
        "[" + "!!int 1, " * 50_000 + "1]",
    ):
        (tmp_path / "data.yaml").write_text(text)
        (tmp_path / "f.xacro").write_text(f"{HEAD}<a x=\"${{len(xacro.load_yaml('data.yaml'))}}\"/></robot>")
        start = time.process_time()
        expansion = expand(tmp_path / "f.xacro", limits=LIMITS)
        assert time.process_time() - start < MOST_CPU_S
        if text is doubling and MERGES_A_KEY_ONCE:
            assert '<a x="41"/>' in expansion.text
        else:
            assert [d.code for d in expansion.diagnostics] == ["X190"], text[:20]


@pytest.mark.parametrize(
    ("inserted", "code"),
    [("${%s}", "X102"), ("$(arg a) == %s", "X128")],
)
def test_many_inserted_arguments_in_an_expression_take_no_quadratic_time(inserted, code):
    text = inserted % "+".join(["$(arg a)"] * 5000)
    argument = '<xacro:arg name="a" default="gz"/>'
    assert codes(f'{argument}<xacro:if value="{text}"/>') == [code]
