"""Explains why a text that should be a number is not one, and what to write instead."""

from __future__ import annotations

import ast
import html
import math
import re
import warnings

from kbot.text.numbers import NUMBER
from kbot.xacro.location import locate, within
from kbot.xacro.templates import shortened

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence, Set
    from typing import Literal

    from kbot.text.diagnostic import Fix
    from kbot.text.span import Origin, Span
    from kbot.xacro.binding import Binding
    from kbot.xacro.values import Value

    Quantity = Literal["length", "mass", "angle", ""]
    """What a number measures. Empty if none of these."""

_COMMA = re.compile(r"([+-]?)(\d*+),(\d++)")
_WITH_UNIT = re.compile(r"([+-]?(?:\d++(?:\.\d*+)?|\.\d++))\s*+([A-Za-z]++)")
_UNITS: dict[str, tuple[int, Quantity]] = {
    "m": (0, "length"), "mm": (-3, "length"), "cm": (-2, "length"), "kg": (0, "mass"), "g": (-3, "mass"),
    "rad": (0, "angle"),
}  # fmt: skip
"""The power of ten from a unit to that of URDF, and what it measures."""
_OF_URDF = {"length": "metres", "mass": "kilograms", "angle": "radians"}
_DEGREES = ("deg", "degree", "degrees")
_LONGEST = 500
"""Characters of an expression that is parsed again for its explanation."""
_MOST = 20
"""Expressions of a value that are explained."""
QUOTED = 60
"""Characters of a text that a message quotes."""
_MINUS = re.compile(r"-\s*+\$\{([^{}]*+)\}")
_NAME = re.compile(r"\w+")
_EXPRESSION = re.compile(r"\$\{([^{}]*+)\}")
_DOTTED = re.compile(r"[A-Za-z_][\w.]*")
_SEVERAL = re.compile(r"\([^(),]*+,[^()]*+\)")
_FUNCTION = re.compile(r"<(?:built-in |bound )?(?:function|method|class) '?([\w.]++)")
_DECIMAL_COMMA = re.compile(r"(?<![\w.,])(\d++),(\d++)(?![\w.,])")
_CALLED = re.compile(r"[\w)\]]\s*+$")
_BRACED = re.compile(r"\{([^{}]*+)\}")
"""An expression whose dollar sign was forgotten."""
_ARITHMETIC = (
    ast.Expression, ast.Name, ast.Load, ast.BinOp, ast.UnaryOp, ast.Call, ast.Constant,
    ast.operator, ast.unaryop,
)  # fmt: skip
_NUMBERLIKE = re.compile(r"[-+.(]*+\d[^\sA-Za-z]*+(?:[eE][-+\d.]*+)?")
"""A text that is meant to be a number, such as `--0.1`, `(0.1`, `0.0.1`, `1e`, `1/0` and `5%`."""
_LETTERS = str.maketrans("OolI", "0011")
"""Letters that look like digits."""
_MINUS_SIGNS = str.maketrans("\N{MINUS SIGN}\N{EN DASH}", "--")


def is_unit(word: str) -> bool:
    """Whether a word after a number is a unit that people write."""
    return word in _UNITS or word.lower() in _DEGREES


def is_object(text: str) -> bool:
    """Whether the value of an expression has been written as Python writes a function or several values."""
    return bool(_SEVERAL.search(text) or _FUNCTION.search(text))


def decimal_comma(expression: str) -> re.Match[str] | None:
    """The first comma between two digits that does not separate arguments or the entries of a list."""
    if len(expression) > _LONGEST:
        return None
    inside: list[bool] = []  # for each open bracket, whether its commas separate values
    at = 0
    for comma in _DECIMAL_COMMA.finditer(expression):
        for index in range(at, comma.start()):
            if expression[index] in "([":
                is_call = bool(_CALLED.search(expression, 0, index))
                inside.append(expression[index] == "[" or is_call)
            elif expression[index] in ")]" and inside:
                inside.pop()
        at = comma.start()
        if not any(inside):
            return comma
    return None


def number_in_expression(text: str) -> str:
    """What to write in an expression for a number with a unit. Empty if it is not known."""
    unit = _WITH_UNIT.fullmatch(text.strip())
    if not unit or not is_unit(unit[2]):
        return ""
    return f"radians({unit[1]})" if unit[2].lower() in _DEGREES else _of_urdf(unit[1], unit[2])


def _of_urdf(number: str, unit: str) -> str:
    """The number in the unit of URDF. Empty if it is too large."""
    if unit.lower() in _DEGREES:
        value = f"{math.radians(float(number)):.7g}"
    else:
        value = f"{float(f'{number}e{_UNITS[unit][0]}'):.12g}"
    return value if math.isfinite(float(value)) else ""


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

    def __init__(
        self, binding: Binding, quantity: Quantity | None = None, names: Set[str] = frozenset()
    ) -> None:
        text = str(binding.value)
        written = binding.node.attributes.get(binding.attribute, "") if binding.node is not None else ""
        found = explain(text, text if binding.is_given else written, quantity, names - {binding.name})
        what = f"'{shortened(text, QUOTED)}' is text, not a number" if text.strip() else "the value is empty"
        if is_infinite(binding.value):
            what = f"'{shortened(text if binding.is_given else written, QUOTED)}' is not a finite number"
            found = Explanation("write a finite number")
        if binding.is_given:
            what = f"the given value {what.removeprefix('the value ')}"
        self.message = f"{binding.name}: {what}" + (f": {found.reason}" if found.reason else "")
        if isinstance(binding.value, tuple):
            self.message = f"{binding.name}: {found.reason}"
        self.hint = found.hint
        self.origin: Origin | None = None
        self.fix: Fix | None = None
        self.is_explained = bool(found.hint)
        if binding.node is not None:
            self.origin = locate(binding.node, binding.attribute, binding.call, None)
            if binding.attribute != "params" and not binding.is_given:  # params has other parameters too
                self.fix = found.fix(self.origin.span)


def is_infinite(value: Value) -> bool:
    """Whether a value is infinite or not a number of IEEE 754."""
    return isinstance(value, float) and not math.isfinite(value)


def is_text(value: Value) -> bool:
    return isinstance(value, str)


def is_text_or_several(value: Value) -> bool:
    return isinstance(value, str | tuple)


def source_of_text(
    bindings: Sequence[Binding], is_wrong: Callable[[Value], bool] = is_text
) -> Binding | None:
    """The property or parameter that a text was first written in, among bindings and what they were computed
    from. None if none of them is a text.

    `is_wrong`: whether a value counts as a text.
    """
    found = None
    while True:
        text = next((binding for binding in bindings if is_wrong(binding.value)), None)
        if text is None:
            return found
        found, bindings = text, text.inputs


TOKEN = re.compile(r"(?:\$\{[^{}]*+\}|[^\s$]|\$)++")
"""A word of an attribute with several numbers, which may be an expression with blanks."""


def explain_word(
    span: Span, value: str, written: str, word: str, quantity: Quantity, names: Set[str]
) -> tuple[Explanation, Fix | None]:
    """Explain a word of an attribute's value that is not a number, and fix this word alone.

    `span` is the value in the source, `written` its text there, and `value` what it evaluates to.
    `quantity` and `names`: as for `explain`.
    """
    if "${" in written and is_object(word):
        return _explain_object(value, written), None
    if word == value.strip() and "${" not in written:  # perhaps with blanks: `90 deg`
        found = explain(word, written, quantity, names)
        return found, found.fix(span)
    words, tokens = value.split(), list(TOKEN.finditer(written))
    if word not in words or len(words) != len(tokens):
        return Explanation(""), None
    token = tokens[words.index(word)]
    found = explain(word, token[0], quantity, names)
    return found, found.fix(within(span, written, *token.span()))


def explain(
    text: str, written: str, quantity: Quantity | None = None, names: Set[str] = frozenset()
) -> Explanation:
    """Explain a text. `written` is how the source has it, perhaps with expressions.

    `quantity`: what the number measures, None if it is unknown. `names`: those that an expression can use.
    """
    if "${" in written:
        if "--" in text and _MINUS.search(written):
            return _doubled_minus(text, written)
        return _explain_object(text, written)
    is_whole, text = "$" not in written, text.strip()
    if not text:
        return Explanation("write a number")
    ascii_text = text.translate(_MINUS_SIGNS)
    comma = _COMMA.fullmatch(ascii_text)
    if comma:
        sign, whole, decimals = comma.groups()
        number = f"{sign}{whole or 0}.{decimals}"
        return Explanation(f"write {number}", number if is_whole else "", _is_decimal(whole, decimals))
    unit = _WITH_UNIT.fullmatch(ascii_text)
    if unit and is_unit(unit[2]):
        return _with_unit(unit[1], unit[2], quantity, is_whole)
    if ascii_text != text and NUMBER.fullmatch(ascii_text):
        reason = f"'{text[0]}' is not the minus sign of numbers"
        return Explanation(f"write {ascii_text}", ascii_text if is_whole else "", True, reason)
    digits = ascii_text.translate(_LETTERS)
    if "." in text and digits != ascii_text and NUMBER.fullmatch(digits) and re.search(r"\d", text):
        reason = "a letter is in place of a digit"
        return Explanation(f"write {digits}", digits if is_whole else "", True, reason)
    expression = _as_expression(text, names) if is_whole else ""
    if expression:
        return Explanation(f"did you mean {expression}?", expression, is_sure=True)
    if _NUMBERLIKE.fullmatch(ascii_text):
        return Explanation("write a number, such as 0.05")
    return Explanation("")


def _as_expression(text: str, names: Set[str]) -> str:
    """A text as an expression, if it computes a number from known names. Empty if it does not."""
    braced = _BRACED.fullmatch(text)
    content = braced[1] if braced else text
    if len(content) > _LONGEST:
        return ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            nodes = [*ast.walk(ast.parse(content.strip(), mode="eval"))]
    except (SyntaxError, RecursionError, MemoryError, ValueError):
        return ""
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    constants = [node.value for node in nodes if isinstance(node, ast.Constant)]
    is_arithmetic = all(isinstance(value, int | float) for value in constants) and all(
        isinstance(node, _ARITHMETIC) for node in nodes
    )
    return f"${{{content}}}" if used and used <= names and is_arithmetic else ""


def _with_unit(number: str, unit: str, quantity: Quantity | None, is_whole: bool) -> Explanation:
    """Explain a number with a unit. `is_whole`: the source has it as one text, so that it can be replaced."""
    is_degrees = unit.lower() in _DEGREES
    measured = "angle" if is_degrees else _UNITS[unit][1]
    if quantity is not None and quantity != measured:
        return Explanation(f"write a number without a unit: {unit} is a unit of {measured}")
    right = _of_urdf(number, unit)
    if not right:
        return Explanation("")
    why = f"numbers have no unit, and URDF uses {_OF_URDF[measured]}"
    if is_degrees:
        why = "angles are in radians"
    # a property may be in degrees on purpose, if the description converts it
    is_known = is_whole and (quantity is not None or not is_degrees)
    return Explanation(f"write {right}: {why}", right if is_known else "", is_sure=True)


def _explain_object(text: str, written: str) -> Explanation:
    """Explain an expression whose value is a function or several values."""
    expressions = [expression.strip() for expression in _EXPRESSION.findall(written)[:_MOST]]
    if _SEVERAL.search(text):
        for expression in expressions:
            comma = decimal_comma(expression)
            if comma or _is_list(expression):
                reason = f"'{shortened(expression, QUOTED)}' has several values: the comma separates them"
                right = written.replace(comma[0], f"{comma[1]}.{comma[2]}", 1) if comma else ""
                is_only = comma is not None and written.count(comma[0]) == 1
                is_sure = comma is not None and _is_decimal(comma[1], comma[2])
                return Explanation(_without_comma(comma), right if is_only else "", is_sure, reason)
    function = _FUNCTION.search(text)
    if function is None:
        return Explanation("")
    name = function[1].rpartition(".")[2]
    for expression in expressions:
        if _DOTTED.fullmatch(expression) and (len(expressions) == 1 or expression.endswith(name)):
            return Explanation(f"write {expression}(…)", reason=f"'{expression}' is a function")
    what = f"'{shortened(expressions[0], QUOTED)}'" if len(expressions) == 1 else "an expression"
    return Explanation("write an expression that evaluates to a number", reason=f"{what} is a function")


def _without_comma(comma: re.Match[str] | None) -> str:
    if comma is None:
        return "the comma makes a list of two values"
    whole, decimals = comma.groups()
    thousands = "" if _is_decimal(whole, decimals) else f", or {whole}{decimals}"
    return f"write {whole}.{decimals} with a decimal point{thousands}"


def _is_decimal(whole: str, decimals: str) -> bool:
    """Whether a comma is surely a decimal one: 1,500 may also be a thousand and five hundred."""
    return int(whole[:1] or 0) == 0 or len(decimals) != 3


def _is_list(expression: str) -> bool:
    """Whether commas separate the values of an expression."""
    if len(expression) > _LONGEST:
        return False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return "," in expression and isinstance(ast.parse(expression, mode="eval").body, ast.Tuple)
    except (SyntaxError, RecursionError, MemoryError, ValueError):
        return False


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
