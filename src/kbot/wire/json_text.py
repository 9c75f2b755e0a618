"""Messages as JSON, by a form that is made once for each type; in it only the values are left open."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator, Sequence
from functools import cache, lru_cache
from math import isfinite
from operator import attrgetter
from typing import Any, get_args, get_origin, get_type_hints

from kbot.messages.types import Time
from kbot.text import KbotError
from kbot.wire.plain import ROS1_TIME, to_plain

Spell = Callable[[Any], object]
"""From a value to what `str` makes JSON of."""


def json_text(message: object, *, ros1: bool = False, exact: bool = False) -> str:
    """The JSON of what `to_plain` makes of a message. Raises KbotError: a field is not of its type."""
    kind: type = type(message)
    try:
        return _form(kind, ros1, exact)(message)
    except (TypeError, ValueError, AttributeError) as error:
        raise KbotError(f"no {kind.__name__}: {error}") from None


@cache
def _form(kind: type, ros1: bool, exact: bool) -> Callable[[Any], str]:
    text, paths, spells = "", list[str](), list[Spell]()
    for part in _parts(kind, "", ros1, exact):
        if isinstance(part, str):
            text += part
        else:
            text += "%s"
            paths.append(part[0])
            spells.append(part[1])
    if not paths:
        return lambda message: text
    if len(paths) == 1:
        only, spell = attrgetter(*paths), spells[0]
        return lambda message: text % spell(only(message))
    get = attrgetter(*paths)

    def fill(message: object) -> str:
        return text % tuple([spell(value) for spell, value in zip(spells, get(message), strict=True)])

    return fill


def _parts(kind: type, path: str, ros1: bool, exact: bool) -> Iterator[str | tuple[str, Spell]]:
    """What is the same for all messages, and between it where a value is found and how it is spelled."""
    hints = get_type_hints(kind)
    names = {ours: theirs for theirs, ours in ROS1_TIME.items()} if ros1 and kind is Time else {}
    before = "{"
    for field in dataclasses.fields(kind):
        hint, here = hints[field.name], path + field.name
        yield f'{before}"{names.get(field.name, field.name)}": '
        if dataclasses.is_dataclass(hint) and isinstance(hint, type):
            yield from _parts(hint, f"{here}.", ros1, exact)
        else:
            yield here, _spell(hint, ros1, exact)
        before = ", "
    yield "}" if before == ", " else "{}"


def _spell(hint: object, ros1: bool, exact: bool) -> Spell:
    if hint is float:
        return lambda value: _number(value, exact)
    if hint is int:
        return str
    if hint is str:
        return _quoted
    if get_origin(hint) is tuple:
        item = get_args(hint)[0]
        if item is float:
            return lambda values: _numbers(values, exact)
        if dataclasses.is_dataclass(item) and isinstance(item, type):
            form = _form(item, ros1, exact)
            return lambda items: f"[{', '.join(map(form, items))}]"
    if getattr(get_origin(hint), "__name__", "") == "ndarray":
        return lambda array: (
            _numbers(array.tolist(), exact)
            if array.ndim == 1 and array.dtype.kind == "f"
            else json.dumps(to_plain(array, ros1=ros1, exact=exact))
        )
    return lambda value: json.dumps(to_plain(value, ros1=ros1, exact=exact))


_quoted = lru_cache(1000)(json.dumps)


def _number(value: float, exact: bool) -> object:
    return value if isfinite(value) else _lacking(float.__repr__(value), exact)


def _numbers(values: Sequence[float], exact: bool) -> str:
    try:
        text = ", ".join(map(float.__repr__, values))
    except TypeError:  # whole numbers among them
        text = ", ".join(map(repr, map(float, values)))
    return f"[{_lacking(text, exact) if 'n' in text else text}]"


def _lacking(text: str, exact: bool) -> str:
    """With another word for numbers that JSON lacks: Python's own there, or null."""
    if exact:
        return text.replace("nan", "NaN").replace("inf", "Infinity")
    return text.replace("nan", "null").replace("-inf", "null").replace("inf", "null")
