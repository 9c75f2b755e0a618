"""What a text of YAML holds, and one error for all that keeps it from being made."""

from __future__ import annotations

import reprlib
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import yaml

NOT_MADE = ValueError, LookupError, TypeError, AttributeError, ArithmeticError
"""What PyYAML lets through where a text is not of its tag's kind, as in `!!int ''` and `2020-13-45`."""
TOO_LARGE = "a number is too large"
LARGEST_BITS = 1023
"""Of a whole number: those that a float can hold."""
LONGEST = 2 * LARGEST_BITS
"""Characters of a whole number: it may be written in bits."""
MOST_VALUES = 1_000_000
"""Of a document, with each alias counted as what it stands for: ten lines can stand for a billion values."""
MOST_LEVELS = 100
"""Of nested lists and mappings. PyYAML's loaders in C recurse for each level, and 10,000 levels overflow the
stack, which ends the process; their parser takes the square of the levels. Robots' files have at most 10."""


def load_yaml(text: str) -> Any:  # noqa: ANN401 - what YAML holds
    """Raises yaml.YAMLError: it is not YAML, or a value cannot be made of it."""
    import yaml

    try:
        return yaml.load(text, safe_loader())
    except NOT_MADE as error:
        raise yaml.YAMLError(f"a value is not of its tag's kind: {error}") from None
    except RecursionError:
        raise yaml.YAMLError("it is nested too deeply") from None


def check_nesting(text: str) -> None:
    """Make sure that a loader in C can read a text.

    Raises:
        yaml.YAMLError: it is not YAML, or has more than MOST_LEVELS levels.
    """
    import yaml

    level = 0
    event: Any
    for event in yaml.parse(text, getattr(yaml, "CBaseLoader", yaml.BaseLoader)):
        level += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if level > MOST_LEVELS:
            raise _too_deep(event.start_mark)


def _too_deep(mark: Any) -> yaml.YAMLError:  # noqa: ANN401 - marks of C and of Python
    import yaml

    message = f"it is nested more than {MOST_LEVELS} levels deep"
    return yaml.composer.ComposerError(None, None, message, mark)


@cache
def safe_loader() -> type[yaml.SafeLoader]:
    """PyYAML's class that reads plain data, with bounds. PyYAML takes 20 ms to import."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Plain data of bounded size and depth, with numbers that a float can hold."""

        _level = 0

        def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:  # noqa: ANN401 - a key
            if self._level > MOST_LEVELS:
                raise _too_deep(self.peek_event().start_mark)  # type: ignore[no-untyped-call]
            self._level += 1
            node = super().compose_node(parent, index)
            self._level -= 1
            return node

        def get_single_node(self) -> yaml.Node | None:
            node = super().get_single_node()
            if node is not None and _size(node, {}) > MOST_VALUES:
                raise yaml.composer.ComposerError(
                    None, None, "its aliases stand for too many values", node.start_mark
                )
            return node

        def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
            # whole numbers may be written to the base of 60 (1:30), which takes the square of their length
            value = super().construct_yaml_int(node) if len(node.value) <= LONGEST else 1 << LARGEST_BITS
            if value.bit_length() > LARGEST_BITS:
                raise yaml.constructor.ConstructorError(None, None, TOO_LARGE, node.start_mark)
            return value

    Loader.add_constructor("tag:yaml.org,2002:int", Loader.construct_yaml_int)
    return Loader


def quote(value: object) -> str:
    """A value of YAML in an error message: shortened, for it may hold itself a billion times."""
    return reprlib.repr(value)


def _size(node: yaml.Node, known: dict[int, int]) -> int:
    """How many values a node stands for; one that holds itself stands for very many."""
    key = id(node)
    if key not in known:
        known[key] = MOST_VALUES + 1  # until computed: a node that reaches itself gets this value
        parts = node.value if isinstance(node.value, list) else ()
        nodes = (part for item in parts for part in (item if isinstance(item, tuple) else (item,)))
        known[key] = 1 + sum(_size(part, known) for part in nodes)
    return known[key]
