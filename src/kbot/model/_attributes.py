"""Reads XML attributes as numbers and names, and collects errors with their origin."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Protocol

from kbot.model.quantities import quantity_of
from kbot.text import Call, Diagnostic, Edit, Element, Fix, Origin, Related, Severity
from kbot.text.numbers import NUMBER

_WORDS = re.compile(r"[^ \t\n\v\f\r]+")
"""Words between white space as C defines it. ROS reads numbers with C's functions."""
_COMMA = re.compile(r"(\$\{[^{}]*+\}|\$\([^()]*+\))|(?<!\s)\s*+,(\s*+)")
"""A comma with the blanks around it, or an expression, whose commas are not matched."""
FARTHEST = 1e9
"""Metres of the greatest length. With far greater ones, the libraries cannot distinguish triangles."""
_NOT_FINITE = re.compile(r"[+-]*(nan|inf|infinity)", re.IGNORECASE)


class MeshFinder(Protocol):
    """Finds the files of meshes, as `kbot.xacro.packages.Packages` does."""

    def resolve(self, uri: str) -> str | None: ...


NamesAt = Callable[[Call | None], frozenset[str]]
"""The names that an expression can use in the macro of a call, or at the top level."""


def no_names(_: Call | None) -> frozenset[str]:
    """No names: the document is not xacro."""
    return frozenset()


class AttributeReader:
    """Reads attributes and collects their errors.

    A number that cannot be read becomes `fallback`, and an error is recorded. So the reader continues and
    finds further errors, and the robot cannot be used before they are fixed.
    """

    def __init__(self, finder: MeshFinder | None = None, names: NamesAt = no_names) -> None:
        self.finder = finder
        self._names = names
        self.diagnostics: list[Diagnostic] = []
        self.joint_type = ""
        """The type of the joint whose elements are read."""
        self._files: dict[str, str | None] = {}

    def error(
        self,
        code: str,
        message: str,
        origin: Origin,
        hint: str = "",
        related: tuple[Related, ...] = (),
        fix: Fix | None = None,
    ) -> None:
        self.diagnostics.append(Diagnostic(code, Severity.ERROR, message, origin, hint, related, fix))

    def name(self, element: Element) -> str | None:
        """The `name` attribute, or None and an error (U015) if it is missing or empty."""
        name = element.attributes.get("name")
        if name is None:
            self.error("U015", f"<{element.tag}> has no name", element.origin, "add name='…'")
        elif not name.strip():
            self.error("U015", f"<{element.tag}> has an empty name", element.attribute_origin("name"))
        else:
            return name
        return None

    def file(self, uri: str) -> str | None:
        """The file that a mesh's URI names, or None if it does not exist."""
        if uri not in self._files:
            path = self.finder.resolve(uri) if self.finder and uri.strip() else None
            is_file = path is not None and os.path.isfile(path)  # noqa: PTH113 - hot
            self._files[uri] = path if is_file else None
        return self._files[uri]

    def required(self, element: Element, attribute: str) -> str | None:
        """An attribute's text, or None and an error (U013) if it is missing."""
        text = element.attributes.get(attribute)
        if text is None:
            self.error("U013", f"<{element.tag}> lacks the attribute '{attribute}'", element.origin)
        return text

    def number(
        self, element: Element, attribute: str, default: float | None, fallback: float = math.nan
    ) -> float:
        """A number. A missing attribute is `default`, or an error if that is None."""
        if default is not None and attribute not in element.attributes:
            return default
        text = self.required(element, attribute)
        return fallback if text is None else self._read_word(element, attribute, text, fallback)

    def metres(self, element: Element, attribute: str, *values: float) -> None:
        """Add an error (U012) if an attribute has lengths beyond FARTHEST."""
        if not all(abs(value) <= FARTHEST for value in values if not math.isnan(value)):
            message = f"'{attribute}' of <{element.tag}> is more than {FARTHEST:g} m"
            self.error("U012", message, element.attribute_origin(attribute), "lengths are in metres")

    def optional_number(self, element: Element, attribute: str) -> float | None:
        """A number, or None if the attribute is missing or cannot be read."""
        if attribute not in element.attributes:
            return None
        value = self.number(element, attribute, None)
        return None if math.isnan(value) else value

    def vector(
        self,
        element: Element,
        attribute: str,
        default: tuple[float, float, float] | None,
        fallback: float = 0.0,
    ) -> tuple[float, float, float]:
        """Three numbers separated by white space. `default` as for `number`."""
        x, y, z = self.numbers(element, attribute, 3, default, fallback)
        return x, y, z

    def numbers(
        self,
        element: Element,
        attribute: str,
        count: int,
        default: tuple[float, ...] | None,
        fallback: float = math.nan,
    ) -> tuple[float, ...]:
        """`count` numbers separated by white space. `default` as for `number`."""
        if default is not None and attribute not in element.attributes:
            return default
        text = self.required(element, attribute)
        if text is None:
            return (fallback,) * count
        values = _floats(text)
        if values is not None and len(values) == count:
            return values
        from kbot.xacro.not_a_number import is_object  # only for an error: start-up time

        if "${" in text or is_object(text):
            self._not_a_number(element, attribute, text)
            return (fallback,) * count
        words = _WORDS.findall(text)
        separated = _floats(text.replace(",", " "))
        if separated and len(separated) == count and (len(words) != count or text.count(", ") == count - 1):
            self._commas(element, attribute, text, count, len(words))
            return (fallback,) * count
        if len(words) != count:
            message = f"'{attribute}' of <{element.tag}> needs {count} numbers, not {len(words)}"
            hint = "separate numbers by spaces, not by commas" if "," in text else ""
            hint = "write ${…} for an expression" if "{" in text else hint
            self.error("U012", message, element.attribute_origin(attribute), hint)
            return (fallback,) * count
        return tuple(self._read_word(element, attribute, word, fallback) for word in words)

    def _read_word(self, element: Element, attribute: str, text: str, fallback: float) -> float:
        values = _floats(text)
        if values is not None and len(values) == 1:
            return values[0]
        self._not_a_number(element, attribute, text.strip())
        return fallback

    def _commas(self, element: Element, attribute: str, text: str, count: int, words: int) -> None:
        """Report commas between numbers."""
        origin = element.attribute_origin(attribute)
        fix, hint = None, "separate numbers by spaces, not by commas"
        written = [match for match in _COMMA.finditer(origin.span.text) if match[1] is None]
        if len(written) == text.count(","):  # else some come from an expression
            spaced = _COMMA.sub(lambda match: match[1] or match[2] or " ", origin.span.text).strip()
            hint += f": {spaced}"
            fix = Fix(f"write {spaced}", (Edit(origin.span, spaced),), safe=True)
        message = f"'{attribute}' of <{element.tag}> has commas between its numbers"
        if words != count:
            message = f"'{attribute}' of <{element.tag}> needs {count} numbers, not {words}"
        self.error("U012", message, origin, hint, fix=fix)

    def _not_a_number(self, element: Element, attribute: str, text: str) -> None:
        """Report a word of an attribute: at the property that it comes from if that is a text, else here."""
        # only for an error: start-up time
        from kbot.xacro.not_a_number import (
            QUOTED,
            PropertyFault,
            explain_word,
            is_infinite,
            is_object,
            is_text,
            is_text_or_several,
            source_of_text,
        )
        from kbot.xacro.templates import shortened

        quantity = quantity_of(element.tag, attribute, self.joint_type)
        is_wrong = is_infinite if _is_infinite(text) else is_text_or_several if is_object(text) else is_text
        binding = source_of_text((element.inputs or {}).get(attribute, ()), is_wrong)
        if binding is not None and "${" not in text:
            is_copied = text.strip("+- ") == str(binding.value).strip("+- ")
            fault = PropertyFault(binding, quantity if is_copied else None, self._names(None))
            if fault.is_explained and fault.origin is not None:
                self.error("U012", fault.message, fault.origin, fault.hint, fix=fault.fix)
                return
        kind = "a finite number" if _is_infinite(text) else "a number"
        hint = "the expression was not expanded" if "${" in text else ""
        origin = element.attribute_origin(attribute)
        message = f"'{attribute}' of <{element.tag}> is not {kind}: "
        value, written = element.attributes[attribute], origin.span.text
        found, fix = explain_word(origin.span, value, written, text, quantity, self._names(element.call))
        shown = f"'{shortened(text, QUOTED)}'"
        if found.reason:
            shown = found.reason if is_object(text) else f"{shown}: {found.reason}"
        message += shown
        self.error("U012", message, origin, found.hint or hint, fix=fix)


def parts(element: Element) -> dict[str, Element]:
    """The first child element with each name."""
    found: dict[str, Element] = {}
    for child in element.children:
        if type(child) is Element and child.tag not in found:
            found[child.tag] = child
    return found


@lru_cache(maxsize=4096)
def _floats(text: str) -> tuple[float, ...] | None:
    """The finite numbers in a text, separated by white space. None if a word is not one."""
    values = []
    for word in _WORDS.findall(text):
        if not NUMBER.fullmatch(word) or not math.isfinite(value := float(word)):
            return None
        values.append(value)
    return tuple(values)


def _is_infinite(text: str) -> bool:
    return bool(_NOT_FINITE.fullmatch(text) or NUMBER.fullmatch(text))
