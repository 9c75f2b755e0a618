"""The nearest valid names to a misspelt one."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable


_ALIKE = 0.6


def nearest(name: str, candidates: Iterable[str], count: int = 3) -> list[str]:
    """Up to `count` candidates that look like `name`, best first."""
    by_lower: dict[str, str] = {}
    for candidate in candidates:
        by_lower.setdefault(candidate.lower(), candidate)
    if not by_lower:
        return []
    from difflib import get_close_matches  # only where something is misspelt: imports add up

    matches = get_close_matches(name.lower(), by_lower, count, _ALIKE)
    return [by_lower[match] for match in matches if _stems_are_alike(name.lower(), match)]


def _stems_are_alike(name: str, other: str) -> bool:
    """Whether two names are alike in more than the ending that many names have, as `_link`."""
    stem, _, ending = name.rpartition("_")
    other_stem, _, other_ending = other.rpartition("_")
    if not stem or not other_stem or ending != other_ending:
        return True
    from difflib import SequenceMatcher

    return SequenceMatcher(None, stem, other_stem).ratio() >= _ALIKE


def did_you_mean(name: str, candidates: Iterable[str]) -> str:
    """`did you mean 'a' or 'b'?`, or an empty text when nothing is near."""
    names = [f"'{n}'" for n in nearest(name, candidates)]
    if not names:
        return ""
    return "did you mean " + (", ".join(names[:-1]) + " or " if len(names) > 1 else "") + names[-1] + "?"
