"""Parameter values: from the text of an attribute, and from YAML as `rosparam` reads it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kbot.text.placed_yaml import yaml_loader
from kbot.text.yaml_text import NOT_MADE

TYPES = ("auto", "str", "string", "int", "double", "bool", "boolean", "yaml")


def convert(text: str, type_: str) -> Any:
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
            return load_yaml(text)
    raise ValueError(f"'{type_}' is no type of parameter; it is one of {', '.join(TYPES)}")


def load_yaml(text: str) -> Any:
    """YAML, with `deg(…)` and `rad(…)` turned into radians.

    Raises:
        ValueError: the text is no valid YAML; its words say where.
    """
    import yaml  # costs 20 ms, and most launch files need none

    try:
        return yaml.load(text, yaml_loader())
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except NOT_MADE as error:
        raise ValueError(f"a value is not of its tag's kind: {error}") from None


def dump_yaml(parameters: Mapping[str, Any], namespace: str) -> str:
    """The parameters beneath a namespace as a tree, as `rosparam dump` writes them."""
    import yaml

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
