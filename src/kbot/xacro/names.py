"""The names that expressions can use: `math`, `python`, `xacro`, and those without a prefix."""

from __future__ import annotations

import math
import re

from kbot.xacro.values import Value, YamlDict, attribute
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from kbot.xacro.run import Run

    Evaluate = Callable[[str], Value]

_DIRECT: dict[str, Any] = {  # Any: functions and classes of Python
    kind.__name__: kind for kind in (list, dict, map, len, str, float, int, bool, min, max, round)
} | {"True": True, "False": False}
_PYTHON: dict[str, Any] = _DIRECT | {
    function.__name__: function
    for function in (
        abs, all, any, complex, divmod, enumerate, filter, frozenset, hash, isinstance, issubclass, ord,
        range, repr, reversed, slice, set, sorted, sum, tuple, type, vars, zip,
    )
}  # fmt: skip
_MATH: dict[str, Any] = {name: value for name, value in vars(math).items() if not name.startswith("_")}
_DEPRECATED = {
    "sorted": "python", "range": "python", "load_yaml": "xacro", "abs_filename": "xacro", "dotify": "xacro",
}  # fmt: skip


class Names:
    """A namespace with fixed names, such as `math` in `math.pi`."""

    __slots__ = ("name", "table")

    def __init__(self, name: str, table: dict[str, Value]) -> None:
        self.name = name
        self.table = table

    def __repr__(self) -> str:
        return f"<namespace {self.name}>"

    def __contains__(self, name: object) -> bool:
        return name in self.table

    def __getitem__(self, name: str) -> Value:
        return self.xacro_attribute(name)

    def xacro_attribute(self, name: str) -> Value:
        try:
            return self.table[name]
        except (KeyError, TypeError):
            error = AttributeError(f"name '{name}' is not defined in {self.name}")
            raise error from None

    @property
    def names(self) -> list[str]:
        return sorted(self.table)


_MATH_NAMES = Names("math", _MATH)
_PYTHON_NAMES = Names("python", _PYTHON)
KNOWN = frozenset([*_DIRECT, *_MATH, *_DEPRECATED, "math", "python", "xacro"])
"""Built-in names. A property with such a name hides it, which causes a warning."""


def tokenize(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    """Split a text at any of the characters in `sep`.

    Raises:
        ValueError: `sep` is not made of `a`, `a-z`, `^a`, `\\t`.
    """
    if "]" in sep:  # it would end the character set and begin a pattern of unbounded cost
        raise ValueError(f"{sep!r} is not a set of characters to split at")
    import warnings  # rarely needed: start-up time

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            parts = re.split(f"[{sep}]", text)
        except re.error as error:
            raise ValueError(f"{sep!r} is not a set of characters to split at: {error}") from None
    return [part for part in parts if part] if skip_empty else parts


def has_attribute(value: Value, name: str) -> bool:
    """Whether `value` has the attribute `name`."""
    try:
        attribute(value, name)
    except AttributeError:
        return False
    return True


GLOBAL: dict[str, Value] = {**_DIRECT, **_MATH, "math": _MATH_NAMES, "python": _PYTHON_NAMES}
"""The meaning of built-in names, except those that depend on the run."""


def run_name(run: Run, name: str, constant: Evaluate) -> Value:
    """The meaning of a built-in name that depends on the run. `constant` evaluates expressions in YAML.

    Raises:
        KeyError: there is no such name.
    """
    if name == "xacro":
        return _xacro(run, constant)
    if name in FALLBACK:
        return FALLBACK[name]
    space = _DEPRECATED[name]
    return _deprecated(
        run, name, space, (_PYTHON if space == "python" else _xacro(run, constant).table)[name]
    )


def _xacro(run: Run, constant: Evaluate) -> Names:
    return Names(
        "xacro",
        {
            "load_yaml": lambda filename: run.load_yaml(filename, constant),
            "abs_filename": run.absolute,
            "dotify": YamlDict,
            "arg": run.argument,
            "tokenize": tokenize,
            "fatal": lambda *args: _fatal(run.budget.text, *args),
            "message": _message_function(run, "message"),
            "warning": _message_function(run, "warning"),
            "error": _message_function(run, "error"),
            "print_location": _locator(run),
        },
    )


FUNCTIONS = frozenset([*_DEPRECATED, *(name for name, value in GLOBAL.items() if callable(value))])
"""Names of functions. They are suggested only for unknown functions, never for unknown properties."""

FALLBACK: dict[str, Value] = {"hasattr": has_attribute}
"""Names that xacro's documentation mentions but the official implementation does not define."""


def _deprecated(run: Run, name: str, space: str, function: Callable[..., Value]) -> Callable[..., Value]:
    def call(*args: Value, **named: Value) -> Value:
        run.warn("X202", f"{name}() without a prefix is deprecated", hint=f"write {space}.{name}()")
        from kbot.xacro.expressions.functions import call as bounded  # cycle: costs imports this module

        return bounded(run.budget, function, list(args), named)

    return call


def _fatal(text: Callable[[Value], str], *args: Value) -> Value:
    raise XacroError("X118", " ".join(map(text, args)) or "xacro.fatal() was called")


def _message_function(run: Run, kind: str) -> Callable[..., str]:
    def send(*args: Value, **_: Value) -> str:
        if not args:
            raise XacroError("X104", f"xacro.{kind} needs a text")
        text = " ".join([run.budget.text(arg) for arg in args])
        run.add_message(kind, text if text.strip() else f"xacro.{kind} with an empty text")
        return ""

    return send


def _locator(run: Run) -> Callable[..., str]:
    def locate(*_: Value, **__: Value) -> str:
        run.add_message("message", run.location())
        return ""

    return locate
