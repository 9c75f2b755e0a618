"""Generate the page's TypeScript types and tables from Python.

`python -m kbot.workbench.typescript > web/src/protocol.ts` writes the page's messages. The argument
`messages` writes the messages of topics for `web/src/messages.ts`, and `kinds` the displays for
`web/src/displays/kinds.ts`.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import typing
from collections.abc import Iterator
from types import UnionType
from typing import Any, Literal, Union

import numpy as np

from kbot.messages import control, navigation, sensing, types, visualization
from kbot.workbench import protocol
from kbot.workbench.displays import property
from kbot.workbench.displays.kinds import GLOBALS, KINDS

_PRIMITIVES = {
    float: "number",
    int: "number",
    str: "string",
    bool: "boolean",
    type(None): "null",
    bytes: "Uint8Array",
}


def generate() -> str:
    """Return the TypeScript of the protocol, with one interface for each dataclass."""
    seen: dict[type, None] = {}
    for union in (protocol.FromServer, protocol.FromPage):
        for message in typing.get_args(union):
            _collect(message, seen)
    parts = ["// Generated from src/kbot/workbench/protocol; do not edit.\n"]
    parts += [_interface(cls) for cls in seen]
    for name in ("FromServer", "FromPage"):
        members = " | ".join(cls.__name__ for cls in typing.get_args(getattr(protocol, name)))
        parts.append(f"export type {name} = {members};\n")
    return "\n".join(parts)


def generate_messages() -> str:
    """Return the types of topic messages, with arrays as they are in a binary frame."""
    parts = ["// Generated from src/kbot/messages; do not edit.\n"]
    for home in (types, sensing, navigation, control, visualization):
        own = (value for value in vars(home).values() if getattr(value, "__module__", "") == home.__name__)
        parts += [_interface(value) for value in own if isinstance(value, type)]
    return "\n".join(parts)


def generate_kinds() -> str:
    """Return the kinds of displays, as data."""
    parts = ["// Generated from src/kbot/workbench/displays; do not edit.\n"]
    parts += [_interface(cls, ("rviz",)) for cls in (property.Property, property.DisplayKind)]
    for name, kind, table in (("GLOBALS", "Property", GLOBALS), ("KINDS", "DisplayKind", KINDS)):
        rows = ",\n".join(f"  {json.dumps(_without_file_fields(dataclasses.asdict(row)))}" for row in table)
        parts.append(f"export const {name}: readonly {kind}[] = [\n{rows},\n];\n")
    return "\n".join(parts)


def _without_file_fields(row: Any) -> Any:  # noqa: ANN401 - rows of any class
    """Remove the fields that only display files need."""
    if isinstance(row, dict):
        return {name: _without_file_fields(value) for name, value in row.items() if name != "rviz"}
    return [_without_file_fields(item) for item in row] if isinstance(row, list | tuple) else row


def _collect(cls: type, seen: dict[type, None]) -> None:
    for hint in typing.get_type_hints(cls).values():
        for part in _dataclasses_in(hint):
            _collect(part, seen)
    seen[cls] = None


def _dataclasses_in(hint: object) -> Iterator[type]:
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        yield hint
    for part in typing.get_args(hint):
        yield from _dataclasses_in(part)


def _interface(cls: type, without: tuple[str, ...] = ()) -> str:
    doc = " ".join((cls.__doc__ or "").split())
    comment = "" if doc.startswith(f"{cls.__name__}(") else f"/** {doc} */\n"
    fields = "".join(
        f"  {name}: {_name(hint)};\n"
        for name, hint in typing.get_type_hints(cls).items()
        if name not in without
    )
    return f"{comment}export interface {cls.__name__} {{\n{fields}}}\n"


def _name(hint: Any) -> str:  # noqa: ANN401 - a type hint
    if hint in _PRIMITIVES:
        return _PRIMITIVES[hint]
    origin, args = typing.get_origin(hint), typing.get_args(hint)
    if origin is Literal:
        return " | ".join(f'"{value}"' for value in args)
    if origin is tuple:
        inner = _name(args[0])
        return f"readonly ({inner})[]" if " " in inner else f"readonly {inner}[]"
    if origin is np.ndarray:
        return f"{typing.get_args(args[1])[0].__name__.capitalize()}Array"
    if origin is dict:
        return "{ [name: string]: unknown }"
    if origin in (Union, UnionType):
        return " | ".join(_name(arg) for arg in args)
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return hint.__name__
    raise TypeError(f"no TypeScript for {hint}")


if __name__ == "__main__":
    made = {"": generate, "messages": generate_messages, "kinds": generate_kinds}
    sys.stdout.write(made["".join(sys.argv[1:])]())
