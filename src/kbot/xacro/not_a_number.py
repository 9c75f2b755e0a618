"""Explains why a text that should be a number is not one, and what to write instead."""

from __future__ import annotations

import html
import re

from kbot.xacro.location import locate, within
from kbot.xacro.templates import shortened

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from kbot.text.diagnostic import Fix
    from kbot.text.span import Origin, Span
    from kbot.xacro.binding import Binding

_COMMA = re.compile(r"([+-]?)(\d*+),(\d++)")
_WITH_UNIT = re.compile(r"([+-]?(?:\d++(?:\.\d*+)?|\.\d++))\s*+([A-Za-z]++)")
_UNITS = {
    "m": (0, "metres"), "mm": (-3, "metres"), "cm": (-2, "metres"), "kg": (0, "kilograms"),
    "g": (-3, "kilograms"), "rad": (0, "radians"),
}  # fmt: skip
"""The power of ten from a unit to that of URDF, and the name of the latter."""
_DEGREES = ("deg", "degree", "degrees")
QUOTED = 60
"""Characters of a text that a message quotes."""
_MINUS = re.compile(r"-\s*+\$\{([^{}]*+)\}")
_NAME = re.compile(r"\w+")


def is_unit(word: str) -> bool:
    """Whether a word after a number is a unit that people write."""
    return word in _UNITS or word.lower() in _DEGREES


class Explanation:
    """What to do about a text that is not a number: a hint, and the text to write if it is known.

    `is_sure`: the replacement can mean nothing else.
    """

    __slots__ = ("hint", "is_sure", "reason", "replacement")

    def __init__(self, hint: str, replacement: str = "", is_sure: bool = False, reason: str = "") -> None:
        self.hint = hint
        self.replacement = replacement
        self.is_sure = is_sure
        self.reason = reason

    def fix(self, span: Span) -> Fix | None:
        """The fix that replaces the whole text, if the replacement is known."""
        from kbot.text.diagnostic import Edit, Fix  # only for an error: start-up time

        if not self.replacement:
            return None
        edit = Edit(span, html.escape(self.replacement, quote=False))
        return Fix(f"write {self.replacement}", (edit,), self.is_sure)


class PropertyFault:
    """A property or parameter whose value is a text instead of a number, reported where it is written."""

    __slots__ = ("fix", "hint", "is_explained", "message", "origin")

    def __init__(self, binding: Binding) -> None:
        text = str(binding.value)
        written = binding.node.attributes.get(binding.attribute, "") if binding.node is not None else ""
        found = explain(text, written)
        what = f"'{shortened(text, QUOTED)}' is text, not a number" if text.strip() else "the value is empty"
        self.message = f"{binding.name}: {what}" + (f": {found.reason}" if found.reason else "")
        self.hint = found.hint
        self.origin: Origin | None = None
        self.fix: Fix | None = None
        self.is_explained = bool(found.hint)
        if binding.node is not None:
            self.origin = locate(binding.node, binding.attribute, binding.call, None)
            if binding.attribute != "params":  # which has other parameters too
                self.fix = found.fix(self.origin.span)


def source_of_text(bindings: Sequence[Binding]) -> Binding | None:
    """The property or parameter that a text was first written in, among bindings and what they were computed
    from. None if none of them is a text."""
    found = None
    while True:
        text = next((binding for binding in bindings if isinstance(binding.value, str)), None)
        if text is None:
            return found
        found, bindings = text, text.inputs


TOKEN = re.compile(r"(?:\$\{[^{}]*+\}|[^\s$]|\$)++")
"""A word of an attribute with several numbers, which may be an expression with blanks."""


def explain_word(span: Span, value: str, written: str, word: str) -> tuple[Explanation, Fix | None]:
    """Explain a word of an attribute's value that is not a number, and fix this word alone.

    `span` is the value in the source, `written` its text there, and `value` what it evaluates to.
    """
    words, tokens = value.split(), list(TOKEN.finditer(written))
    if word not in words or len(words) != len(tokens):
        return Explanation(""), None
    token = tokens[words.index(word)]
    found = explain(word, token[0])
    return found, found.fix(within(span, written, *token.span()))


def explain(text: str, written: str) -> Explanation:
    """Explain a text. `written` is how the source has it, perhaps with expressions."""
    if "${" in written:
        if "--" in text and _MINUS.search(written):
            return _doubled_minus(text, written)
        return Explanation("")
    if not text.strip():
        return Explanation("write a number")
    comma = _COMMA.fullmatch(text.strip())
    if comma:
        sign, whole, decimals = comma.groups()
        number = f"{sign}{whole or 0}.{decimals}"
        # 1,500 may also be a thousand and five hundred
        return Explanation(f"write {number}", number, is_sure=int(whole or 0) == 0 or len(decimals) != 3)
    unit = _WITH_UNIT.fullmatch(text.strip())
    if unit and unit[2].lower() in _DEGREES:
        number = f"${{radians({unit[1]})}}"
        return Explanation(f"write {number}: angles are in radians", number, is_sure=True)
    if unit and unit[2] in _UNITS:
        power, name = _UNITS[unit[2]]
        number = f"{float(f'{unit[1]}e{power}'):.12g}"
        return Explanation(
            f"write {number}: numbers have no unit, and URDF uses {name}", number, is_sure=True
        )
    return Explanation("")


def _doubled_minus(text: str, written: str) -> Explanation:
    """Explain two signs in a row, as in `-${offset}` if the offset is negative."""
    inner = next((m[1].strip() for m in _MINUS.finditer(written)), "")
    right = _MINUS.sub(_negated, written)
    hint = f"write the minus sign inside the expression: {right}"
    what = f"{inner} is negative" if _NAME.fullmatch(inner) else f"'{inner}' is negative"
    return Explanation(hint, right, is_sure=True, reason=f"{what}, so '-${{{inner}}}' has two minus signs")


def _negated(minus: re.Match[str]) -> str:
    """`${-name}` or `${-(expression)}`."""
    inner = minus[1].strip()
    return "${-" + (inner if _NAME.fullmatch(inner) else f"({inner})") + "}"
