"""The numbers a description is made with: its xacro arguments and properties, where they are written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from kbot.text import DescriptionError, Element, Origin, Span, parse_xml, read_source
from kbot.workbench.protocol import Parameter
from kbot.workbench.source.overrides import Overrides
from kbot.workbench.source.places import place_of_span

_WRITTEN_IN = {"xacro:arg": ("arg", "default"), "xacro:property": ("property", "value")}


@dataclass(frozen=True, slots=True)
class Written:
    """A number in a file: the span of its digits."""

    kind: str
    name: str
    value: float
    span: Span


def written_parameters(files: Iterable[str]) -> tuple[Written, ...]:
    """Arguments' defaults and top-level properties that are plain numbers; the first of a name counts."""
    found: dict[tuple[str, str], Written] = {}
    for file in files:
        if Path(file).suffix not in (".xacro", ".urdf", ".xml"):
            continue
        try:
            root = parse_xml(read_source(file))
        except DescriptionError:
            continue
        for element in root.elements():
            written = _written(element)
            if written is not None:
                found.setdefault((written.kind, written.name), written)
    return tuple(found.values())


def parameters_for_page(written: Iterable[Written], overrides: Overrides) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(
            kind="arg" if one.kind == "arg" else "property",
            name=one.name,
            written=one.value,
            value=overrides.value(one.kind, one.name, one.value),
            place=place_of_span(one.span),
        )
        for one in written
    )


def _written(element: Element) -> Written | None:
    if element.tag not in _WRITTEN_IN:
        return None
    kind, attribute = _WRITTEN_IN[element.tag]
    name, text = element.attributes.get("name"), element.attributes.get(attribute, "")
    value = _number(text)
    if not name or value is None:
        return None
    origin: Origin = element.attribute_origin(attribute)
    return Written(kind, name, value, origin.span)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if abs(value) < 1e9 and "_" not in text else None
