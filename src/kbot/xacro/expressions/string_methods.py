"""Methods of texts that could make a text far longer than what they are given."""

from __future__ import annotations

import re

from kbot.xacro.budget import Budget
from kbot.xacro.values import Value, attribute

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


def _format(budget: Budget, owner: str, args: list[Value], named: dict[str, Value]) -> str:
    import string

    class Formatter(string.Formatter):
        def get_field(self, field_name: str, args: Value, kwargs: Value) -> Value:
            first, _, _ = field_name.partition(".")
            first = first.partition("[")[0]
            value = self.get_value(int(first) if first.isdigit() else first, args, kwargs)
            for is_attribute, name in _field_path(field_name[len(first) :]):
                if is_attribute:
                    value = attribute(value, name)
                else:
                    value = value[int(name) if name.isdigit() else name]
            return value, first

        def format_field(self, value: Value, format_spec: str) -> str:
            return format_value(budget, value, format_spec)

    for value in (*args, *named.values()):
        budget.weigh(value)
    return Formatter().vformat(owner, args, named)


def _field_path(path: str) -> list[tuple[bool, str]]:
    parts = re.findall(r"\.([^.\[]+)|\[([^\]]+)\]", path)
    return [(bool(name), name or index) for name, index in parts]


def format_value(budget: Budget, value: Value, spec: str) -> str:
    """`format(value, spec)`."""
    budget.widths(spec, ())
    budget.weigh(value)
    return budget.checked(format(value, spec))  # type: ignore[no-any-return]  # checked gives back what it is given


def _padded(name: str) -> Callable[[Budget, Any, list[Value], dict[str, Value]], Any]:
    def padded(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
        widths = [v for v in (*args, *named.values()) if isinstance(v, int)]
        width = max(map(abs, widths), default=8)
        budget.length(
            width * (owner.count("\t" if isinstance(owner, str) else b"\t") + 1)
            if name == "expandtabs"
            else width
        )
        return getattr(owner, name)(*args, **named)

    return padded


def _replace(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if len(args) >= 2 and all(isinstance(a, str | bytes) for a in args[:2]):
        budget.length(len(owner) + (owner.count(args[0]) * len(args[1])))
    return owner.replace(*args, **named)


def _join(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if len(args) == 1 and not isinstance(args[0], str | bytes):
        items = list(args[0])
        budget.charge(len(items))
        budget.length(sum(len(i) for i in items if isinstance(i, str | bytes)) + len(owner) * len(items))
        args = [items]
    return owner.join(*args, **named)


def _translate(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if args and isinstance(args[0], dict):
        longest = max((len(v) for v in args[0].values() if isinstance(v, str)), default=1)
        budget.length(len(owner) * max(longest, 1))
    return owner.translate(*args, **named)


def _format_map(budget: Budget, owner: str, args: list[Value], named: dict[str, Value]) -> str:
    return _format(budget, owner, [], dict(args[0]))


TEXT_METHODS: dict[str, Callable[[Budget, Any, list[Value], dict[str, Value]], Any]] = {
    "format": _format,
    "format_map": _format_map,
    "replace": _replace,
    "join": _join,
    "translate": _translate,
    **{name: _padded(name) for name in ("ljust", "rjust", "center", "zfill", "expandtabs")},
}
