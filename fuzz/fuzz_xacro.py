"""Fuzzes the parser of XML, the expressions of xacro and the expansion.

For every input, expansion must end within its limits and report errors as diagnostics with a code and a
place. Anything else is a finding, and so is an input that takes more than a second of CPU time.
tests/xacro/fuzzed/ has the inputs that failed; the test suite replays them.
"""

import time

from choices import Choices
from diagnostics import check_diagnostics
from edits import edited, real_files

from kbot.xacro import Limits, clear_cache, expand_text
from kbot.xacro.names import _MATH, _PYTHON
from kbot.xacro.values import _PUBLIC

LIMITS = Limits(
    file_bytes=100_000, nodes=3_000, steps=20_000, length=20_000, text=200_000, bits=4_096, macro_calls=60,
    includes=5, nesting=200, function_depth=30, errors=30,
)  # fmt: skip
MOST_CPU_S = 1.0
"""Twenty times the time of the steps in LIMITS without instrumentation."""
SEEDS = real_files(".xacro", ".urdf", ".xacro.in")
HEAD = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">'
FRAGMENTS = [
    '<xacro:property name="a" value="{}"/>',
    '<xacro:property name="b" value="{}" lazy_eval="false"/>',
    '<xacro:property name="blk">{}</xacro:property>',
    '<xacro:insert_block name="blk"/>',
    '<xacro:macro name="m" params="{}">',
    "</xacro:macro>",
    '<xacro:m p="{}"/>',
    '<xacro:if value="{}">',
    "</xacro:if>",
    '<xacro:arg name="x" default="{}"/>',
    '<xacro:element xacro:name="{}"/>',
    '<xacro:attribute name="q" value="{}"/>',
    '<xacro:call macro="{}"/>',
    '<l v="${{{}}}">',
    "</l>",
    "<t>{}</t>",
    "<!-- xacro:eval-comments --><!-- {} -->",
    '<xacro:include filename="{}" optional="true"/>',
]
TEXTS = ["'a'*9999", "'ab'+'a'*5000", "('a','b')*999", "''", "'\\xe9'*9999", "'%99d'*99", "'{0:>99}'*99"]
NUMBERS = ["0", "-1", "2**4000-1", "2305843009213693951", "1e308", "9999", "range(9999)"]
CONTAINERS = [
    "range(0,2305843009213693951*9999,2305843009213693951)", "[[1]*99]*99", "dict.fromkeys(range(999))",
    "xacro.dotify(dict(a=[1]))", "python.set(range(999))", "map(str,[1]*999)", "(x for x in [1]*999)",
    "[t := (1,), [t := (t, t) for i in range(40)]]",
]  # fmt: skip
VALUES = [*TEXTS, *NUMBERS, *CONTAINERS]
METHODS = sorted({name for names in _PUBLIC.values() for name in names})
FUNCTIONS = [*(f"python.{name}" for name in _PYTHON), *(f"math.{name}" for name in _MATH)]
OPERATORS = ["+", "-", "*", "/", "//", "%", "**", "<<", ">>", "&", "|", "^", "in", "==", "<"]


def hostile(choices: Choices) -> str:
    """An expression with large values, and with calls and operators that may take long on them."""

    def pick(some: list[str]) -> str:
        return choices.pick(some)

    def value(depth: int) -> str:
        kind = choices.integer(0, 6) if depth else 0
        if kind == 1:
            return f"({value(depth - 1)}).{pick(METHODS)}({arguments(depth - 1)})"
        if kind == 2:
            return f"{pick(FUNCTIONS)}({arguments(depth - 1)})"
        if kind == 3:
            return f"({value(depth - 1)} {pick(OPERATORS)} {value(depth - 1)})"
        if kind == 4:
            return f"[{value(depth - 1)} for x in {value(depth - 1)}]"
        if kind == 5:
            return f"({value(depth - 1)})[{value(depth - 1)}:{value(depth - 1)}]"
        if kind == 6:
            return f"list(map({pick(FUNCTIONS)}, {value(depth - 1)}))"
        return pick(VALUES)

    def arguments(depth: int) -> str:
        return ", ".join(value(depth) for _ in range(choices.integer(0, 3)))

    return value(3)


def check(text: str) -> None:
    """Expand a text and check the time, the diagnostics and the result."""
    start = time.process_time()
    expansion = expand_text(text, "fuzz.xacro", {"x": "1"}, limits=LIMITS)
    assert time.process_time() - start < MOST_CPU_S, text
    check_diagnostics(expansion.diagnostics)
    if expansion.ok:
        assert expansion.text.startswith("<?xml")
    elif not expansion.diagnostics:
        raise AssertionError("expansion failed without a diagnostic")


def document(choices: Choices) -> str:
    """The text for an input: the input itself, a real file, an expression, or fragments that are filled."""
    kind = choices.integer(0, 7)
    if kind == 0:
        return choices.text(4_000)
    if kind > 5:
        return edited(choices, SEEDS, [fragment.encode() for fragment in FRAGMENTS]).decode(errors="replace")
    if kind in (1, 4, 5):
        expression = choices.text(1_000) if kind == 1 else hostile(choices)
        for character, entity in (("&", "&amp;"), ("<", "&lt;"), ('"', "&quot;")):
            expression = expression.replace(character, entity)
        return f'{HEAD}<xacro:property name="n" value="3"/><a x="${{{expression}}}"/></robot>'
    parts = [HEAD]
    for _ in range(choices.integer(1, 12)):
        fragment = choices.pick(FRAGMENTS)
        parts.append(fragment.replace("{}", choices.text(40)).replace("{{", "{"))
    return "".join(parts) + "</robot>"


def one_input(choices: Choices) -> None:
    check(document(choices))
    if choices.integer(0, 63) == 0:
        clear_cache()


TARGETS = {"xacro": one_input}
