"""Formats of values in YAML: each one reads a value, and describes itself as JSON Schema.

The formats of dataclasses are made from their fields: types, defaults, and the lists in their docstrings. All
errors of a file are collected, each with its place.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from kbot.text import KbotError, Origin
from kbot.text.diagnostic_collector import DiagnosticCollector
from kbot.text.suggest import suggest_or_list
from kbot.text.yaml import Keys, YamlDocument

KEY_UNKNOWN, KEY_MISSING, VALUE_WRONG, NAME_UNKNOWN = "T102", "T103", "T104", "T105"

Schema = dict[str, object]
_UNIT = re.compile(r"\bin (m/s|rad/s|m|rad|s|kg|N m|N)(?![\w/])")


class _Wrong:
    """What `Format.read` returns after an error."""


WRONG: Final = _Wrong()
REQUIRED: Final = object()
"""In place of a default."""


@dataclass(frozen=True, slots=True)
class Place:
    """The place of a value in a document, and where its errors are collected."""

    document: YamlDocument
    errors: DiagnosticCollector
    keys: Keys = ()

    def __truediv__(self, key: object) -> Place:
        return Place(self.document, self.errors, (*self.keys, str(key)))

    @property
    def folder(self) -> Path:
        """The folder of the file."""
        return Path(self.document.source.path).parent

    @property
    def text(self) -> str:
        """The value as it is written."""
        found = self.document.place(*self.keys)
        return found.value.text if found is not None else ""

    def error(self, code: str, message: str, hint: str = "", *, at_key: bool = False) -> _Wrong:
        """Report an error of the value, or of its key."""
        found = self.document.place(*self.keys)
        span = self.document.span(*self.keys)
        if found is not None and not at_key:
            span = found.value
        self.errors.error(code, message, Origin(span), hint)
        return WRONG

    def expected(self, what: str, value: object) -> _Wrong:
        name = next((f"'{key}'" for key in reversed(self.keys) if not key.isdigit()), "the scenario")
        return self.error(VALUE_WRONG, f"{name} must be {what}, not {_kind_of(value)}")


class Format(Protocol):
    """The format of a value."""

    @property
    def label(self) -> str:
        """What the value is, such as `a number`."""
        ...

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - the type depends on the format
        """The value for Python, or WRONG after an error."""
        ...

    def schema(self) -> Schema: ...


@dataclass(frozen=True, slots=True)
class Number:
    label: str = "a number"

    def read(self, value: object, at: Place) -> float | _Wrong:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return at.expected(self.label, value)
        if not math.isfinite(value):
            return at.expected("a finite number", value)
        return float(value)

    def schema(self) -> Schema:
        return {"type": "number"}


@dataclass(frozen=True, slots=True)
class Integer:
    label: str = "an integer"

    def read(self, value: object, at: Place) -> int | _Wrong:
        return (
            value
            if isinstance(value, int) and not isinstance(value, bool)
            else at.expected(self.label, value)
        )

    def schema(self) -> Schema:
        return {"type": "integer"}


@dataclass(frozen=True, slots=True)
class Flag:
    label: str = "true or false"

    def read(self, value: object, at: Place) -> bool | _Wrong:
        return value if isinstance(value, bool) else at.expected(self.label, value)

    def schema(self) -> Schema:
        return {"type": "boolean"}


@dataclass(frozen=True, slots=True)
class Text:
    label: str = "a text"

    def read(self, value: object, at: Place) -> str | _Wrong:
        return value if isinstance(value, str) else at.expected(self.label, value)

    def schema(self) -> Schema:
        return {"type": "string"}


@dataclass(frozen=True, slots=True)
class AsWritten:
    """A text that may be written without quotes, although it looks like a number: `wheel_radius: 0.040`."""

    label: str = "a value"

    def read(self, value: object, at: Place) -> str | _Wrong:
        if isinstance(value, str):
            return value
        return at.text if isinstance(value, bool | int | float) else at.expected("a number or a text", value)

    def schema(self) -> Schema:
        return {"type": ["string", "number", "boolean"]}


@dataclass(frozen=True, slots=True)
class FileName:
    """A file, relative to the file that names it. `find` returns its path, or raises KbotError."""

    find: Callable[[str, Path], str]
    label: str = "a file"

    def read(self, value: object, at: Place) -> str | _Wrong:
        if not isinstance(value, str) or not value:
            return at.expected(self.label, value)
        try:
            return self.find(value, at.folder)
        except KbotError as error:
            return at.error(VALUE_WRONG, str(error))

    def schema(self) -> Schema:
        return {"type": "string"}


@dataclass(frozen=True, slots=True)
class Vector3:
    label: str = "a list of three numbers x, y, z"

    def read(self, value: object, at: Place) -> tuple[float, ...] | _Wrong:
        if not isinstance(value, list) or len(value) != 3:
            return at.expected(self.label, value)
        numbers = [Number().read(each, at / index) for index, each in enumerate(value)]
        return (
            tuple(number for number in numbers if not isinstance(number, _Wrong))
            if _is_fine(numbers)
            else WRONG
        )

    def schema(self) -> Schema:
        return {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}


@dataclass(frozen=True, slots=True)
class Nullable:
    """A value that may be left out, or null."""

    inner: Format

    @property
    def label(self) -> str:
        return self.inner.label

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - as in Format
        return None if value is None else self.inner.read(value, at)

    def schema(self) -> Schema:
        return self.inner.schema()


@dataclass(frozen=True, slots=True)
class ListOf:
    inner: Format

    @property
    def label(self) -> str:
        return "a list"

    def read(self, value: object, at: Place) -> tuple[Any, ...] | _Wrong:
        if not isinstance(value, list):
            return at.expected(self.label, value)
        items = [self.inner.read(each, at / index) for index, each in enumerate(value)]
        return tuple(items) if _is_fine(items) else WRONG

    def schema(self) -> Schema:
        return {"type": "array", "items": self.inner.schema()}


@dataclass(frozen=True, slots=True)
class MapOf:
    """A mapping. `names` are the known keys with their descriptions; None: any key."""

    inner: Format
    names: Mapping[str, str] | None = None
    what: str = "name"

    @property
    def label(self) -> str:
        return "a mapping"

    def read(self, value: object, at: Place) -> dict[str, Any] | _Wrong:
        if not isinstance(value, dict):
            return at.expected(self.label, value)
        found = {}
        for key, each in value.items():
            name = str(key)
            if self.names is not None and name not in self.names:
                hint = suggest_or_list(name, self.names)
                found[name] = (at / name).error(
                    NAME_UNKNOWN, f"unknown {self.what} '{name}'", hint, at_key=True
                )
            else:
                found[name] = self.inner.read(each, at / name)
        return found if _is_fine(found.values()) else WRONG

    def schema(self) -> Schema:
        if self.names is None:
            return {"type": "object", "additionalProperties": self.inner.schema()}
        properties = {name: Entry(self.inner, text).schema() for name, text in self.names.items()}
        return {"type": "object", "properties": properties, "additionalProperties": False}


@dataclass(frozen=True, slots=True)
class Shared:
    """A format that the JSON Schema describes once, as the definition `name`."""

    name: str
    inner: Format

    @property
    def label(self) -> str:
        return self.inner.label

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - as in Format
        return self.inner.read(value, at)

    def schema(self) -> Schema:
        return {"$ref": f"#/definitions/{self.name}"}


@dataclass(frozen=True, slots=True)
class Entry:
    """A key of a mapping. `default` is REQUIRED if it must be given."""

    format: Format
    description: str
    default: object = REQUIRED

    @property
    def is_required(self) -> bool:
        return self.default is REQUIRED

    def schema(self) -> Schema:
        found: Schema = {**self.format.schema()}
        if "$ref" in found:  # draft 7 ignores what is beside a reference
            found = {"allOf": [found]}
        if self.description:
            found["description"] = self.description
        if _is_plain(self.default):
            found["default"] = list(self.default) if isinstance(self.default, tuple) else self.default
        return found


@dataclass(frozen=True)
class Record:
    """A mapping with the fields of a dataclass.

    kind      the dataclass, or a function with its keywords
    entries   by key
    summary   one line
    short     the key to which a plain value belongs; empty if a mapping is required
    """

    kind: Callable[..., object]
    entries: Mapping[str, Entry]
    summary: str = ""
    short: str = ""

    @property
    def label(self) -> str:
        keys = ", ".join(self.entries)
        return (
            f"{self.entries[self.short].format.label}, or a mapping with {keys}"
            if self.short
            else f"a mapping with {keys}"
        )

    @property
    def may_be_empty(self) -> bool:
        return not any(entry.is_required for entry in self.entries.values())

    def read(self, value: object, at: Place) -> Any:  # noqa: ANN401 - as in Format
        if value is None and self.may_be_empty:
            value = {}
        if self.short and not isinstance(value, dict):
            inner = self.entries[self.short].format.read(value, at)
            return WRONG if inner is WRONG else self.made({self.short: inner}, at)
        if not isinstance(value, dict):
            return at.expected(self.label, value)
        found = self.read_entries(value, at)
        return self.made(found, at) if _is_fine(found.values()) else WRONG

    def read_entries(self, value: Mapping[Any, object], at: Place) -> dict[str, Any]:
        """The values by key, WRONG for those with an error."""
        found: dict[str, Any] = {}
        for key, each in value.items():
            name = str(key)
            if name in self.entries:
                found[name] = self.entries[name].format.read(each, at / name)
            else:
                hint = suggest_or_list(name, self.entries)
                found[name] = (at / name).error(KEY_UNKNOWN, f"unknown key '{name}'", hint, at_key=True)
        for name, entry in self.entries.items():
            if entry.is_required and name not in value:
                found[name] = at.error(
                    KEY_MISSING, f"'{name}' is missing: {entry.description}".rstrip(": "), at_key=True
                )
        return found

    def made(self, values: Mapping[str, Any], at: Place) -> Any:  # noqa: ANN401 - as in Format
        """The object of these values, or WRONG if it does not accept them."""
        try:
            return self.kind(**values)
        except KbotError as error:
            message = str(error)
            words = re.findall(r"\w+", message)
            named = min((name for name in values if name in words), key=words.index, default="")
            return (at / named if named else at).error(VALUE_WRONG, message)

    def schema(self) -> Schema:
        found: Schema = {"type": "object"}
        if self.may_be_empty:
            found["type"] = ["object", "null"]
        if self.summary:
            found["description"] = self.summary
        found["properties"] = {name: entry.schema() for name, entry in self.entries.items()}
        required = [name for name, entry in self.entries.items() if entry.is_required]
        if required:
            found["required"] = required
        found["additionalProperties"] = False
        if not self.short:
            return found
        summary = {"description": self.summary} if self.summary else {}
        return {**summary, "anyOf": [self.entries[self.short].format.schema(), found]}


def record(
    kind: type,
    formats: Mapping[str, Format] | None = None,
    *,
    short: str = "",
    without: Iterable[str] = (),
    make: Callable[..., object] | None = None,
) -> Record:
    """The format of a dataclass.

    `formats` replaces those of some fields. `without` leaves fields out. `make` is called instead of `kind`.
    """
    hints = typing.get_type_hints(kind)
    texts = field_texts(kind)
    entries = {}
    for each in dataclasses.fields(kind):
        if each.name in without:
            continue
        default = REQUIRED if each.default is MISSING else each.default
        if each.default_factory is not MISSING:
            default = each.default_factory()
        chosen = (formats or {}).get(each.name) or format_of(hints[each.name])
        entries[each.name] = Entry(chosen, texts.get(each.name, ""), default)
    return Record(make or kind, entries, summary_of(kind), short)


def format_of(hint: Any) -> Format:  # noqa: ANN401 - a type hint
    """The format of a type."""
    simple: dict[object, Format] = {float: Number(), int: Integer(), bool: Flag(), str: Text()}
    if hint in simple:
        return simple[hint]
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        (inner,) = (each for each in arguments if each is not types.NoneType)
        return Nullable(format_of(inner))
    if origin is tuple:
        return Vector3() if arguments == (float, float, float) else ListOf(format_of(arguments[0]))
    if origin is not None and issubclass(origin, Mapping):
        return MapOf(AsWritten() if arguments[1] is str else format_of(arguments[1]))
    return record(hint)


def summary_of(kind: object) -> str:
    """The first paragraph of a docstring, in one line."""
    return " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split())


def field_texts(kind: object) -> dict[str, str]:
    """The texts of fields in a docstring, which lists them as `name   text`."""
    texts: dict[str, str] = {}
    name = ""
    for line in (inspect.getdoc(kind) or "").splitlines():
        if match := re.fullmatch(r"(\w+) {2,}(\S.*)", line):
            name = match[1]
            texts[name] = match[2]
        elif name and line.startswith("  "):
            texts[name] += f" {line.strip()}"
        else:
            name = ""
    return texts


def unit_in(text: str) -> str:
    """The unit that the text of a field names, as `speed forwards in m/s`. Empty if it names none."""
    match = _UNIT.search(text)
    return match[1] if match else ""


def _is_fine(values: Iterable[object]) -> bool:
    return all(value is not WRONG for value in values)


def _is_plain(value: object) -> bool:
    """Whether a default can be written in JSON and is not empty."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, tuple):
        return bool(value) and all(map(_is_plain, value))
    return isinstance(value, bool | int | str) and value != ""


def _kind_of(value: object) -> str:
    if value is None:
        return "empty"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}" if value else "an empty list"
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 40 else f"{text[:40]}…"
