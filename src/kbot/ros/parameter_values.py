"""Parses parameter values: from attributes, and from YAML as `rosparam` reads it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from kbot.text.yaml import Dialect, load_yaml

ParameterValue = bool | int | float | str | bytes | list[Any] | dict[str, Any] | None  # Any: what YAML holds
"""The value of a parameter; None means not set. The elements of a ROS 2 list have one type. ROS 1 accepts any
YAML value."""
TYPES = ("auto", "str", "string", "int", "double", "bool", "boolean", "yaml")
_ANGLE = re.compile(r"(rad|deg)?\(?([^()]*)\)?")
_FACTOR = re.compile(r"[+-]?(?:\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+|pi)")


def convert(text: str, type_: str) -> ParameterValue:
    """Convert a text to a type, which is one of TYPES.

    Raises:
        ValueError: the text is not a value of that type. The message gives the reason.
    """
    match type_:
        case "auto":
            return _guessed(text)
        case "str" | "string":
            return text
        case "int":
            return int(text)
        case "double":
            return float(text)
        case "bool" | "boolean":
            word = text.lower().strip()
            if word not in ("true", "1", "false", "0"):
                raise ValueError(f"'{text}' is neither true nor false")
            return word in ("true", "1")
        case "yaml":
            value: ParameterValue = load_yaml(text, ROSPARAM)
            return value
    raise ValueError(f"unknown parameter type '{type_}'; use one of: {', '.join(TYPES)}")


def dump_yaml(parameters: Mapping[str, ParameterValue], namespace: str) -> str:
    """The parameters below a namespace as a YAML tree, in the format of `rosparam dump`."""
    import yaml  # imported lazily, for a fast start-up

    tree: dict[str, Any] = {}
    base = namespace.strip("/")
    for name, value in parameters.items():
        parts = name.strip("/").removeprefix(base).strip("/").split("/")
        if base and not f"{name.strip('/')}/".startswith(f"{base}/"):
            continue
        folder = tree
        for part in parts[:-1]:
            if not isinstance(folder.get(part), dict):
                folder[part] = {}
            folder = folder[part]
        folder[parts[-1]] = value
    return str(yaml.safe_dump(tree))


def _guessed(text: str) -> bool | int | float | str:
    """The value that roslaunch makes of a text without a type. `1_000` is a text, although Python reads a
    number."""
    try:
        if "." in text:
            return float(text)
        if "_" not in text:
            return int(text)
    except ValueError:
        pass
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    return text


def _angle(text: str, unit: float) -> float:
    """An angle in radians, from products and quotients of numbers and `pi`. `unit` is the radians of one
    unit."""
    match = _ANGLE.fullmatch(text.strip())
    if not match:
        raise ValueError(f"'{text}' is not an angle")
    sign, value, operator = 1.0, 1.0, "*"
    body = match[2].strip()
    if body.startswith("-"):
        sign, body = -1.0, body[1:]
    for piece in re.split(r"([*/])", body):
        if piece in "*/" and piece:
            operator = piece
            continue
        factor = _FACTOR.fullmatch(piece.strip())
        if not factor:
            raise ValueError(f"'{text}' is not an angle")
        number = math.pi if factor[0] == "pi" else float(factor[0])
        if operator == "/" and number == 0:
            raise ValueError(f"'{text}' divides by zero")
        value = value * number if operator == "*" else value / number
    return sign * value * unit


ROSPARAM = Dialect(
    {
        "!radians": lambda text: _angle(text, 1.0),
        "!degrees": lambda text: _angle(text, math.pi / 180),
    },
    {"!degrees": re.compile(r"^deg\([^)]*\)$"), "!radians": re.compile(r"^rad\([^)]*\)$")},
)
"""YAML as rosparam reads it. Angles in `deg(…)` and `rad(…)` become radians."""
