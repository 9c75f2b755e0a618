"""Finds the tags of xacro that are written without the prefix `xacro:`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from kbot.checks.facts.sources import SourceFile
from kbot.text import Element
from kbot.xacro.tags.attributes import ATTRIBUTES

_EXTENSIONS = frozenset({"gazebo", "transmission", "ros2_control", "sensor", "plugin", "hardware", "param"})
"""Elements with tags of their own, which may have the name of a macro or of a tag of xacro."""
_TAGS = {
    tag.removeprefix("xacro:"): (frozenset(required), frozenset(optional))
    for tag, (required, optional) in ATTRIBUTES.items()
    if tag != "xacro:attribute"  # `attribute` is not specific enough
}
"""The attributes that each tag must have and may have besides."""


def outside_extensions(root: Element) -> Iterator[Element]:
    """The elements in document order, without extensions and their content."""
    waiting = list(root.elements())[::-1]
    while waiting:
        element = waiting.pop()
        if element.tag not in _EXTENSIONS:
            yield element
            if element.children:
                waiting += [child for child in reversed(element.children) if type(child) is Element]


def unprefixed(files: Iterable[SourceFile]) -> list[Element]:
    """The elements that have the tag and the attributes of a xacro tag, but not its prefix."""
    return [e for file in files for e in outside_extensions(file.root) if e.tag in _TAGS and _fits(e)]


def _fits(element: Element) -> bool:
    required, optional = _TAGS[element.tag]
    return required <= element.attributes.keys() <= required | optional
