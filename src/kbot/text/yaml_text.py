"""What a text of YAML holds, and one error for all that keeps it from being made."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Hashable

    import yaml

NOT_MADE = ValueError, LookupError, TypeError, AttributeError, ArithmeticError
"""What PyYAML lets through where a text is not of its tag's kind, as in `!!int ''` and `2020-13-45`."""
TOO_LARGE = "a number is too large"
LARGEST_BITS = 1023
"""Of a whole number: those that a float can hold."""
LONGEST = 2 * LARGEST_BITS
"""Characters of a whole number: it may be written in bits."""
MOST_VALUES = 200_000
"""Of a document, with each alias counted as what it stands for: ten lines can stand for a billion values.
PyYAML's loader in Python takes about 20 microseconds for each. Robots' files have a few thousand."""
MOST_LEVELS = 100
"""Of nested lists and mappings. PyYAML's loaders in C recurse for each level, and 10,000 levels overflow the
stack, which ends the process; their parser takes the square of the levels. Robots' files have at most 10."""
_TOO_DEEP_IN_C = "exceeded maximum nesting depth"
"""What LibYAML reports since 0.2.6 at 1,000 levels, before it gives the first event of them."""
OWN_HASH = (1 << 61) - 1
"""The hash of a smaller whole number is the number. Larger ones can be chosen to have the same hash; as keys,
each is then compared with all before it."""
MOST_LARGE_KEYS = 100
"""Of a mapping, from OWN_HASH on: to compare all of them takes 0.1 ms."""


def load_yaml(text: str) -> Any:  # noqa: ANN401 - what YAML holds
    """Raises yaml.YAMLError: it is not YAML, or a value cannot be made of it."""
    import yaml  # lazy in this module: start-up time

    try:
        return yaml.load(text, safe_loader())
    except NOT_MADE as error:
        raise yaml.YAMLError(f"a value is not of its tag's kind: {error}") from None
    except RecursionError:
        raise yaml.YAMLError("it is nested too deeply") from None


def check_nesting(text: str) -> None:
    """Make sure that a loader in C can read a text.

    Raises:
        yaml.YAMLError: it is not YAML, or has more than MOST_LEVELS levels or about MOST_VALUES values.
    """
    import yaml

    level = 0
    event: Any
    try:
        for count, event in enumerate(yaml.parse(text, getattr(yaml, "CBaseLoader", yaml.BaseLoader))):
            if count > 2 * MOST_VALUES:  # a list has two events, and a document as well
                raise _too_many(event.start_mark)
            level += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if level > MOST_LEVELS:
                raise _too_deep(event.start_mark)
    except yaml.MarkedYAMLError as error:
        if error.problem == _TOO_DEEP_IN_C:
            raise _too_deep(error.problem_mark) from None
        raise


def _too_deep(mark: Any) -> yaml.YAMLError:  # noqa: ANN401 - marks of C and of Python
    import yaml

    message = f"it is nested more than {MOST_LEVELS} levels deep"
    return yaml.composer.ComposerError(None, None, message, mark)


def _too_many(mark: Any) -> yaml.YAMLError:  # noqa: ANN401 - marks of C and of Python
    import yaml

    return yaml.composer.ComposerError(None, None, f"it holds more than {MOST_VALUES:,} values", mark)


def check_keys(loader: Any, mapping: yaml.MappingNode, deep: bool) -> None:  # noqa: ANN401 - of C or Python
    """Refuse keys that can be chosen so that to insert them takes the square of their number.

    Raises:
        yaml.YAMLError: more than MOST_LARGE_KEYS are very large whole numbers.
    """
    import yaml

    if not isinstance(mapping.value, list) or len(mapping.value) <= MOST_LARGE_KEYS:
        return
    loader.flatten_mapping(mapping)  # what it merges has keys, too
    keys = (loader.construct_object(key, deep) for key, _ in mapping.value)  # once: the loader keeps them
    if sum(isinstance(key, int) and abs(key) >= OWN_HASH for key in keys) > MOST_LARGE_KEYS:
        message = f"it has more than {MOST_LARGE_KEYS} whole numbers of over 18 digits as keys"
        raise yaml.constructor.ConstructorError(None, None, message, mapping.start_mark)


@cache
def safe_loader() -> type[yaml.SafeLoader]:
    """PyYAML's class that reads plain data, with bounds. PyYAML takes 20 ms to import."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Plain data of bounded size and depth, with numbers that a float can hold."""

        _level = _count = 0

        def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:  # noqa: ANN401 - a key
            if self._level > MOST_LEVELS:
                raise _too_deep(self.peek_event().start_mark)  # type: ignore[no-untyped-call]  # of PyYAML
            self._count += 1
            if self._count > MOST_VALUES:
                raise _too_many(self.peek_event().start_mark)  # type: ignore[no-untyped-call]  # of PyYAML
            self._level += 1
            node = super().compose_node(parent, index)
            self._level -= 1
            return node

        def get_single_node(self) -> yaml.Node | None:
            node = super().get_single_node()
            if node is not None:
                size, levels = _measure(node, {})
                if size > MOST_VALUES or levels > MOST_LEVELS + 1:  # the values of the last list are one more
                    message = "its aliases stand for too many values"
                    raise yaml.composer.ComposerError(None, None, message, node.start_mark)
            return node

        def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
            check_keys(self, node, deep)
            return super().construct_mapping(node, deep)

        def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
            # whole numbers may be written to the base of 60 (1:30), which takes the square of their length
            value = super().construct_yaml_int(node) if len(node.value) <= LONGEST else 1 << LARGEST_BITS
            if value.bit_length() > LARGEST_BITS:
                raise yaml.constructor.ConstructorError(None, None, TOO_LARGE, node.start_mark)
            return value

    Loader.add_constructor("tag:yaml.org,2002:int", Loader.construct_yaml_int)
    return Loader


def _measure(node: yaml.Node, known: dict[int, tuple[int, int]]) -> tuple[int, int]:
    """How many values and levels a node stands for; one that holds itself stands for very many."""
    key = id(node)
    if key not in known:
        known[key] = MOST_VALUES, 1  # until computed: a node that reaches itself gets this
        parts = node.value if isinstance(node.value, list) else ()
        nodes = (part for item in parts for part in (item if isinstance(item, tuple) else (item,)))
        sizes = [_measure(part, known) for part in nodes]
        known[key] = 1 + sum(size for size, _ in sizes), 1 + max((level for _, level in sizes), default=0)
    return known[key]
