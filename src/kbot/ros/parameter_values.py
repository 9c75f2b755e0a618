"""Parses parameter values: from attributes, and from YAML as `rosparam` reads it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from kbot.text.yaml import Dialect, load_yaml

ParameterValue = bool | int | float | str | bytes | list[Any] | dict[str, Any] | None  # Any: what YAML holds
"""What a parameter holds; None is not set. ROS 2 has only lists of one type, ROS 1 has whatever YAML has."""
TYPES = ("auto", "str", "string", "int", "double", "bool", "boolean", "yaml")
_ANGLE = re.compile(r"(rad|deg)?\(?([^()]*)\)?")
_FACTOR = re.compile(r"[+-]?(?:\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+|pi)")


def convert(text: str, type_: str) -> ParameterValue:
    """The value a text stands for, by one of TYPES.

    Raises:
        ValueError: the text is no such value; its words say why.
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
    raise ValueError(f"'{type_}' is no type of parameter; it is one of {', '.join(TYPES)}")


def dump_yaml(parameters: Mapping[str, ParameterValue], namespace: str) -> str:
    """The parameters beneath a namespace as a tree, as `rosparam dump` writes them."""
    import yaml  # lazy in this module: start-up time

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
    """A product and quotient of numbers and `pi`, in radians."""
    match = _ANGLE.fullmatch(text.strip())
    if not match:
        raise ValueError(f"'{text}' is no angle")
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
            raise ValueError(f"'{text}' is no angle")
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
"""YAML as rosparam reads it: `deg(…)` and `rad(…)` are angles in radians."""
