"""YAML with the place at which each of its values was written."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from kbot.text import Source, Span
from kbot.text.yaml_text import NOT_MADE, safe_loader

_ANGLE = re.compile(r"(rad|deg)?\(?([^()]*)\)?")


_FACTOR = re.compile(r"[+-]?(?:\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+|pi)")


_loader_class: type | None = None


def yaml_loader() -> Any:
    """PyYAML's class that reads YAML as rosparam does."""
    global _loader_class
    if _loader_class is None:
        import yaml

        class Loader(safe_loader()):  # type: ignore[misc]  # a class that is made when it is needed
            """YAML as rosparam reads it."""

        def radians(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
            return _angle(str(loader.construct_scalar(node)), 1.0)

        def degrees(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
            return _angle(str(loader.construct_scalar(node)), math.pi / 180)

        Loader.add_constructor("!radians", radians)
        Loader.add_constructor("!degrees", degrees)
        Loader.add_implicit_resolver("!degrees", re.compile(r"^deg\([^)]*\)$"), ["d"])
        Loader.add_implicit_resolver("!radians", re.compile(r"^rad\([^)]*\)$"), ["r"])
        _loader_class = Loader
    return _loader_class


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


Keys = tuple[str, ...]


class BadYaml(ValueError):
    """A file that is no valid YAML, and the place at which it ends to be; all of it where none is known.
    `problem` is what is wrong there, without the place."""

    def __init__(self, words: str, span: Span, problem: str = "") -> None:
        super().__init__(words)
        self.span, self.problem = span, problem or words


def load_placed_yaml(source: Source) -> tuple[Any, Mapping[Keys, Span]]:
    """What a file holds, as `load_yaml` has it, and the spans of its keys and of its lists' items, by
    all keys and numbers of items from the root on.

    Raises:
        BadYaml: it is no valid YAML; its words say where, too.
    """
    import yaml

    loader = None
    try:
        loader = yaml_loader()(source.text)
        root = loader.get_single_node()
        data = None if root is None else loader.construct_document(root)
    except yaml.YAMLError as error:
        problem = getattr(error, "problem", None) or ""
        raise BadYaml(" ".join(str(error).split()), _at(error, source), problem) from None
    except NOT_MADE as error:
        raise BadYaml(f"a value is not of its tag's kind: {error}", source.whole()) from None
    except RecursionError:
        raise BadYaml("it is nested too deeply", source.whole()) from None
    finally:
        if loader is not None:
            loader.dispose()
    return data, _find(root, source, yaml)


def _at(error: Any, source: Source) -> Span:
    """Where YAML ends to be valid."""
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    if mark is None:
        return source.whole()
    start = source.offset(mark.line + 1, mark.column + 1)
    return Span(source, start, start)


def _find(root: Any, source: Source, yaml: Any) -> dict[Keys, Span]:
    """What an alias repeats has its place where it is first met, so that aliases of aliases cost nothing."""
    places: dict[Keys, Span] = {}
    seen: set[int] = set()
    pending: list[tuple[Any, Keys]] = [(root, ())]
    while pending:
        node, keys = pending.pop()
        if not isinstance(node, yaml.CollectionNode) or id(node) in seen:
            continue
        seen.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            for number, item in enumerate(node.value):
                below = (*keys, str(number))
                places[below] = _span(item, source)
                pending.append((item, below))
            continue
        for key, value in node.value:
            if isinstance(key, yaml.ScalarNode):
                below = (*keys, str(key.value))
                places[below] = _span(key, source)
                pending.append((value, below))
    return places


def _span(node: Any, source: Source) -> Span:
    start, end = (source.offset(mark.line + 1, mark.column + 1) for mark in (node.start_mark, node.end_mark))
    return Span(source, start, end)
