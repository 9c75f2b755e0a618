"""Merging two changes of one text."""

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.workbench.source.merging import merge

BASE = "one\ntwo\nthree\nfour\nfive\nsix\nseven\n"


@pytest.mark.parametrize(
    ("ours", "theirs", "merged"),
    [
        (("two", "2"), ("six", "6"), "one\n2\nthree\nfour\nfive\n6\nseven\n"),
        (("two\n", "two\nnew\n"), ("six\n", ""), "one\ntwo\nnew\nthree\nfour\nfive\nseven\n"),
        (("two", "2"), ("three", "3"), "one\n2\n3\nfour\nfive\nsix\nseven\n"),
        (("two", "2"), ("two", "2"), "one\n2\nthree\nfour\nfive\nsix\nseven\n"),
        (("two", "2"), ("", ""), "one\n2\nthree\nfour\nfive\nsix\nseven\n"),
        (("two", "2"), ("two", "zwei"), None),
        (("two", "2"), ("two\n", ""), None),
        (("two", "2"), ("two\n", "two\nnew\n"), None),
        (("two\n", "two\na\n"), ("two\n", "two\nb\n"), None),
    ],
)
def test_changes_at_different_lines_are_merged(
    ours: tuple[str, str], theirs: tuple[str, str], merged: str | None
) -> None:
    changed = [BASE.replace(old, new, 1) if old else BASE for old, new in (ours, theirs)]
    assert merge(BASE, changed[0], changed[1]) == merged
    assert merge(BASE, changed[1], changed[0]) == merged


def test_several_changes_on_both_sides_are_merged() -> None:
    lines = [f"{n}\n" for n in range(40)]
    ours, theirs, both = list(lines), list(lines), list(lines)
    for n in (2, 12, 30):
        ours[n] = both[n] = "ours\n"
    for n in (7, 20, 38):
        theirs[n] = both[n] = "theirs\n"
    assert merge("".join(lines), "".join(ours), "".join(theirs)) == "".join(both)


@given(*[st.text("ab\n", max_size=12)] * 3)
def test_no_line_of_either_side_is_lost(base: str, ours: str, theirs: str) -> None:
    merged = merge(base, ours, theirs)
    if merged is None:
        assert ours != base
        assert theirs != base
        return
    kept = merged.splitlines()
    for text, line in product((ours, theirs), set(ours.splitlines()) | set(theirs.splitlines())):
        if line not in base.splitlines() and line in text.splitlines():
            assert line in kept
