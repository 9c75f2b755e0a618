"""Encode messages to pages, and decode messages from pages after checking size, type and range."""

from __future__ import annotations

import dataclasses
import functools
import json
import typing
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union

from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.text.suggest import did_you_mean
from kbot.workbench.protocol import Bounds, Bytes, FromPage, FromServer, Length


def encode(message: FromServer) -> str:
    """Return one message as compact JSON."""
    return json.dumps(message, separators=(",", ":"), allow_nan=False, default=_as_object)


def _as_object(message: Any) -> dict[str, object]:  # noqa: ANN401 - a dataclass of the protocol
    """The fields of a dataclass. `dataclasses.asdict` would copy them, which takes longer than encoding."""
    return {name: getattr(message, name) for name in _field_names(message.__class__)}


@functools.cache
def _field_names(cls: type) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(cls))


MAX_MESSAGE = 64 * 1024
"""Characters of a message from a page."""
MAX_TEXT_MESSAGE = 7 * 1024 * 1024
"""Bytes of a message with the text of files. JSON needs up to six for each byte of `MOST_TEXTS` and of the
names of twenty files, as for a control character."""
MOST_LEVELS = 20
"""How deep objects and lists may be nested."""

_MESSAGES: dict[str, type] = {
    typing.get_args(typing.get_type_hints(cls)["type"])[0]: cls for cls in typing.get_args(FromPage)
}


_WITH_TEXT = frozenset({"check_texts", "save_source"})


class BadMessage(KbotError):
    """A malformed message from a page. Its text says what is wrong."""


def decode(data: str | bytes) -> FromPage:
    """Return the message in a WebSocket frame.

    Raises:
        BadMessage: not JSON, an unknown type, a missing or unknown field, or a value of the wrong type or
            range.
    """
    if not isinstance(data, str):
        raise BadMessage("binary message: messages must be JSON text")
    if len(data) > MAX_TEXT_MESSAGE:
        raise BadMessage(f"message of {len(data)} characters: the limit is {MAX_TEXT_MESSAGE}")
    try:
        value = parse_json(data)
    except ValueError:
        raise BadMessage("the message is not JSON") from None
    if not isinstance(value, dict):
        raise BadMessage("the message is not a JSON object")
    kind = value.pop("type", None)
    if not isinstance(kind, str) or kind not in _MESSAGES:
        hint = did_you_mean(kind, _MESSAGES) if isinstance(kind, str) and len(kind) < 64 else ""
        raise BadMessage(f"unknown message type {_short(kind)}{': ' + hint if hint else ''}")
    if len(data) > MAX_MESSAGE and kind not in _WITH_TEXT:
        raise BadMessage(f"{kind} of {len(data)} characters: the limit is {MAX_MESSAGE}")
    cls = _MESSAGES[kind]
    hints = _fields(cls)
    for name in value:
        if name not in hints:
            raise BadMessage(f"{kind}: unknown field {_short(name)}")
    for name, hint in hints.items():
        if name not in value:
            raise BadMessage(f"{kind}: the field '{name}' is missing")
        value[name] = _check(value[name], hint, f"{kind}.{name}")
    return typing.cast(FromPage, cls(**value))


@functools.cache
def _fields(cls: type) -> dict[str, Any]:
    hints = typing.get_type_hints(cls, include_extras=True)
    return {f.name: hints[f.name] for f in dataclasses.fields(cls) if f.name != "type"}


def _check(value: object, hint: Any, where: str) -> object:  # noqa: ANN401 - a type hint
    bound: Bounds | Bytes | Length | None = None
    if typing.get_origin(hint) in (Union, UnionType):
        if value is None:
            return None
        (hint,) = (option for option in typing.get_args(hint) if option is not NoneType)
    if typing.get_origin(hint) is Annotated:
        hint, bound = typing.get_args(hint)
    if typing.get_origin(hint) is Literal:
        allowed = typing.get_args(hint)
        if not isinstance(value, str) or value not in allowed:
            raise BadMessage(f"{where} is {_short(value)}, not one of {', '.join(allowed)}")
        return value
    if hint is float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise BadMessage(f"{where} is {_short(value)}, not a number")
        if isinstance(bound, Bounds) and not bound.low <= value <= bound.high:
            raise BadMessage(f"{where} is {_short(value)}, not between {bound.low:g} and {bound.high:g}")
        return float(value)
    if hint is bool:
        if not isinstance(value, bool):
            raise BadMessage(f"{where} is {_short(value)}, not true or false")
        return value
    if typing.get_origin(hint) is tuple:
        if not isinstance(value, list):
            raise BadMessage(f"{where} is {_short(value)}, not a list")
        if isinstance(bound, Length) and len(value) > bound.most:
            raise BadMessage(f"{where} has {len(value)} entries: the limit is {bound.most}")
        item_hint = typing.get_args(hint)[0]
        return tuple(_check(item, item_hint, f"{where}.{n}") for n, item in enumerate(value))
    if typing.get_origin(hint) is dict:
        if not isinstance(value, dict):
            raise BadMessage(f"{where} is {_short(value)}, not a JSON object")
        if _is_deeper(value, MOST_LEVELS):
            raise BadMessage(f"{where} is nested more than {MOST_LEVELS} levels deep")
        return value
    if hint is str:
        if not isinstance(value, str):
            raise BadMessage(f"{where} is {_short(value)}, not a string")
        if isinstance(bound, Length) and len(value) > bound.most:
            raise BadMessage(f"{where} has {len(value)} characters: the limit is {bound.most}")
        if isinstance(bound, Bytes) and (size := len(value.encode("utf-8", "surrogatepass"))) > bound.most:
            raise BadMessage(f"{where} has {size} bytes: the limit is {bound.most}")
        return value
    raise TypeError(f"no check for {hint}")


def _is_deeper(value: object, levels: int) -> bool:
    if not isinstance(value, dict | list):
        return False
    return levels == 0 or any(
        _is_deeper(part, levels - 1) for part in (value.values() if isinstance(value, dict) else value)
    )


def _short(value: object) -> str:
    try:
        text = json.dumps(value)
    except (ValueError, OverflowError, RecursionError):
        text = type(value).__name__
    return text if len(text) <= 60 else text[:57] + "…"
