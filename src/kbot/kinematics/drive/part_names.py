"""What the names of joints and links suggest: wheel, caster, left, right."""

from __future__ import annotations

import re

WHEEL = re.compile(r"wheel|tire|tyre|(^|_)whl", re.IGNORECASE)
CASTER = re.compile(r"caster|castor|ball|swivel|free_?wheel|skid(?!_?steer)", re.IGNORECASE)
_SIDE = re.compile(r"(?<![a-zA-Z])(left|right|l|r)(?![a-zA-Z])|(left|right|Left|Right)", re.IGNORECASE)
_OTHER = {"left": "right", "right": "left", "l": "r", "r": "l"}


def side_of(name: str) -> str:
    """The side that a name contains, "left" or "right"; empty if it contains none."""
    match = _SIDE.search(name)
    if not match:
        return ""
    return "left" if match[0][0] in "lL" else "right"


def mirrored_name(name: str) -> str | None:
    """The name with its first word for a side replaced by the other side; None if it has none."""

    def other(match: re.Match[str]) -> str:
        word = match[0]
        swapped = _OTHER[word.lower()]
        return swapped.upper() if word.isupper() else swapped.capitalize() if word[0].isupper() else swapped

    mirrored, count = _SIDE.subn(other, name, count=1)
    return mirrored if count else None
