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


def load_yaml(text: str) -> Any:  # noqa: ANN401 - what YAML holds
    """Raises yaml.YAMLError: it is not YAML, or a value cannot be made of it."""
    import yaml

    try:
        return yaml.load(text, safe_loader())
    except NOT_MADE as error:
        raise yaml.YAMLError(f"a value is not of its tag's kind: {error}") from None
    except RecursionError:
        raise yaml.YAMLError("it is nested too deeply") from None


@cache
def safe_loader() -> type[yaml.SafeLoader]:
    """PyYAML's class that reads plain data, with bounds. PyYAML takes 20 ms to import."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Plain data of bounded size, with numbers that a float can hold."""

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
        known[key] = MOST_VALUES + 1  # until it is known: whoever asks meanwhile is within it
        parts = node.value if isinstance(node.value, list) else ()
        nodes = (part for item in parts for part in (item if isinstance(item, tuple) else (item,)))
        known[key] = 1 + sum(_size(part, known) for part in nodes)
    return known[key]
