"""Tests several simultaneous changes of Python's recursion limit."""

import sys

from kbot.text.recursion import recursion_limit


def test_the_highest_limit_applies_and_the_old_one_returns() -> None:
    """As with two threads: the first one ends while the second one is still recursing."""
    before = sys.getrecursionlimit()
    first, second = recursion_limit(before + 100), recursion_limit(before + 300)
    with first:
        second.__enter__()
        assert sys.getrecursionlimit() == before + 300
    assert sys.getrecursionlimit() == before + 300
    second.__exit__(None, None, None)
    assert sys.getrecursionlimit() == before
    with recursion_limit(before - 100):
        assert sys.getrecursionlimit() == before
