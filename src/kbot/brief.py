"""How public objects appear in a Python prompt: `repr` in one line, and `dir` without private names."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from reprlib import recursive_repr

_LONGEST = 100
"""Characters of a value inside a `repr`. A longer one is cut: a prompt is about 100 characters wide."""
_MOST = 4
"""Most items of a collection that are shown. Otherwise, only their number is shown."""


class Brief:
    """An object with a `repr` of one line, and a `dir` that lists what a user may use."""

    __slots__ = ()

    def __repr__(self) -> str:
        try:
            return f"{type(self).__name__}({', '.join(self._shown())})"
        except Exception:  # noqa: BLE001 - a debugger shows half-made objects, and values may have a broken repr
            return object.__repr__(self)

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not name.startswith("_")]

    def _shown(self) -> Iterator[str]:
        """What the `repr` contains: by default, the arguments of the constructor that differ from their
        defaults."""
        return shown_arguments(self)


def shown_arguments(thing: object) -> Iterator[str]:
    """`name=value` for each argument of the constructor that the object has as an attribute, with or without
    an underscore, if it differs from its default."""
    from inspect import signature  # imported lazily, for start-up time

    fields = getattr(thing, "__dataclass_fields__", {})
    for name, parameter in signature(type(thing)).parameters.items():
        value = getattr(thing, name, getattr(thing, f"_{name}", parameter.empty))
        if value is parameter.empty or (name in fields and not fields[name].repr):
            continue
        default = parameter.default
        if name in fields and callable(fields[name].default_factory):
            default = fields[name].default_factory()
        if not _equal(value, default):
            yield f"{name}={brief(value)}"


@recursive_repr("…")
def brief(value: object) -> str:
    """A value in one line: a number with 6 digits, a long text cut, an array or a collection by its size.

    A value inside itself is `…`.
    """
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, str):
        return repr(str(value) if len(value) <= _LONGEST else f"{value[: _LONGEST - 1]}…")
    if isinstance(value, bytes | bytearray | memoryview):
        return f"<{len(value)} bytes>"
    shape = _shape(value)
    if shape is not None:
        return f"<{'x'.join(map(str, shape))} {getattr(value, 'dtype', '')}>" if shape else f"{value}"
    if isinstance(value, tuple | list | set | frozenset | Mapping):
        return _collection(value)
    if hasattr(value, "__dataclass_fields__") and not isinstance(value, type | Brief):
        text = f"{type(value).__name__}({', '.join(_fields(value))})"
    elif callable(value) and hasattr(value, "__name__"):
        text = value.__name__
    elif type(value).__repr__ is object.__repr__:
        text = f"<{type(value).__name__}>"
    else:
        text = repr(value)
    return text if len(text) <= 2 * _LONGEST and "\n" not in text else f"{type(value).__name__}(…)"


def counted(number: int, what: str, plural: str = "") -> str:
    """`1 link`, `2 links`."""
    return f"{number} {what if number == 1 else plural or f'{what}s'}"


def _collection(values: Collection[object]) -> str:
    if len(values) <= _MOST:
        shown = list(map(brief, values))
        if isinstance(values, Mapping):
            shown = [f"{key}: {brief(value)}" for key, value in zip(shown, values.values(), strict=True)]
        begin, end = "[]" if isinstance(values, list) else "()" if isinstance(values, tuple) else "{}"
        comma = "," if isinstance(values, tuple) and len(values) == 1 else ""
        text = f"{begin}{', '.join(shown)}{comma}{end}"
        if len(text) <= _LONGEST:
            return text
    return f"<{counted(len(values), 'item')}>"


def _fields(thing: object) -> Iterator[str]:
    """The fields of a dataclass inside another object, without the place where it was written."""
    for name, field in thing.__dataclass_fields__.items():  # type: ignore[attr-defined]  # brief has tested it
        if field.repr and name != "origin":
            yield f"{name}={brief(getattr(thing, name))}"


def _shape(value: object) -> tuple[int, ...] | None:
    """The shape of an array of numpy, which this module does not import. None for other values."""
    shape = getattr(value, "shape", None)
    return shape if isinstance(shape, tuple) and hasattr(value, "dtype") else None


def _equal(value: object, default: object) -> bool:
    shape = _shape(value)
    if shape:
        return shape == (0,) == _shape(default)
    try:
        return bool(value == default)
    except Exception:  # noqa: BLE001 - arrays inside, or the user's class cannot be compared
        return False
