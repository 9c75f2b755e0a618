"""Codes that KBot no longer reports, and the codes that replaced them.

A code in a configuration, a comment or a baseline keeps its effect when its rule is merged into another. The
codes are never used again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Former:
    """The name that a code had, and the codes that are reported instead: none if the rule was removed."""

    name: str
    codes: tuple[str, ...] = ()


FORMER_CODES: Mapping[str, Former] = {
    "L065": Former("gz-system-missing"),
    "W142": Former("shared-topic"),
    "W145": Former("drive-joint-twice", ("D131",)),
    "W146": Former("drive-moves-otherwise", ("D107", "D108", "D109")),
    "W209": Former("world-name-unknown"),
}


def covers(word: str, code: str) -> bool:
    """Whether a whole code that a user wrote means this code: the same, or one that replaced it."""
    return word == code or (word in FORMER_CODES and code in FORMER_CODES[word].codes)


def former_codes(code: str) -> list[str]:
    """The codes that a code replaced."""
    return [word for word, former in FORMER_CODES.items() if code in former.codes]


def explained(word: str) -> str:
    """One sentence about a former code: what replaced it."""
    *others, last = FORMER_CODES[word].codes or [""]
    codes = f"{', '.join(others)} or {last}" if others else last
    return f"{word} is now reported as {codes}" if codes else f"{word} is no longer reported"
