"""Explains errors of expressions in the terms of a robot description instead of Python's."""

from __future__ import annotations

import ast
import math
import re
import warnings
from copy import copy
from itertools import islice
from keyword import iskeyword

from kbot.text.suggest import did_you_mean
from kbot.xacro.expressions.closures import closure_of
from kbot.xacro.expressions.operations import InvalidExpression
from kbot.xacro.names import FUNCTIONS, KNOWN
from kbot.xacro.not_a_number import (
    QUOTED,
    PropertyFault,
    decimal_comma,
    explain,
    is_text_or_several,
    is_unit,
    number_in_expression,
    source_of_text,
)
from kbot.xacro.templates import shortened
from kbot.xacro.values import Value, public_names
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from kbot.xacro.binding import Binding
    from kbot.xacro.expressions.operations import Environment

_LONGEST = 500
"""Characters of an expression whose parts are evaluated again."""
_STEPS = 16
"""Steps charged for each of its characters: parsing and evaluating its parts takes about 15 us each."""
_FAILURES = (ArithmeticError, AttributeError, LookupError, NameError, TypeError, ValueError, XacroError)
_OPERATORS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.Pow: "**",
    ast.BitXor: "^", ast.BitAnd: "&", ast.BitOr: "|", ast.LShift: "<<", ast.RShift: ">>", ast.MatMult: "@",
}  # fmt: skip
_LOGICAL = {"&": "and", "|": "or"}
_PURE = frozenset(
    [*(name for name, value in vars(math).items() if callable(value)), "abs", "int", "float", "min", "max",
     "round", "len", "pow", "radians", "degrees", "str", "sum"]
)  # fmt: skip
"""Functions that may be called again to find the part that fails."""
_NUMBER = re.compile(r"(?<![\w.])(\d[\w.]*+)(?:\s++([A-Za-z]++)(?![\w.(]))?")
_NUMBER_AND_NAME = re.compile(r"(\d++(?:\.\d*+)?)([A-Za-z]\w*+)")
_MALFORMED = re.compile(r"0[boxBOX].*|[\d.]++[eE](?:\d.*)?", re.DOTALL)
"""A word that begins like a binary, octal or hexadecimal number or one with an exponent: `0b12`, `1e5m`."""
_TEXT = re.compile(r"'[^']*+'|\"[^\"]*+\"")
_MOST_NUMBERS = 100
"""Numbers of an invalid expression that are checked. Each takes about 10 us."""
_AMBIGUOUS = ("m", "g")
"""Units that are also common names of properties: mass and gravity."""
_NO_OPERATOR = re.compile(r"((?<![\w.])[\w.]++|\))\s++([\w.]++|\()|(\))([\w.]++|\()")
_SINGLE_EQUALS = re.compile(r"(?<![=!<>:])=(?!=)")
_DANGLING = re.compile(r"([-+*/%]|\*\*)\s*$")
_LOOK_ALIKES = {
    "\N{MULTIPLICATION SIGN}": "*", "\N{MIDDLE DOT}": "*", "\N{DIVISION SIGN}": "/", "\N{MINUS SIGN}": "-",
    "\N{EN DASH}": "-", "\N{SUPERSCRIPT TWO}": "**2", "\N{SUPERSCRIPT THREE}": "**3",
    "\N{RIGHT SINGLE QUOTATION MARK}": "'", "\N{LEFT SINGLE QUOTATION MARK}": "'",
    "\N{LEFT DOUBLE QUOTATION MARK}": "'", "\N{RIGHT DOUBLE QUOTATION MARK}": "'",
}  # fmt: skip


def syntax_fault(error: InvalidExpression, content: str) -> XacroError:
    """The fault of a text that is not an expression."""
    message, hint = _syntax(str(error), content.strip())
    return XacroError("X102", f"invalid expression: {message}", hint)


def _syntax(reason: str, content: str) -> tuple[str, str]:
    """What is wrong in an expression, and what to do."""
    comma = decimal_comma(content)
    if comma:
        return "a decimal comma", f"write {comma[1]}.{comma[2]}"
    for mark, right in _LOOK_ALIKES.items():
        if mark in content:
            return f"'{mark}' is not an operator or quote", f"write {right}"
    for mark, right in (("&&", "and"), ("||", "or"), ("!", "not")):
        if mark in content.replace("!=", ""):
            return f"'{mark}' is not an operator", f"write {right}"
    if reason.startswith("unmatched '"):
        closing = reason.split("'")[1]
        opening = {")": "(", "]": "["}.get(closing, "{")
        return f"one '{closing}' too many", f"remove it, or add the '{opening}' that it closes"
    if "was never closed" in reason:
        opening = reason.split("'")[1]
        return f"a '{opening}' is not closed", f"add {({'(': ')', '[': ']'}).get(opening, '}')!r}"
    if "does not match opening" in reason:
        return "brackets of different kinds close each other", "close '(' with ')' and '[' with ']'"
    if "string literal" in reason:
        return "a quote is not closed", "write ' at both ends of the text"
    if reason.startswith("leading zeros"):
        return "a number begins with 0", "remove the leading zeros"
    content = _TEXT.sub("''", content)
    if "literal" in reason or "invalid syntax" in reason:
        for number in islice(_NUMBER.finditer(content), _MOST_NUMBERS):
            found = _number(number[1], number[2], number[0])
            if found:
                return found
    dangling = _DANGLING.search(content)
    if dangling:
        return f"a value is missing after '{dangling[1]}'", "write the value, or remove the operator"
    if _SINGLE_EQUALS.search(content):
        return "'=' is not a comparison", "write =="
    if "invalid syntax" in reason:
        for missing in _NO_OPERATOR.finditer(content):
            left, right = missing[1] or missing[3], missing[2] or missing[4]
            if iskeyword(left) or iskeyword(right):
                continue
            if left in FUNCTIONS and right != "(":
                argument = right if content[missing.end() :].strip(" )") == "" else "…"
                return f"brackets are missing after '{left}'", f"write {left}({argument})"
            return (
                f"an operator is missing between '{left}' and '{right}'",
                f"write {left} * {right}",
            )
        return "syntax error", "write numbers, names, operators and brackets: ${2 * (a + b)}"
    return reason, ""


def _number(word: str, next_word: str | None, both: str) -> tuple[str, str] | None:
    """What is wrong with a word that begins with a digit and the word after it. None if it is a number."""
    named = _NUMBER_AND_NAME.fullmatch(word)
    if _is_number(word):
        if next_word is None or not is_unit(next_word):
            return None
        number, name = word, next_word
    elif named is None or _MALFORMED.fullmatch(word):
        return f"'{shortened(word, QUOTED)}' is not a number", ""
    else:
        number, name, both = named[1], named[2], word
    if iskeyword(name):
        return None
    if not is_unit(name):
        return f"an operator is missing in '{both}'", f"write {number}*{name}"
    right = number_in_expression(number + name)
    hint = f"write {right}" if right else ""
    if hint and name in _AMBIGUOUS:
        hint += f", or {number}*{name} if '{name}' is a property"
    return f"the number {both} has a unit", hint


def _is_number(word: str) -> bool:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            ast.literal_eval(word)
    except (SyntaxError, ValueError):
        return False
    return True


def failure(error: Exception, content: str, names: Environment) -> XacroError | None:
    """The fault of an expression that raised an error. None if the part that fails is not found."""
    source = content.strip()
    if len(source) > _LONGEST:
        return None
    names.budget.charge(_STEPS * len(source))
    parts = _Parts(names)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(source, mode="eval")
        parts.evaluate(tree.body)
    except _PartFailed as failed:
        return _Explainer(source, parts).explain(failed.node, error)
    except (SyntaxError, RecursionError, MemoryError, ValueError, InvalidExpression, _NotPure):
        pass
    return None


class _PartFailed(Exception):
    """The innermost part of an expression that fails."""

    def __init__(self, node: ast.expr) -> None:
        super().__init__()
        self.node = node


class _NotPure(Exception):
    """A part cannot be evaluated again, because it may have effects."""


class _Parts:
    """Evaluates the parts of an expression one by one, to find the one that fails. Each is evaluated once."""

    def __init__(self, names: Environment) -> None:
        self.names = names
        self._values: dict[ast.expr, Value] = {}

    def value(self, node: ast.expr) -> Value:
        """The value of a part that was evaluated."""
        return self._values[node]

    def evaluate(self, node: ast.expr) -> Value:
        """The value of a part.

        Raises:
            _PartFailed: this part or one inside it fails.
            _NotPure: it may have effects.
        """
        match node:
            case ast.IfExp():
                return self.evaluate(node.body if self.evaluate(node.test) else node.orelse)
            case ast.BoolOp():
                for operand in node.values:
                    value = self.evaluate(operand)
                    if bool(value) is isinstance(node.op, ast.Or):
                        break
                return value
            case ast.Call():
                node_of_values = self._of_call(node)
            case (
                ast.BinOp() | ast.UnaryOp() | ast.Compare() | ast.Name() | ast.Constant() | ast.Subscript()
                | ast.Attribute() | ast.Tuple() | ast.List()
            ):  # fmt: skip
                node_of_values = self._with_values(node)
            case _:
                raise _NotPure
        try:
            value = self._values[node] = closure_of(node_of_values)(self.names)
        except _FAILURES:
            raise _PartFailed(node) from None
        return value

    def _of_call(self, node: ast.Call) -> ast.expr:
        if node.keywords or not isinstance(node.func, ast.Name | ast.Attribute | ast.Constant):
            raise _NotPure
        function = self.evaluate(node.func)
        if callable(function) and _called(node) not in _PURE:
            raise _NotPure
        return ast.Call(func=node.func, args=[self._constant(a) for a in node.args], keywords=[])

    def _with_values(self, node: ast.expr) -> ast.expr:
        """A part with the values of the parts inside it."""
        made = copy(node)
        for name, field in ast.iter_fields(node):
            if isinstance(field, ast.expr) and not isinstance(field, ast.Slice):
                setattr(made, name, self._constant(field))
            elif isinstance(field, list) and field and isinstance(field[0], ast.expr):
                setattr(made, name, [self._constant(item) for item in field])
        return made

    def _constant(self, node: ast.expr) -> ast.expr:
        return ast.Constant(self.evaluate(node))


def _called(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


class _Explainer:
    """Explains the failing part of one expression."""

    def __init__(self, source: str, parts: _Parts) -> None:
        self.source = source
        self.parts = parts

    def explain(self, node: ast.expr, error: Exception) -> XacroError | None:
        try:
            found = self._of_text(node) or self._explain(node, error)
        except _FAILURES:
            return None
        return found

    def _explain(self, node: ast.expr, error: Exception) -> XacroError | None:
        match node:
            case ast.BinOp():
                return self._operation(node, error)
            case ast.UnaryOp() | ast.Compare():
                return self._kinds(list(_operands(node)))
            case ast.Call():
                return self._call(node, error)
            case ast.Subscript():
                return self._item(node, error)
            case ast.Attribute():
                return self._attribute(node)
        return None

    def _of_text(self, node: ast.expr) -> XacroError | None:
        """The fault of an operand that is a text, at the property or parameter that has the text."""
        texts = [(part, value) for part in _operands(node) if isinstance(value := self._value(part), str)]
        if not texts or (isinstance(node, ast.Compare) and len(texts) > 1):
            return None
        part, text = texts[0]
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod) and part is node.left and "%" in text:
            return self._fault(f"the value after '%' does not fit the format '{shortened(text, QUOTED)}'")
        if isinstance(node, ast.Call) and _called(node) in ("str", "len"):
            return None
        name = self._name_of_text(part)
        binding = source_of_text([b for b in (self._binding(name),) if b] if name is not None else ())
        shown = shortened(text, QUOTED)
        if binding is None or binding.node is None:
            hint = _hint_for(text) if isinstance(part, ast.Constant) else ""
            return self._fault(f"'{shown}' is text, not a number", hint)
        found = PropertyFault(binding, names=self._names())
        if not found.is_explained:  # a text that is meant: the expression is wrong
            what = f"'{binding.name}' is the text '{shown}', not a number"
            return self._fault(what, f"its value is written at {found.origin}")
        return _at_property(found, binding)

    def _operation(self, node: ast.BinOp, error: Exception) -> XacroError | None:
        operator = _OPERATORS[type(node.op)]
        left, right = self._segment(node.left), self._segment(node.right)
        if isinstance(error, ZeroDivisionError):
            return self._fault("division by zero" if right == "0" else f"division by zero: '{right}' is 0")
        if isinstance(error, OverflowError):
            return self._fault(f"the result of '{self._segment(node)}' is too large")
        if operator == "^":
            return self._fault("'^' is not a power in an expression", f"write {left}**{right}")
        if operator in _LOGICAL:
            return self._fault(
                f"'{operator}' needs whole numbers", f"for conditions, write {_LOGICAL[operator]}"
            )
        return self._kinds([node.left, node.right], operator)

    def _kinds(self, parts: list[ast.expr], operator: str = "") -> XacroError | None:
        """The fault of an operand that is not a number."""
        for part in parts:
            value, shown = self._value(part), self._segment(part)
            if callable(value):
                return self._fault(f"'{shown}' is a function", f"call it: {shown}(…)")
            if isinstance(value, tuple):
                binding = source_of_text([b for b in (self._binding(part),) if b], is_text_or_several)
                found = PropertyFault(binding) if binding is not None and binding.node is not None else None
                if binding is not None and found is not None and found.is_explained:
                    return _at_property(found, binding)
                comma = decimal_comma(self.source)
                hint = f"write {comma[1]}.{comma[2]}" if comma else "write numbers with a decimal point"
                return self._fault(f"'{shown}' has several values: the comma separates them", hint)
            if not isinstance(value, int | float):
                by = f", and '{operator}' needs numbers" if operator else ""
                return self._fault(f"'{shown}' is {_kind(value)}{by}")
        return None

    def _call(self, node: ast.Call, error: Exception) -> XacroError | None:
        name, shown = self._segment(node.func), self._segment(node)
        inside = ", ".join(self._segment(argument) for argument in node.args)
        function = self._value(node.func)
        if not callable(function):
            what = name if isinstance(node.func, ast.Constant) else f"'{name}'"
            hint = ""
            if isinstance(function, int | float) and len(node.args) <= 1:
                hint = f"to multiply, write {name}*({inside})" if inside else f"write {name} without brackets"
            return self._fault(f"{what} is {_kind(function)}, not a function", hint)
        reason = str(error)
        if "argument" in reason and isinstance(error, TypeError):
            wanted = re.search(
                r"(?:takes|expected)\s+(exactly |at least |at most |from )?(no|one|two|\d+)( to \d+)?", reason
            )
            number = (wanted[1] or "") + wanted[2] + (wanted[3] or "") if wanted else ""
            takes = number.replace("from ", "").replace("exactly ", "") or "a different number of"
            count, is_one = len(node.args), takes.split()[-1] in ("1", "one")
            return self._fault(f"{name}() takes {takes} argument{'s' * (not is_one)}, not {count}")
        if isinstance(error, ValueError) and name not in ("int", "float"):
            values = ", ".join(shortened(str(self._value(argument)), QUOTED) for argument in node.args)
            return self._fault(
                f"{name}({values}) is not defined", f"'{shown}' has no real result for this value"
            )
        if isinstance(error, OverflowError):
            return self._fault(f"the result of '{shown}' is too large")
        if ("not iterable" in reason or "has no len()" in reason) and len(node.args) == 1:
            needed = "a list or at least two values" if name in ("min", "max") else "a list or text"
            return self._fault(
                f"'{inside}' is {_kind(self._value(node.args[0]))}, and {name}() needs {needed}"
            )
        return self._kinds(node.args, f"{name}()")

    def _item(self, node: ast.Subscript, error: Exception) -> XacroError | None:
        owner, index, shown = self._value(node.value), self._value(node.slice), self._segment(node.value)
        if isinstance(error, IndexError):
            count = len(owner)
            last = f", the last is {shown}[{count - 1}]" if count else ""
            entries = "1 entry" if count == 1 else f"{count} entries"
            return self._fault(
                f"'{shown}' has {entries}, so there is no entry {index}", f"count from 0{last}"
            )
        if isinstance(owner, dict):
            return None
        if isinstance(owner, str):
            return self._fault(
                f"'{shown}' is text, so it has no entry '{index}'", "pass a list or dictionary"
            )
        if isinstance(owner, list | tuple):
            hint = f"entries have the numbers 0 to {len(owner) - 1}" if owner else ""
            return self._fault(f"'{shown}' is a list: its index must be a whole number, not '{index}'", hint)
        return self._fault(f"'{shown}' is {_kind(owner)}, so it has no entry '{index}'")

    def _attribute(self, node: ast.Attribute) -> XacroError | None:
        owner, shown = self._value(node.value), self._segment(node.value)
        if isinstance(owner, dict) or hasattr(owner, "xacro_attribute"):
            return None
        near = did_you_mean(node.attr, public_names(owner))
        return self._fault(f"'{shown}' is {_kind(owner)}, so it has no '.{node.attr}'", near)

    def _fault(self, message: str, hint: str = "") -> XacroError:
        shown = shortened(" ".join(self.source.split()), QUOTED)
        return XacroError("X104", f"{message}, in '{shown}'" if shown not in message else message, hint)

    def _value(self, node: ast.expr) -> Value:
        return self.parts.value(node)

    def _segment(self, node: ast.expr) -> str:
        return shortened(ast.get_source_segment(self.source, node) or "", QUOTED)

    def _binding(self, node: ast.expr) -> Binding | None:
        """The property or parameter that a name means; None in a comprehension or lambda function."""
        find = getattr(self.parts.names, "find", None)
        return find(node.id) if find is not None and isinstance(node, ast.Name) else None

    def _names(self) -> frozenset[str]:
        """The names that a property at the top level can use."""
        top = getattr(self.parts.names, "top", None)
        return frozenset({*KNOWN, *top().known()}) if top is not None else frozenset()

    def _name_of_text(self, node: ast.expr) -> ast.Name | None:
        """The name of the text that a part was computed from: `2 * '1'` repeats the text."""
        match node:
            case ast.Name():
                return node if isinstance(self._value(node), str) else None
            case ast.BinOp():
                return self._name_of_text(node.left) or self._name_of_text(node.right)
            case ast.UnaryOp():
                return self._name_of_text(node.operand)
        return None


def _at_property(found: PropertyFault, binding: Binding) -> XacroError:
    """The fault of a property or parameter, for an expression that needs its value."""
    fault = XacroError("X104", found.message, found.hint, key=("text", id(binding)), origin=found.origin)
    fault.fix, fault.is_elsewhere = found.fix, True
    return fault


def _hint_for(text: str) -> str:
    """What to write in an expression for a text that is not a number."""
    right = number_in_expression(text)
    return f"write {right}" if right else explain(text, text).hint


def _operands(node: ast.expr) -> Iterator[ast.expr]:
    match node:
        case ast.BinOp():
            yield from (node.left, node.right)
        case ast.UnaryOp():
            yield node.operand
        case ast.Compare():
            yield from (node.left, *node.comparators)
        case ast.Call():
            yield from node.args


def _kind(value: Value) -> str:
    match value:
        case bool():
            return "a truth value"
        case int() | float():
            return "a number"
        case str():
            return "text"
        case list() | tuple():
            return "a list"
        case dict():
            return "a dictionary"
        case None:
            return "empty"
    return "not a number"
