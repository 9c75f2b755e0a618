"""Puts the elements of an XML text in the order of another text, so that their order alone is not an edit."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from kbot.text import DescriptionError, Element, Source, parse_xml

_EXPRESSION = re.compile(r"\$\{[^{}]*\}|\$\([^()]*\)")
_DEEPEST = 50
"""Levels of elements that are put in order."""
_NAMES = ("name", "reference", "filename")


def in_order_of(text: str, other: str) -> str:
    """The text with its elements in the order of the same elements in the other text.

    Elements are the same if they have the same tag and name, and their parents are the same. An element that
    is not the only one of its tag and name keeps its place. A text that is not XML is returned as it is.
    """
    try:
        roots = parse_xml(Source("", text)), parse_xml(Source("", other))
    except DescriptionError:
        return text
    data = roots[0].source.data
    ordered = _ordered(data, *roots, 0)
    return (data[: roots[0].start] + ordered + data[roots[0].end :]).decode("utf-8", "surrogatepass")


def _ordered(data: bytes, element: Element, other: Element, depth: int) -> bytes:
    children, others = list(element.elements()), list(other.elements())
    if not children or depth >= _DEEPEST:
        return data[element.start : element.end]
    own, theirs = _by_key(children), _by_key(others)
    following = iter([key for key in theirs if key in own])
    parts, at = list[bytes](), element.start
    for child in children:
        parts.append(data[at : child.start])
        key = _key(child)
        if key in own and key in theirs:
            key = next(following)
            parts.append(_ordered(data, own[key], theirs[key], depth + 1))
        else:
            parts.append(data[child.start : child.end])
        at = child.end
    return b"".join((*parts, data[at : element.end]))


def _by_key(elements: Sequence[Element]) -> dict[str, Element]:
    """The elements that are the only ones with their key, in order."""
    counts = Counter(map(_key, elements))
    return {key: element for element in elements if counts[key := _key(element)] == 1}


def _key(element: Element) -> str:
    """The tag and name of an element. A name may be computed from a property, which may have a new name."""
    names = (element.attributes.get(name, "") for name in _NAMES)
    return " ".join((element.tag, *(_EXPRESSION.sub("$", name) for name in names)))
