"""Follows a value of an expansion back to the numbers in the files, and evaluates it with other numbers."""

from __future__ import annotations

import copy
import html
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from kbot.text.numbers import NUMBER
from kbot.text.span import Span
from kbot.text.xml import Element, Text
from kbot.xacro.binding import Binding
from kbot.xacro.budget import Budget
from kbot.xacro.location import within
from kbot.xacro.macros import parse_parameters
from kbot.xacro.substitution import substitute
from kbot.xacro.templates import Piece, evaluate, pieces
from kbot.xacro.terms import Operand, operands
from kbot.xacro.values import Value, literal
from kbot.xacro.xacro_error import XacroError

if TYPE_CHECKING:
    from kbot.xacro.result import Expansion
    from kbot.xacro.scope import Scope


@dataclass(frozen=True, slots=True)
class Written:
    """A text in a file, such as the value of a property, and the bindings that it looks up.

    `value` is decoded. `name` is what the text defines, or empty.
    """

    value: str
    span: Span
    inputs: tuple[Binding, ...]
    name: str = ""

    @property
    def place(self) -> tuple[str, int, int]:
        return self.span.file, self.span.start, self.span.end


@dataclass(frozen=True, slots=True)
class WrittenNumber:
    """A number in the text at a place, from `start` to `end`. `name` is what it defines, or empty."""

    place: tuple[str, int, int]
    start: int
    end: int
    span: Span
    name: str

    def __str__(self) -> str:
        named = f"the value of '{self.name}'" if self.name else f"the number {self.span.text}"
        return f"{named} ({self.span})"


def written_attribute(element: Element, attribute: str) -> Written | None:
    """The text that an attribute of an expansion was computed from. None if it does not exist.

    With an empty `attribute`, the element's own text."""
    if attribute in element.attributes:
        span = element.attribute_origin(attribute).span
        return Written(_decoded(span.text), span, (element.inputs or {}).get(attribute, ()))
    texts = [child for child in element.children if type(child) is Text]
    if attribute or len(texts) != 1 or not texts[0].value.strip():
        return None
    span = element.text_origin.span
    return Written(_decoded(span.text), span, texts[0].inputs)


def definition(binding: Binding) -> Written | None:
    """The text that defines a binding. None if its value is not written in a file."""
    node, origin = binding.node, binding.origin
    if node is None or origin is None or binding.is_given or binding.attribute not in node.attributes:
        return None
    text = node.attributes[binding.attribute]
    if node.tag != "xacro:macro":
        return Written(text, origin.span, binding.inputs, binding.name)
    parameter = next((p for p in parse_parameters(text) if p.name == binding.name), None)
    if parameter is None:
        return None
    if parameter.forwarded and any(known.name == binding.name for known in binding.inputs):
        return Written(f"${{{binding.name}}}", Span(origin.span.source, 0, 0), binding.inputs)
    default = parameter.default or ""
    head = rf"(?<!\S){re.escape(parameter.name)}\s*:?=\s*(?:\^\|?)?"
    match = re.search(rf"{head}({re.escape(default)})(?!\S)", text)
    if match is None:
        return None
    return Written(default, within(origin.span, text, *match.span(1)), binding.inputs, binding.name)


def reached(inputs: Sequence[Binding]) -> Iterator[Binding]:
    """Bindings, and those that they were computed from."""
    waiting, seen = list(inputs), set[int]()
    while waiting:
        binding = waiting.pop()
        if id(binding) not in seen:
            seen.add(id(binding))
            yield binding
            waiting += binding.inputs


def _decoded(text: str) -> str:
    """A text as the parser reads it from an attribute."""
    return html.unescape(text).replace("\r\n", " ").translate({10: " ", 9: " ", 13: " "})


# --- evaluation ------------------------------------------------------------------------------


class Evaluation:
    """Evaluates texts of an expansion with other texts of some numbers."""

    def __init__(self, expansion: Expansion, scope: Scope, texts: Mapping[WrittenNumber, str]) -> None:
        """`scope` is the top level of the expansion."""
        self.scope = scope
        self.run = copy.copy(scope.run)
        self.run.budget, self.run.used, self.run.pending = Budget(scope.run.limits), [], []
        self.run.arguments = _Arguments(self, expansion)
        self._texts: dict[tuple[str, int, int], list[tuple[WrittenNumber, str]]] = {}
        for number, text in texts.items():
            self._texts.setdefault(number.place, []).append((number, text))
        self._values: dict[int, Value] = {}

    def text(self, written: Written) -> Value:
        """The value of a text.

        Raises:
            XacroError: it cannot be evaluated.
        """
        value = written.value
        changed = self._texts.get(written.place, ())
        for number, text in sorted(changed, key=lambda both: both[0].start, reverse=True):
            value = value[: number.start] + text + value[number.end :]
        return evaluate(value, _Names(self, written.inputs))

    def value(self, binding: Binding) -> Value:
        """The value of a binding."""
        if id(binding) not in self._values:
            written = definition(binding)
            value = binding.value if written is None else literal(self.text(written))
            self._values[id(binding)] = value
        return self._values[id(binding)]


class _Names:
    """The names that a text can use, with the values of an evaluation."""

    def __init__(self, evaluation: Evaluation, inputs: Sequence[Binding]) -> None:
        self._evaluation = evaluation
        self.budget = evaluation.run.budget
        self._bindings = _by_name(inputs)
        self._assigned: dict[str, Value] = {}

    def lookup(self, name: str) -> Value:
        if name in self._assigned:
            return self._assigned[name]
        binding = self._bindings.get(name)
        return self._evaluation.scope.lookup(name) if binding is None else self._evaluation.value(binding)

    def assign(self, name: str, value: Value) -> None:
        self._assigned[name] = value

    def substitute(self, content: str) -> str:
        return substitute(content, self._evaluation.run)


class _Arguments(dict[str, str]):
    """The arguments' values in an evaluation."""

    def __init__(self, evaluation: Evaluation, expansion: Expansion) -> None:
        super().__init__(evaluation.run.arguments)
        self._evaluation = evaluation
        self._defaults = expansion.defaults

    def __getitem__(self, name: str) -> str:
        binding = self._defaults.get(name)
        written = definition(binding) if binding is not None else None
        if written is None:
            return super().__getitem__(name)
        return self._evaluation.run.budget.text(self._evaluation.text(written))


def _by_name(inputs: Sequence[Binding]) -> dict[str, Binding]:
    """The properties and parameters among bindings. An argument may have the same name."""
    return {b.name: b for b in inputs if b.node is None or b.node.tag != "xacro:arg"}


# --- candidates ------------------------------------------------------------------------------

TERM, OTHER = range(2)
"""How a number takes part in a value, best first: named and with the unit of the value, or otherwise."""


def numbers_of(
    written: Written, expansion: Expansion, index: int = 0, words: int = 1
) -> Mapping[WrittenNumber, int]:
    """The numbers that may determine a word of a text's value, and how each takes part in it.

    `index` is the position of the word among the `words` of the value.
    """
    found: dict[WrittenNumber, int] = {}
    waiting = [(written, index, words, TERM)]
    seen: set[tuple[tuple[str, int, int], str, int, int]] = set()
    while waiting:
        written, index, words, rank = waiting.pop()
        key = (written.place, written.value, index, rank)
        if key in seen:
            continue
        seen.add(key)
        token = _tokens(written.value)
        if len(token) == words:  # each word is written separately
            token, index, words = [token[index]], 0, 1
        if len(token) != 1:
            continue
        for number, of_number in _literals(written, token[0], rank):
            found[number] = min(of_number, found.get(number, of_number))
        known = _by_name(written.inputs)
        signs = _signs(known)
        for operand in _operands(token[0], signs):
            binding = (expansion.defaults if operand.kind == "argument" else known).get(operand.text)
            inner = definition(binding) if binding is not None else None
            if inner is None or (operand.text in signs and not operand.is_term):
                continue
            of_inner = rank if operand.is_term else max(rank, OTHER)
            # a lone name may have several words as its value
            place = (index, words) if _is_lone(token[0]) else (0, 1)
            waiting.append((inner, *place, of_inner))
    return found


def _tokens(text: str) -> list[list[Piece]]:
    """The words of a text, each as pieces. An expression may contain blanks."""
    words: list[list[Piece]] = [[]]
    try:
        found = pieces(text)
    except XacroError:
        return []
    for piece in found:
        if piece.kind != "text":
            words[-1].append(piece)
            continue
        if piece.content[:1].isspace():
            words.append([])
        for match in re.finditer(r"\S+", piece.content):
            if match.start() and words[-1]:
                words.append([])
            start = piece.start + match.start()
            words[-1].append(Piece("text", match[0], start, start + len(match[0])))
        if piece.content[-1:].isspace():
            words.append([])
    return [word for word in words if word]


def _literals(written: Written, token: Sequence[Piece], rank: int) -> Iterator[tuple[WrittenNumber, int]]:
    """The numbers that are written in a word itself, and how they take part."""
    if len(token) == 1 and token[0].kind == "text":
        if NUMBER.fullmatch(token[0].content):
            yield from _number(written, token[0].start, token[0].content, written.name, rank)
        return
    for piece in token:
        if piece.kind == "expression":
            found = operands(_expression(piece))
            for operand in found:
                # other whole numbers are constants of a formula
                if operand.kind == "number" and (operand.is_term or not operand.text.isdigit()):
                    # the number in `${0.05}` and in `${2 * 0.05}` is the value of the name
                    is_named = operand.is_term and sum(other.is_term for other in found) == 1
                    start = piece.start + 2 + operand.start
                    name, of_number = (written.name, rank) if is_named else ("", OTHER)
                    yield from _number(written, start, operand.text, name, of_number)


def _number(
    written: Written, start: int, text: str, name: str, rank: int
) -> Iterator[tuple[WrittenNumber, int]]:
    span = within(written.span, written.value, start, start + len(text))
    if span.text == text:  # else it cannot be located
        yield WrittenNumber(written.place, start, start + len(text), span, name), rank


def _operands(token: Sequence[Piece], signs: frozenset[str]) -> Iterator[Operand]:
    """The names and arguments in a word."""
    for piece in token:
        if piece.kind == "expression":
            yield from operands(_expression(piece), signs)
        elif piece.kind == "command":
            command, _, rest = piece.content.partition(" ")
            if command == "arg":
                yield Operand("argument", rest.strip(), 0, True)
            elif command == "eval":  # its names are arguments
                for operand in operands(rest):
                    yield replace(operand, kind="argument") if operand.kind == "name" else operand


_ARGUMENT = re.compile(r"\$\(arg (\w+)\)")


def _expression(piece: Piece) -> str:
    """The expression of a piece. `$(arg name)` within it becomes `arg('name')`, which is as long."""
    return _ARGUMENT.sub(r"arg('\1')", piece.content)


def _is_lone(token: Sequence[Piece]) -> bool:
    """Whether a word is a name or an argument alone."""
    if len(token) != 1:
        return False
    content = token[0].content.strip()
    return content.isidentifier() if token[0].kind == "expression" else content.startswith("arg ")


def _signs(known: Mapping[str, Binding]) -> frozenset[str]:
    return frozenset(name for name, binding in known.items() if binding.value in (1, -1, "1", "-1"))
