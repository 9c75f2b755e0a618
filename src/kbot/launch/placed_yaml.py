"""YAML with the place at which each of its values was written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kbot.launch.values import yaml_loader
from kbot.text import Source, Span

Keys = tuple[str, ...]


def load_placed_yaml(source: Source) -> tuple[Any, Mapping[Keys, Span]]:
    """What a file holds, as `load_yaml` has it, and the spans of its keys, by all keys and
    numbers of items from the root on.

    Raises:
        ValueError: it is no valid YAML; its words say where.
    """
    import yaml

    loader = yaml_loader()(source.text)
    try:
        root = loader.get_single_node()
        data = None if root is None else loader.construct_document(root)
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    finally:
        loader.dispose()
    return data, _find(root, source, yaml)


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
            pending += [(item, (*keys, str(number))) for number, item in enumerate(node.value)]
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
