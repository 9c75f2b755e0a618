"""Reading YAML for `xacro.load_yaml`, with its units, and remembering what was read."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from kbot.xacro.faults import Fault
from kbot.xacro.values import Value, wrap

if TYPE_CHECKING:
    from kbot.text.span import Source

UNITS = {
    "!radians": 1.0,
    "!degrees": math.pi / 180.0,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}
_MAX_NODES = 500_000

_cache: dict[str, tuple[str, Any]] = {}
_loader: Any = None


def clear_cache() -> None:
    """Forget the files that were read."""
    _cache.clear()


def load(source: Source, evaluate: Callable[[str], Value]) -> Value:
    """The data of a YAML file. `evaluate` computes the expression behind a unit.

    Raises:
        Fault: X116, the file is not valid YAML.
    """
    import yaml

    known = _cache.get(source.path)
    if known is not None and known[0] == source.text:
        return wrap(_copied(known[1]))
    units_only = _UnitReader(evaluate)
    try:
        loader = _loader_class()(source.text)
        loader.unit_reader = units_only
        try:
            data = loader.get_single_data()
        finally:
            loader.dispose()
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        reason = getattr(error, "problem", None) or str(error)
        raise Fault("X116", f"{source.path}{where} is not valid YAML: {reason}") from None
    if not _is_tree(data):
        raise Fault("X190", f"{source.path} holds too much data, or data within itself")
    _cache[source.path] = (source.text, data)
    return wrap(_copied(data))


class _UnitReader:
    def __init__(self, evaluate: Callable[[str], Value]) -> None:
        self.evaluate = evaluate

    def value(self, text: str, factor: float) -> float:
        return float(self.evaluate(text)) * factor


def _loader_class() -> Any:
    """The fast loader where there is one, with the units added to a class of our own."""
    global _loader
    if _loader is None:
        import yaml

        base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        _loader = type("UnitLoader", (base,), {})
        for tag, factor in UNITS.items():
            _loader.add_constructor(tag, _constructor(factor))
    return _loader


def _constructor(factor: float) -> Callable[[Any, Any], float]:
    def construct(loader: Any, node: Any) -> float:
        reader: _UnitReader = loader.unit_reader
        return reader.value(loader.construct_scalar(node), factor)

    return construct


def _is_tree(data: Any) -> bool:
    """Whether the data, aliases counted as often as they show, is of a size to work with."""
    left, level = _MAX_NODES, [data]
    for _ in range(100):
        following: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                following += item.values()
            elif isinstance(item, list | tuple | set):
                following += item
        left -= len(following)
        if not following:
            return True
        if left < 0:
            return False
        level = following
    return False


def _copied(data: Any) -> Any:
    """A copy, so that nobody changes what is remembered."""
    if type(data) is dict:
        return {key: _copied(value) if type(value) in (dict, list) else value for key, value in data.items()}
    if type(data) is list:
        return [_copied(item) if type(item) in (dict, list) else item for item in data]
    return data
