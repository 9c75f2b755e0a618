"""Coverage-guided fuzzing of the parser, the expressions and the expansion.

    pip install atheris
    python fuzz/fuzz_xacro.py CORPUS_FOLDER [-runs=1000000]

For every input, expansion must end within its limits and report errors as diagnostics with a code and a
place. Anything else is a finding, and so is an input that takes more than a second of CPU time.
tests/xacro/fuzzed/ has the inputs that failed; the test suite replays them.
"""

import sys
import time

import atheris

with atheris.instrument_imports(include=["kbot.text", "kbot.xacro"]):
    from kbot.xacro import Limits, clear_cache, expand_text
    from kbot.xacro.names import _MATH, _PYTHON
    from kbot.xacro.values import _PUBLIC

from diagnostics import check_diagnostics

LIMITS = Limits(
    file_bytes=100_000, nodes=3_000, steps=20_000, length=20_000, text=200_000, bits=4_096, macro_calls=60,
    includes=5, nesting=200, function_depth=30, errors=30,
)  # fmt: skip
MOST_CPU_S = 1.0
"""Twenty times the time of the steps in LIMITS without instrumentation."""
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


def hostile(provider: atheris.FuzzedDataProvider) -> str:
    """An expression with large values, and with calls and operators that may take long on them."""

    def pick(some: list[str]) -> str:
        return some[provider.ConsumeIntInRange(0, len(some) - 1)]

    def value(depth: int) -> str:
        kind = provider.ConsumeIntInRange(0, 6) if depth else 0
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
        return ", ".join(value(depth) for _ in range(provider.ConsumeIntInRange(0, 3)))

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


def document(data: bytes) -> str:
    """The text for an input: the input itself, an expression, or fragments that are filled with it."""
    provider = atheris.FuzzedDataProvider(data)
    kind = provider.ConsumeIntInRange(0, 5)
    if kind == 0:
        return provider.ConsumeUnicodeNoSurrogates(4_000)
    if kind in (1, 4, 5):
        expression = provider.ConsumeUnicodeNoSurrogates(1_000) if kind == 1 else hostile(provider)
        for character, entity in (("&", "&amp;"), ("<", "&lt;"), ('"', "&quot;")):
            expression = expression.replace(character, entity)
        return f'{HEAD}<xacro:property name="n" value="3"/><a x="${{{expression}}}"/></robot>'
    parts = [HEAD]
    for _ in range(provider.ConsumeIntInRange(1, 12)):
        fragment = FRAGMENTS[provider.ConsumeIntInRange(0, len(FRAGMENTS) - 1)]
        parts.append(fragment.replace("{}", provider.ConsumeUnicodeNoSurrogates(40)).replace("{{", "{"))
    return "".join(parts) + "</robot>"


def one_input(data: bytes) -> None:
    check(document(data))
    if len(data) % 64 == 0:
        clear_cache()


if __name__ == "__main__":
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
