"""Reads YAML with xacro's units for `xacro.load_yaml`, and caches it."""

from __future__ import annotations

import math
import re

from kbot.xacro.values import Value, wrap
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from kbot.text.span import Source
    from kbot.xacro.budget import Budget

UNITS = {
    "!radians": 1.0,
    "!degrees": math.pi / 180.0,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}
_MAX_NODES = 500_000
"""Values in a file, with each alias counted as the values it stands for."""
_NODE_STEPS = 8
"""Steps charged for a node that PyYAML's own loader reads. A node can be two characters long."""
_RESOLVED_STEPS = 64
"""Steps charged for a scalar that PyYAML's own rules resolve."""

_cache: dict[str, tuple[str, Any, int]] = {}  # Any: YAML data
"""By path: the file's text, its data, and the number of its values."""


def clear_cache() -> None:
    """Forget all files."""
    _cache.clear()


def load(source: Source, evaluate: Callable[[str], Value], budget: Budget) -> Value:
    """The data of a YAML file. `evaluate` computes the expressions after units.

    Raises:
        XacroError: X116, the file is not valid YAML; X190, reading it takes too much work.
    """
    from kbot.text.yaml import YamlError  # imported lazily: clear_cache imports this module

    budget.charge(len(source.text))  # also for cached data, which is copied
    known = _cache.get(source.path)
    if known is not None and known[0] == source.text:
        budget.charge(known[2])
        return wrap(_copied(known[1]))
    try:
        try:
            data = _plain_data(source.text, evaluate, budget)
        except _NotPlain:
            data = _any_data(source, evaluate, budget)
    except YamlError as error:
        raise XacroError("X116", f"{error.span} is not valid YAML: {error.problem}") from None
    size = _size(data)
    if size is None:
        raise XacroError("X190", f"{source.path} contains too much data, or data that contains itself")
    budget.charge(size)
    _cache[source.path] = (source.text, data, size)
    return wrap(_copied(data))


class _NotPlain(Exception):
    """The text uses features of YAML that `_plain_data` does not read."""


def _plain_data(text: str, evaluate: Callable[[str], Value], budget: Budget) -> Value:
    """The data of a text of plain mappings, lists and scalars, as in nearly every parameter file.

    It is built from the parser's events, in half the time that building nodes takes.
    """
    import yaml

    from kbot.text.yaml import CONSTRUCTION_ERRORS

    parser_class = getattr(yaml.cyaml, "CParser", None) if yaml.__with_libyaml__ else None
    if parser_class is None:
        raise _NotPlain
    parser = parser_class(text)
    try:
        return _build(parser.get_event, yaml, evaluate, budget)
    except (yaml.YAMLError, *CONSTRUCTION_ERRORS):
        raise _NotPlain from None  # `_any_data` reports the error with its place
    finally:
        parser.dispose()


def _build(
    next_event: Callable[[], Any], yaml: Value, evaluate: Callable[[str], Value], budget: Budget
) -> Value:
    from kbot.text.yaml import MOST_LEVELS, OWN_HASH

    documents: list[Any] = []
    current: Any = documents
    key: Any = None
    waiting = False
    outer: list[tuple[Any, Any]] = []
    scalar_event, end_events = yaml.ScalarEvent, (yaml.MappingEndEvent, yaml.SequenceEndEvent)
    starts = {yaml.MappingStartEvent: dict, yaml.SequenceStartEvent: list}
    while True:
        event = next_event()
        kind = type(event)
        if kind is scalar_event:
            value = _scalar(event, evaluate, budget)
        elif kind in starts:
            if event.anchor or event.tag:
                raise _NotPlain
            if type(current) is dict and not waiting:
                raise _NotPlain
            value = starts[kind]()
            outer.append((current, key))
            if len(outer) > MOST_LEVELS:
                raise _NotPlain  # `_any_data` reports it
        elif kind in end_events:
            current, key = outer.pop()
            waiting = False
            continue
        elif kind is yaml.StreamEndEvent:
            return documents[0] if documents else None
        elif kind is yaml.AliasEvent or (kind is yaml.DocumentStartEvent and documents):
            raise _NotPlain
        else:
            continue
        if type(current) is dict:
            if not waiting:
                if type(value) is int and abs(value) >= OWN_HASH:
                    raise _NotPlain  # `_any_data` limits the number of such keys
                key, waiting = value, True
                continue
            current[key] = value
            waiting = False
        else:
            current.append(value)
        if kind is not scalar_event:
            current, waiting = value, False


_INTEGER = re.compile(r"-?(?:0|[1-9][0-9]*)\Z")
_REAL = re.compile(r"-?[0-9]+\.[0-9]*(?:[eE][-+][0-9]+)?\Z")
_WORD = re.compile(r"[A-Za-z_/.][\w ./${}()-]*\Z", re.ASCII)
_TRUE, _FALSE, _NOTHING = ("yes", "true", "on"), ("no", "false", "off"), ("null",)
_WORDS: dict[str, bool | None] = {
    spelling: value
    for words, value in ((_TRUE, True), (_FALSE, False), (_NOTHING, None))
    for word in words
    for spelling in (word, word.capitalize(), word.upper())
} | {"~": None, "": None}


def _scalar(event: Value, evaluate: Callable[[str], Value], budget: Budget) -> Value:
    text: str = event.value
    if event.anchor:
        raise _NotPlain
    if event.tag:
        factor = UNITS.get(event.tag)
        if factor is None:
            raise _NotPlain
        return float(evaluate(text)) * factor
    if not event.implicit[0]:
        return text
    if _REAL.match(text):
        return float(text)
    if _INTEGER.match(text):
        return int(text)
    if text in _WORDS:
        return _WORDS[text]
    if _WORD.match(text) and text[0] != ".":
        return text
    budget.charge(_RESOLVED_STEPS)
    return _resolved(text)


def _resolved(text: str) -> Value:
    """The value of a plain scalar by all rules of YAML 1.1."""
    import yaml

    from kbot.text.yaml import LONGEST

    if text in ("<<", "=") or len(text) > LONGEST or "\n" in text or "#" in text or ": " in text:
        raise _NotPlain
    return yaml.safe_load(f"- {text}")[0]


def _any_data(source: Source, evaluate: Callable[[str], Value], budget: Budget) -> Value:
    """The data of any YAML text, read by PyYAML's own loader. Raises YamlError."""
    from kbot.text.yaml import Dialect, read_yaml

    def unit(factor: float) -> Callable[[str], float]:
        return lambda text: float(evaluate(text)) * factor

    budget.charge(len(source.text) // 2 * _NODE_STEPS)
    dialect = Dialect({tag: unit(factor) for tag, factor in UNITS.items()})
    return read_yaml(source, dialect, charge=budget.charge).data


def _size(data: Value) -> int | None:
    """The number of values, with aliases counted at each use. None if there are too many."""
    size, level = 1, [data]
    for _ in range(100):
        following: list[Any] = []
        for item in level:
            if isinstance(item, dict | list | tuple | set):
                size += len(item)
                if size > _MAX_NODES:  # before listing them: there may be many long lists
                    return None
                following += item.values() if isinstance(item, dict) else item
        if not following:
            return size
        level = following
    return None


def _copied(data: Value) -> Value:
    """A copy, so that callers cannot change the cached data."""
    if type(data) is dict:
        return {key: _copied(value) if type(value) in (dict, list) else value for key, value in data.items()}
    if type(data) is list:
        return [_copied(item) if type(item) in (dict, list) else item for item in data]
    return data
