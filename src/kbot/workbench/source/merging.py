"""Merge two changes of one text by lines, such as those of the page and of another editor."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from difflib import SequenceMatcher
from typing import TypeAlias

MOST_LINES = 20_000
"""Lines between the first and the last change that are compared. difflib needs seconds for more."""

Hunk: TypeAlias = tuple[int, int, list[str]]
"""First and last line (exclusive) of the old text, and the lines that replace them."""


def merge(base: str, ours: str, theirs: str) -> str | None:
    """Return the text with both changes of `base`, or None if they conflict.

    They conflict if they overlap, if lines are inserted directly beside another change, or if the lines above
    and below a change were both changed: then its place is not certain.
    """
    if ours == theirs or theirs == base:
        return ours
    lines = base.splitlines(keepends=True)
    own, other = (_hunks(lines, text.splitlines(keepends=True)) for text in (ours, theirs))
    if any(_conflicts(hunk, other) for hunk in own) or any(_conflicts(hunk, own) for hunk in other):
        return None
    for start, end, new in sorted((*own, *other), key=lambda hunk: hunk[:2], reverse=True):
        lines[start:end] = new
    return "".join(lines)


def _conflicts(hunk: Hunk, others: Sequence[Hunk]) -> bool:
    start, end, _ = hunk
    first = bisect_left(others, start, key=lambda other: other[1])  # the first that ends at `start` or later
    near = []
    for other in others[first:]:
        if other[0] > end:
            break
        near.append(other)
    overlap = any(other[0] < end and start < other[1] for other in near)
    is_beside_insertion = bool(near) and (start == end or any(other[0] == other[1] for other in near))
    return overlap or is_beside_insertion or len(near) > 1


def _hunks(old: list[str], new: list[str]) -> list[Hunk]:
    """Return the changes from one list of lines to another, in order."""
    head = _count_equal(old, new)
    tail = min(_count_equal(old[::-1], new[::-1]), len(old) - head, len(new) - head)
    before, after = old[head : len(old) - tail], new[head : len(new) - tail]
    if max(len(before), len(after)) > MOST_LINES:
        return [(head, head + len(before), after)]
    codes = SequenceMatcher(None, before, after).get_opcodes()
    return [(head + i, head + j, after[k:n]) for kind, i, j, k, n in codes if kind != "equal"]


def _count_equal(first: Sequence[str], second: Sequence[str]) -> int:
    """Return the number of equal lines at the start."""
    return next(
        (n for n, (a, b) in enumerate(zip(first, second, strict=False)) if a != b),
        min(len(first), len(second)),
    )
