"""`web/src/protocol.ts` from the dataclasses: `python -m kbot.workbench.typescript > web/src/protocol.ts`."""

from __future__ import annotations

import dataclasses
import sys
import types
import typing
from collections.abc import Iterator
from typing import Any, Literal, Union

from kbot.workbench import protocol

_PRIMITIVES = {float: "number", int: "number", str: "string", bool: "boolean", type(None): "null"}


def generate() -> str:
    """The whole TypeScript file, one interface for each dataclass."""
    seen: dict[type, None] = {}
    for union in (protocol.FromServer, protocol.FromPage):
        for message in typing.get_args(union):
            _collect(message, seen)
    parts = ["// Generated from src/kbot/workbench/protocol.py; do not edit.\n"]
    parts += [_interface(cls) for cls in seen]
    for name in ("FromServer", "FromPage"):
        members = " | ".join(cls.__name__ for cls in typing.get_args(getattr(protocol, name)))
        parts.append(f"export type {name} = {members};\n")
    return "\n".join(parts)


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


def _interface(cls: type) -> str:
    doc = " ".join((cls.__doc__ or "").split())
    comment = "" if doc.startswith(f"{cls.__name__}(") else f"/** {doc} */\n"
    fields = "".join(f"  {name}: {_name(hint)};\n" for name, hint in typing.get_type_hints(cls).items())
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
    if origin in (Union, types.UnionType):
        return " | ".join(_name(arg) for arg in args)
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return hint.__name__
    raise TypeError(f"no TypeScript for {hint}")


if __name__ == "__main__":
    sys.stdout.write(generate())
