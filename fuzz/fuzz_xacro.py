"""Coverage-guided fuzzing of the parser, the expressions and the expansion.

    pip install atheris
    python fuzz/fuzz_xacro.py CORPUS_FOLDER [-runs=1000000]

Whatever the input, expansion must end within its bounds and say what is wrong in diagnostics that
have a code and a place; anything else is a finding. What was found is kept in
tests/xacro/fuzzed/, which the test suite replays.
"""

import sys

import atheris

with atheris.instrument_imports(include=["kbot.text", "kbot.xacro"]):
    from kbot.text.render import render_text, to_json
    from kbot.xacro import Limits, clear_cache, expand_text

LIMITS = Limits(
    file_bytes=100_000, nodes=3_000, steps=20_000, length=20_000, text=200_000, bits=4_096, macro_calls=60,
    includes=5, nesting=200, function_depth=30, errors=30,
)  # fmt: skip
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


def check(text: str) -> None:
    """Expand a text and look at everything that comes out."""
    expansion = expand_text(text, "fuzz.xacro", {"x": "1"}, limits=LIMITS)
    for diagnostic in expansion.diagnostics:
        assert diagnostic.code, diagnostic
        assert diagnostic.message, diagnostic
        to_json(diagnostic)
    render_text(expansion.diagnostics)
    if expansion.ok:
        assert expansion.text.startswith("<?xml")
    elif not expansion.diagnostics:
        raise AssertionError("it failed and does not say why")


def document(data: bytes) -> str:
    """The text that an input stands for: itself, an expression, or some fragments filled in."""
    provider = atheris.FuzzedDataProvider(data)
    kind = provider.ConsumeIntInRange(0, 3)
    if kind == 0:
        return provider.ConsumeUnicodeNoSurrogates(4_000)
    if kind == 1:
        expression = provider.ConsumeUnicodeNoSurrogates(1_000)
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
