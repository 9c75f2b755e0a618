"""The nearest valid names to a misspelt one."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable


def nearest(name: str, candidates: Iterable[str], count: int = 3) -> list[str]:
    """Up to `count` candidates that look like `name`, best first."""
    by_lower: dict[str, str] = {}
    for candidate in candidates:
        by_lower.setdefault(candidate.lower(), candidate)
    if not by_lower:
        return []
    from difflib import get_close_matches  # only where something is misspelt: imports add up

    return [by_lower[match] for match in get_close_matches(name.lower(), by_lower, count, 0.6)]


def did_you_mean(name: str, candidates: Iterable[str]) -> str:
    """`did you mean 'a' or 'b'?`, or an empty text when nothing is near."""
    names = [f"'{n}'" for n in nearest(name, candidates)]
    if not names:
        return ""
    return "did you mean " + (", ".join(names[:-1]) + " or " if len(names) > 1 else "") + names[-1] + "?"
