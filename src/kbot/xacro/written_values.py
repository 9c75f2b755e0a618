"""Finds the edits that give a parameter or an attribute another value, at the line that defines the value.

The value of an attribute may come through properties, arguments, parameters of macros and expressions from a
number that is written elsewhere. `attribute_edits` finds that number. `parameter_edits` edits arguments and
properties themselves.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import zip_longest
from typing import TYPE_CHECKING

from kbot.text.diagnostic import Edit
from kbot.text.edits import edited_texts
from kbot.text.errors import KbotError
from kbot.text.files import unsaved
from kbot.text.numbers import NUMBER
from kbot.text.recursion import recursion_limit
from kbot.text.span import Call, Span
from kbot.text.xml import Element
from kbot.xacro.assignments import require_overridden
from kbot.xacro.engine import expand
from kbot.xacro.values import Value, is_number
from kbot.xacro.written_numbers import (
    Evaluation,
    Written,
    WrittenNumber,
    numbers_of,
    reached,
    written_attribute,
)
from kbot.xacro.xacro_error import XacroError

if TYPE_CHECKING:
    from kbot.xacro.binding import Binding
    from kbot.xacro.packages import Packages
    from kbot.xacro.result import Expansion
    from kbot.xacro.scope import Scope

TRUTHS = {"true": 1.0, "True": 1.0, "false": 0.0, "False": 0.0}
"""Words for true and false, which count as 1 and 0."""
_MOST = 1e9
"""Larger numbers are not values that a user adjusts."""

# --- arguments and properties ----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class WrittenValue:
    """An argument or a top-level property whose value is written as a number, or as true or false.

    `kind` is "arg" or "property". `binding` is the definition in effect.
    """

    kind: str
    binding: Binding
    value: float
    span: Span

    @property
    def name(self) -> str:
        return self.binding.name

    @property
    def is_truth(self) -> bool:
        return self.span.text in TRUTHS

    def text_of(self, value: float) -> str:
        """Another value in the notation of this one."""
        if not self.is_truth:
            return number_text(value, self.span.text)
        word = "true" if value else "false"
        return word.capitalize() if self.span.text[0].isupper() else word


def written_parameters(expansion: Expansion | None) -> tuple[WrittenValue, ...]:
    """The defaults of arguments, and the top-level properties, in the order of the files.

    If there are several definitions, the one in effect is returned.
    """
    if expansion is None or expansion.scope is None:
        return ()
    files = {file: index for index, file in enumerate((expansion.path, *expansion.dependencies))}
    found = [
        *_written("arg", expansion.defaults.values()),
        *_written("property", expansion.scope.values.values()),
    ]
    return tuple(
        sorted(found, key=lambda number: (files.get(number.span.file, len(files)), number.span.start))
    )


def _written(kind: str, bindings: Iterable[Binding]) -> Iterator[WrittenValue]:
    for binding in bindings:
        node, origin = binding.node, binding.origin
        if node is None or origin is None:
            continue
        value = value_of(node.attributes.get(binding.attribute, ""))
        if value is not None:
            yield WrittenValue(kind, binding, value, origin.span)


def value_of(text: str) -> float | None:
    """The number in a text, 1 or 0 for a word for true or false, and None for anything else."""
    try:
        value = TRUTHS[text] if text in TRUTHS else float(text)
    except ValueError:
        return None
    return value if abs(value) < _MOST and "_" not in text else None


def number_text(value: float, like: str = "") -> str:
    """The shortest text of a number, in the notation of another text of a number.

    It has an exponent if that one has an exponent, and a decimal point if that one has a decimal point.
    """
    return _in_notation(repr(float(value)), like if NUMBER.fullmatch(like) else "")


def _in_notation(text: str, like: str) -> str:
    """A number's text, with the same digits, in the notation of another one."""
    number = Decimal(text)
    if "e" in like.lower():
        mantissa, _, exponent = f"{number.normalize():e}".partition("e")
        return f"{mantissa}{'E' if 'E' in like else 'e'}{int(exponent)}"
    if number and not 1e-6 <= abs(number) < _MOST:
        return f"{float(text):g}" if float(f"{float(text):g}") == float(text) else text
    plain = f"{number:f}"
    whole, _, decimals = plain.partition(".")
    decimals = decimals.rstrip("0") or ("0" if "." in like else "")
    return f"{whole}.{decimals}" if decimals else whole


@dataclass(frozen=True, slots=True)
class ParameterEdit:
    """The edit of an argument or a property. `calls` are the includes and macro calls that lead to it."""

    name: str
    edit: Edit
    calls: tuple[Call | None, ...]


@dataclass(frozen=True, slots=True)
class ParameterEdits:
    """Edits of parameters, and the expansion with the new values, which the edited files must equal."""

    edits: tuple[ParameterEdit, ...]
    wanted: Expansion


def parameter_edits(
    path: str,
    arguments: Mapping[str, float | str],
    properties: Mapping[str, float | str],
    packages: Packages | None = None,
) -> ParameterEdits:
    """The edits that give arguments and top-level properties other values where they are defined.

    A property that is computed from others becomes a plain value. A property that is defined several times
    has the new value at each definition, as with `kbot expand --set`. Arguments that the description does not
    declare are ignored, as xacro ignores them.

    Raises:
        DescriptionError: the description has errors, or does not have one of the properties.
        KbotError: the edited files do not expand to the same robot as the new values.
    """
    definitions: dict[tuple[str, int], list[Binding]] = {}

    def collect(event: str, scope: Value, name: str, value: Value) -> None:
        binding = scope.values.get(name)
        if event == "set" and scope.parent is None and name in properties and binding.origin is not None:
            span = binding.origin.span
            definitions.setdefault((span.file, span.start), []).append(binding)

    texts = {name: str(value) for name, value in arguments.items()}
    overrides = {name: str(value) for name, value in properties.items()}
    wanted = expand(path, texts, properties=overrides, packages=packages, log=collect, lenient=True).require()
    require_overridden(properties, wanted)
    found = [(bindings, properties[bindings[0].name]) for bindings in definitions.values()]
    found += [
        ([wanted.defaults[name]], value) for name, value in arguments.items() if name in wanted.defaults
    ]
    edits = tuple(
        ParameterEdit(bindings[0].name, Edit(origin.span, text), tuple(binding.call for binding in bindings))
        for bindings, value in found
        if (origin := bindings[0].origin) is not None
        if (text := _attribute_text(value, origin.span)) != origin.span.text
    )
    with unsaved({file: after for file, (_, after) in edited_texts(e.edit for e in edits).items()}):
        result = expand(path, packages=packages, lenient=True)
    if not is_same_robot(result, wanted):
        names = ", ".join([*arguments, *properties])
        raise KbotError(f"{path}: no edit of its files gives the same robot as the new values of {names}")
    return ParameterEdits(edits, wanted)


def is_same_robot(result: Expansion, wanted: Expansion) -> bool:
    """Whether two expansions give the same robot. Numbers may be written differently."""
    if not result.ok or result.document is None or wanted.document is None:
        return False
    pairs = zip_longest(
        (result.document, *result.document.descendants()), (wanted.document, *wanted.document.descendants())
    )
    return all(
        a is not None
        and b is not None
        and (a.tag, len(a.attributes)) == (b.tag, len(b.attributes))
        and all(_is_same_text(was, text) for _, was, text in _differences(a, b))
        for a, b in pairs
    )


def _is_same_text(a: str, b: str) -> bool:
    words = zip_longest(a.split(), b.split(), fillvalue="")
    return all(
        x == y or bool(NUMBER.fullmatch(x) and NUMBER.fullmatch(y) and float(x) == float(y)) for x, y in words
    )


def _attribute_text(value: float | str, span: Span) -> str:
    """A value as it is written between the quotes of an attribute."""
    if not isinstance(value, str):
        return span.text if value_of(span.text) == value else number_text(value, span.text)
    from xml.sax.saxutils import escape

    return escape(value, {'"': "&quot;", "'": "&apos;"})


# --- attributes ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class WantedValue:
    """A value for an attribute of an element of an expansion.

    `attribute` is empty for the element's own text. `index` is the position of the number in the attribute,
    such as 1 for y in `xyz`.
    """

    element: Element
    attribute: str
    value: float
    index: int = 0


@dataclass(frozen=True, slots=True)
class ChangedValue:
    """An attribute that changes with the edits. Its name and place are in `title`."""

    title: str
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.title}: {self.before} → {self.after}"


@dataclass(frozen=True, slots=True)
class ValueEdits:
    """Edits that give attributes the wanted values, and the other attributes that change with them."""

    edits: tuple[Edit, ...]
    others: tuple[ChangedValue, ...]


def attribute_edits(expansion: Expansion, wanted: Sequence[WantedValue]) -> ValueEdits:
    """The edits that give attributes of an expansion other values, verified by another expansion.

    A value may be computed from several numbers. Then the edited number is a term of the expression rather
    than a factor, the value of a name rather than a number within an expression, and the one that the fewest
    attributes depend on. To keep an attribute unchanged, pass its present value.

    Raises:
        DescriptionError: the description has errors.
        KbotError: an attribute does not exist or is not a number, no number in the files determines it, or
            one number would need two values.
    """
    document, scope = expansion.require().document, expansion.scope
    if document is None or scope is None:
        raise KbotError("the description is empty")
    with recursion_limit(scope.run.limits.nesting * 8 + 1000):  # properties may depend on others in a chain
        texts = _Search(expansion, document, scope).texts_of(wanted)
    edits = tuple(Edit(n.span, text) for n, text in texts.items() if n.span.text != text)
    return ValueEdits(edits, _verified(expansion, document, scope, wanted, edits))


_MOST_ROUNDS = 20
"""Rounds over values that depend on each other. Two are usual."""
_MOST_STEPS = 50
"""Steps of the secant method. One is usual, and a cube takes ten."""
_EXACT = 1e-14
"""Difference from the wanted value, as a ratio, that rounding explains. It avoids texts such as
`0.30000000000000004`."""


class _Search:
    """Finds the numbers to edit, and their new texts."""

    def __init__(self, expansion: Expansion, document: Element, scope: Scope) -> None:
        self._expansion = expansion
        self._document = document
        self._scope = scope
        self._title = _Titles(document)

    def texts_of(self, wanted: Sequence[WantedValue]) -> Mapping[WrittenNumber, str]:
        """The new text of each number to edit."""
        texts: dict[WrittenNumber, str] = {}
        users: dict[WrittenNumber, WantedValue] = {}
        for _ in range(_MOST_ROUNDS):  # an edit for one value may change another one
            wrong = [want for want in wanted if not _is_close(self._value(want, texts), want.value)]
            if not wrong:
                return texts
            for want in wanted:
                if _is_close(self._value(want, texts), want.value):
                    continue
                number, text = self._solution(want, texts, users)
                texts[number], users[number] = text, want
        numbers = ", ".join(map(str, users))
        raise KbotError(
            f"{self._title(wrong[0])} cannot be {wrong[0].value:g} together with the other values, "
            f"because they are computed from the same numbers: {numbers}"
        )

    def _solution(
        self,
        want: WantedValue,
        texts: Mapping[WrittenNumber, str],
        users: Mapping[WrittenNumber, WantedValue],
    ) -> tuple[WrittenNumber, str]:
        written = self._written(want)
        words = self._words(written, texts)
        used: WrittenNumber | None = None
        for number in self._ranked(numbers_of(written, self._expansion, want.index, len(words))):
            if users.get(number, want) is not want:
                used = used or number
                continue
            text = self._solved(want, number, texts)
            if text is not None:
                return number, text
        if used is not None:
            raise KbotError(
                f"{used} would need two values: {texts[used]} for {self._title(users[used])}, and another "
                f"one to make {self._title(want)} {want.value:g}. Define the two values separately"
            )
        shown = f"{self._title(want)} cannot become {want.value:g}"
        for binding in reached(written.inputs):
            if binding.is_given and is_number(binding.value):
                raise KbotError(
                    f"{shown}: it depends on '{binding.name}', whose value is given, not in a file"
                )
            if isinstance(binding.value, dict | list):
                raise KbotError(
                    f"{shown}: it depends on data in '{binding.name}', not on a number in a xacro file"
                )
        raise KbotError(f"{shown}: no number in the files can be changed so that '{written.value}' gives it")

    def _ranked(self, candidates: Mapping[WrittenNumber, int]) -> Sequence[WrittenNumber]:
        """Numbers that may be edited, best first."""
        if len(candidates) < 2:
            return list(candidates)
        uses = dict.fromkeys(candidates, 0)
        for element in (self._document, *self._document.descendants()):
            for attribute in (*element.attributes, ""):
                written = written_attribute(element, attribute)
                for number in numbers_of(written, self._expansion) if written and written.inputs else ():
                    if number in uses:
                        uses[number] += 1
        return sorted(candidates, key=lambda number: (candidates[number], uses[number], not number.name))

    def _solved(
        self, want: WantedValue, number: WrittenNumber, texts: Mapping[WrittenNumber, str]
    ) -> str | None:
        """The text of a number that gives a value, or None if there is none."""

        def result(text: str) -> float:
            try:
                return self._value(want, {**texts, number: text})
            except KbotError:
                return math.nan

        x = float(texts.get(number, number.span.text))
        y, next_x = result(repr(x)), x + (0.1 * abs(x) or 0.1)
        for _ in range(_MOST_STEPS):  # secant method: one step is exact for sums and constant factors
            next_y = result(repr(next_x))
            if not math.isfinite(next_y) or next_y == y:
                break
            x, y, next_x = next_x, next_y, next_x + (want.value - next_y) * (next_x - x) / (next_y - y)
            if _is_close(y, want.value, _EXACT):
                break
        if not _is_close(y, want.value):
            return None
        short = [_in_notation(f"{x:.{digits}g}", number.span.text) for digits in range(1, 18)]
        exact = (text for text in short if _is_close(result(text), want.value, _EXACT))
        return next(exact, None) or min(short, key=lambda text: abs(result(text) - want.value))

    def _written(self, want: WantedValue) -> Written:
        written = written_attribute(want.element, want.attribute)
        if written is None:
            raise KbotError(f"{self._title(want)} does not exist")
        return written

    def _words(self, written: Written, texts: Mapping[WrittenNumber, str]) -> Sequence[str]:
        try:
            return str(Evaluation(self._expansion, self._scope, texts).text(written)).split()
        except (XacroError, RecursionError):
            return ()

    def _value(self, want: WantedValue, texts: Mapping[WrittenNumber, str]) -> float:
        written = self._written(want)
        words = self._words(written, texts)
        if want.index >= len(words) or not NUMBER.fullmatch(words[want.index]):
            raise KbotError(f"{self._title(want)} is not a number: '{written.value}'")
        return float(words[want.index])


def _is_close(value: float, wanted: float, tolerance: float = 1e-9) -> bool:
    return math.isclose(value, wanted, rel_tol=tolerance, abs_tol=tolerance * 1e-3)


class _Titles:
    """Names attributes in messages: `'radius' of <cylinder> in link 'wheel' (robot.xacro:7:20)`."""

    def __init__(self, document: Element) -> None:
        self._owners = {
            id(part): element for element in document.elements() for part in element.descendants()
        }

    def __call__(self, want: WantedValue) -> str:
        axes = want.attribute if want.attribute in ("xyz", "rpy") else ""
        axis = f"{axes[want.index]} in " if want.index < len(axes) else ""
        return axis + self.of(want.element, want.attribute)

    def of(self, element: Element, attribute: str) -> str:
        owner = self._owners.get(id(element))
        name = (
            owner.attributes.get("name", owner.attributes.get("reference", "")) if owner is not None else ""
        )
        inside = f" in {owner.tag}" + (f" '{name}'" if name else "") if owner is not None else ""
        what = f"'{attribute}' of <{element.tag}>" if attribute else f"<{element.tag}>"
        span = element.attribute_origin(attribute).span if attribute else element.text_origin.span
        return f"{what}{inside} ({span})"


def _verified(
    expansion: Expansion,
    document: Element,
    scope: Scope,
    wanted: Sequence[WantedValue],
    edits: Sequence[Edit],
) -> tuple[ChangedValue, ...]:
    """Check the wanted values in an expansion with the edits. Returns the other values that change."""
    run = scope.run
    with unsaved({file: after for file, (_, after) in edited_texts(edits).items()}):
        result = expand(
            expansion.path or "",
            run.given,
            properties=expansion.overridden,
            packages=run.packages,
            limits=run.limits,
            root_dir=run.root_dir,
            lenient=run.lenient,
        ).require()
    before = [document, *document.descendants()]
    after = [result.document, *result.document.descendants()] if result.document is not None else []
    if [element.tag for element in before] != [element.tag for element in after]:
        raise KbotError(f"{edits[0].span}: the new value changes which elements the robot has")
    pairs = {id(old): new for old, new in zip(before, after, strict=True)}
    for want in wanted:
        element = pairs[id(want.element)]
        text = element.attributes[want.attribute] if want.attribute else element.text
        if not _is_close(float(text.split()[want.index]), want.value):
            raise KbotError(f"{_Titles(document)(want)} would be {text}, not {want.value:g}")
    expected = {(id(want.element), want.attribute) for want in wanted}
    titles = _Titles(document)
    return tuple(
        ChangedValue(titles.of(old, attribute), was, text)
        for old in before
        for attribute, was, text in _differences(old, pairs[id(old)])
        if (id(old), attribute) not in expected
    )


def _differences(old: Element, new: Element) -> Iterator[tuple[str, str, str]]:
    """The attributes that differ, and the text with an empty name, each before and after."""
    for attribute in (*old.attributes, ""):
        was = old.attributes[attribute] if attribute else old.text.strip()
        text = new.attributes.get(attribute, "") if attribute else new.text.strip()
        if was != text:
            yield attribute, was, text
