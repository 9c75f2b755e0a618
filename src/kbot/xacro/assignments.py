"""Resolves `name:=value` words: each sets a xacro argument or, if there is none, a top-level property."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from kbot.text.diagnostic import Diagnostic, Severity
from kbot.text.errors import DescriptionError
from kbot.text.span import Origin, Source, Span
from kbot.xacro.binding import LAZY
from kbot.xacro.engine import expand
from kbot.xacro.values import literal

if TYPE_CHECKING:
    from kbot.xacro.binding import Binding
    from kbot.xacro.packages import Packages
    from kbot.xacro.result import Expansion

_NEAREST = 5
"""Names that an error lists: enough for a family of names like `wheel_radius` and `wheel_width`."""


@dataclass(frozen=True)
class Assignments:
    """The meaning of typed names for one description.

    arguments   the values to expand it with: all of them, because xacro ignores undeclared names
    properties  the values that override a top-level property
    notes       one line for each of these properties
    unknown     an error for each name that is neither an argument nor a property
    """

    arguments: Mapping[str, str] = field(default_factory=dict)
    properties: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    unknown: Mapping[str, Diagnostic] = field(default_factory=dict)

    def require(self) -> Assignments:
        """These assignments.

        Raises:
            DescriptionError: a name is neither an argument nor a property.
        """
        if self.unknown:
            raise DescriptionError(self.unknown.values())
        return self


def resolve_names(
    path: str | os.PathLike[str],
    values: Mapping[str, str],
    packages: Packages | None = None,
    properties: Mapping[str, str] | None = None,
    arguments: Mapping[str, str] | None = None,
) -> Assignments:
    """Find the meaning of each typed name, by expanding the file without and with the overridden properties.

    `properties` are always overridden. `arguments` come from a configuration: typed values replace them, and
    they may select includes that declare the typed names. If the file has errors, no name is unknown, because
    an error may hide the declaration.

    Raises:
        DescriptionError: a property is a number in the file, but its new value is not a number.
    """
    if not values:
        return Assignments()
    explicit = dict(properties or {})
    values, typed = {**(arguments or {}), **values}, values
    before = expand(path, values, properties=explicit, packages=packages, lenient=True)
    undeclared = {name: value for name, value in typed.items() if name not in before.declared}
    if not undeclared or before.document is None:  # a slow one that hit a limit is not repeated
        return Assignments(values)
    after = expand(path, values, properties={**undeclared, **explicit}, packages=packages, lenient=True)
    overridden = {name: value for name, value in undeclared.items() if name in after.overridden}
    _require_numbers(overridden, before, after)
    unknown = [name for name in undeclared if name not in {*after.declared, *after.overridden}]
    return Assignments(
        values,
        overridden,
        tuple(_note(name, value, before, after) for name, value in overridden.items()),
        {name: _unknown(name, after) for name in unknown} if after.ok else {},
    )


def _require_numbers(overridden: Mapping[str, str], before: Expansion, after: Expansion) -> None:
    """Reject texts for properties that are numbers in the file: each use would raise a separate error.

    A word is accepted if it causes no error: an `id` of 1 in the names of links may become `left`.
    """
    causes_errors = before.ok and not after.ok
    errors = []
    for name, value in overridden.items():
        binding = _property(name, before)
        if binding is None or binding.state == LAZY or not isinstance(binding.value, int | float):
            continue
        if isinstance(literal(value), str) and (causes_errors or not value.isidentifier()):
            message = f"the value given for {name}, '{value}', is not a number"
            hint = f"the file has {_shown(binding)}. Write a number, with a decimal point"
            errors.append(Diagnostic("X206", Severity.ERROR, message, binding.origin, hint))
    if errors:
        raise DescriptionError(errors)


def _note(name: str, value: str, before: Expansion, after: Expansion) -> str:
    """The new value of a property, and its old value with the line. A removed property has no old value."""
    binding = _property(name, before)
    if binding is not None and binding.origin is not None:
        return f"the property {name} is set to {value}; {_line(binding.origin)} has {_shown(binding)}"
    binding = _property(name, after)
    place = f" ({_line(binding.origin)})" if binding is not None and binding.origin is not None else ""
    return f"the property {name} is set to {value}{place}"


def _property(name: str, expansion: Expansion) -> Binding | None:
    return expansion.scope.values.get(name) if expansion.scope is not None else None


def _shown(binding: Binding) -> object:
    """The value as it is written, or the number that its expression evaluated to, if it was evaluated."""
    written = binding.node.attributes[binding.attribute] if binding.node is not None else ""
    is_number = binding.state != LAZY and isinstance(binding.value, int | float)
    return binding.value if "$" in written and is_number else written


def _line(origin: Origin) -> str:
    return f"{origin.span.file}:{origin.span.line}"


def require_overridden(properties: Iterable[str], expansion: Expansion) -> None:
    """Raises DescriptionError: the description, which has no errors, does not have one of the properties."""
    missing = [name for name in properties if name not in expansion.overridden]
    if missing and expansion.ok:
        raise DescriptionError(
            unknown("X206", f"there is no top-level property '{name}'", name, expansion) for name in missing
        )


def _unknown(name: str, expansion: Expansion) -> Diagnostic:
    return unknown("X206", f"there is no argument or top-level property '{name}'", name, expansion)


def unknown(code: str, message: str, name: str, expansion: Expansion) -> Diagnostic:
    """An error for a name that a description does not define, with the most similar names that it defines."""
    from difflib import get_close_matches  # imported only for an error: imports add up

    kinds = dict.fromkeys(expansion.declared, "argument")
    for known, binding in (expansion.scope.values if expansion.scope is not None else {}).items():
        if binding.attribute in ("value", "default"):  # neither a block nor assigned in an expression
            kinds.setdefault(known, "property")
    near = get_close_matches(name, kinds, _NEAREST, cutoff=0.0)
    listed = ", ".join(f"{known} ({kinds[known]})" for known in near)
    hint = f"the nearest names are {listed}" if near else "the file declares no arguments and no properties"
    start = Origin(Span(Source(expansion.path or "", ""), 0, 0))
    return Diagnostic(code, Severity.ERROR, f"{message}; {hint}", start)
