"""The tags and attributes that SDF has: whatever else a world says is read by nobody, and told.

`vocabulary.tsv` has them of what is read here, of every version from 1.3 to 1.12 together
(sdformat.org/spec). What has no line in it, as plugins, sensors, `<physics>` and `<gui>`, is not looked into.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from kbot.text import Element
from kbot.text.suggest import did_you_mean
from kbot.world.findings import Findings

VERSIONS = tuple(f"1.{minor}" for minor in range(13))
_OWN_PREFIX = ":"
"""In a name of the user's own namespace; libsdformat, too, lets it pass."""


@dataclass(frozen=True, slots=True)
class _Names:
    attributes: tuple[str, ...]
    children: tuple[str, ...]


def check_names(root: Element, findings: Findings) -> None:
    """Warn of a version, of tags and of attributes that SDF does not have, each at its line."""
    version = root.attributes.get("version")
    if version is not None and version.strip() not in VERSIONS:
        hint = f"the newest is {VERSIONS[-1]}"
        findings.warning("W209", f"there is no SDF version '{version}'", root.origin, hint)
    names = _vocabulary()
    waiting = [(root, names["sdf"])]
    while waiting:
        element, known = waiting.pop()
        _check_attributes(element, known, findings)
        for child in element.elements():
            if child.tag in known.children:
                inner = names.get(f"{element.tag}/{child.tag}") or names.get(child.tag)
                if inner is not None:
                    waiting.append((child, inner))
            elif _OWN_PREFIX not in child.tag:
                message = f"<{element.tag}> has no <{child.tag}> in SDF: it is not read"
                findings.warning("W209", message, child.origin, did_you_mean(child.tag, known.children))


def _check_attributes(element: Element, known: _Names, findings: Findings) -> None:
    for name in element.attributes:
        if name in known.attributes or name == "xmlns" or _OWN_PREFIX in name:
            continue
        message = f"<{element.tag}> has no attribute '{name}' in SDF: it is not read"
        hint: str = did_you_mean(name, known.attributes)
        if not hint and name in known.children:
            hint = f"it is an element: <{name}>{element.attributes[name]}</{name}>"
        findings.warning("W209", message, element.origin, hint)


@cache
def _vocabulary() -> dict[str, _Names]:
    """By tag, or by parent and tag where a tag means two things."""
    return dict(_lines())


def _lines() -> Iterator[tuple[str, _Names]]:
    text = Path(__file__).with_suffix(".tsv").read_text("utf-8")
    for line in text.splitlines()[1:]:
        tag, attributes, children = line.split("\t")
        yield tag, _Names(tuple(attributes.split()), tuple(children.split()))
