"""The numbers a description is made with: its xacro arguments and properties, where they are written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from kbot.text import Span
from kbot.workbench.protocol import Parameter
from kbot.workbench.source.overrides import TRUTHS, Overrides, number_text, value_of
from kbot.workbench.source.places import place_of_span

if TYPE_CHECKING:
    from kbot.xacro import Expansion
    from kbot.xacro.binding import Binding


@dataclass(frozen=True, slots=True)
class Written:
    """A number in a file, or a word for true or false, which is then 1 or 0: the span of it."""

    kind: str
    name: str
    value: float
    span: Span

    @property
    def is_truth(self) -> bool:
        return self.span.text in TRUTHS

    def text_of(self, value: float) -> str:
        """Another value as it is written in its place."""
        if not self.is_truth:
            return number_text(value)
        word = "true" if value else "false"
        return word.capitalize() if self.span.text[0].isupper() else word


def written_parameters(expansion: Expansion | None) -> tuple[Written, ...]:
    """Defaults of arguments and properties of the top level, in the order they are written, file by file. Of
    several definitions it is the one that counted."""
    if expansion is None or expansion.scope is None:
        return ()
    files = {file: index for index, file in enumerate((expansion.path, *expansion.dependencies))}
    found = [
        *_written("arg", expansion.defaults.values()),
        *_written("property", expansion.scope.values.values()),
    ]
    return tuple(sorted(found, key=lambda one: (files.get(one.span.file, len(files)), one.span.start)))


def parameters_for_page(written: Iterable[Written], overrides: Overrides) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(
            kind="arg" if one.kind == "arg" else "property",
            name=one.name,
            written=one.value,
            value=overrides.value(one.kind, one.name, one.value),
            is_truth=one.is_truth,
            place=place_of_span(one.span),
        )
        for one in written
    )


def _written(kind: str, bindings: Iterable[Binding]) -> Iterator[Written]:
    for binding in bindings:
        node, origin = binding.node, binding.origin
        if node is None or origin is None:
            continue
        value = value_of(node.attributes.get(binding.attribute, ""))
        if value is not None:
            yield Written(kind, binding.name, value, origin.span)
