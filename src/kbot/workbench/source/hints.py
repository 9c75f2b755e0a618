"""What the expressions of a description came to, beside the text that they are written in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from kbot.text import Element, Source, Span
from kbot.workbench.protocol import Hint
from kbot.workbench.source.places import place_of_span

if TYPE_CHECKING:
    from kbot.xacro.binding import Binding

MOST_VALUES = 4
"""Values of one place that are told: a macro gives one for each of its calls."""
MOST_CHARACTERS = 60


class Hints:
    """Values of an expanded document's attributes, and of the properties and parameters that it was made
    from, where they are written as expressions."""

    def __init__(self, document: Element | None) -> None:
        self._values: dict[str, dict[tuple[int, int], dict[str, Span]]] = {}
        """By file and place: each value in words, with the place."""
        told: set[int] = set()
        for element in (document, *document.descendants()) if document is not None else ():
            if element.is_plain:
                continue
            for name, value in element.attributes.items():
                self._tell(element.attribute_origin(name).span, value)
            for bindings in (element.fed or {}).values():
                self._tell_bindings(bindings, told)

    def of(self, source: Source) -> tuple[Hint, ...]:
        """Those of a file, in their order; none where it is another text than the one that was expanded."""
        found = sorted(self._values.get(source.path, {}).items())
        return tuple(
            Hint(place_of_span(span), tuple(list(values)[:MOST_VALUES]), len(values) > MOST_VALUES)
            for _, values in found
            if (span := next(iter(values.values()))).source.data == source.data
        )

    def _tell(self, span: Span, value: object) -> None:
        if "$" in span.text:
            places = self._values.setdefault(span.file, {})
            places.setdefault((span.start, span.end), {}).setdefault(_shown(value), span)

    def _tell_bindings(self, bindings: Iterable[Binding], told: set[int]) -> None:
        for binding in _all_of(bindings, told):
            origin = binding.origin
            if origin is not None and isinstance(binding.value, str | int | float | bool):
                self._tell(origin.span, binding.value)


def _all_of(bindings: Iterable[Binding], told: set[int]) -> Iterator[Binding]:
    waiting = list(bindings)
    while waiting:
        binding = waiting.pop()
        if id(binding) not in told:
            told.add(id(binding))
            yield binding
            waiting += binding.fed


def _shown(value: object) -> str:
    """As one writes it: numbers with six digits."""
    text = " ".join(map(_short, str(value).split()))
    return text if len(text) <= MOST_CHARACTERS else f"{text[: MOST_CHARACTERS - 1]}\u2026"


def _short(word: str) -> str:
    try:
        number = float(word)
    except ValueError:
        return word
    return f"{number:.6g}" if math.isfinite(number) and len(word) > 7 else word
