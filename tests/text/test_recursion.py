"""Python's limit of recursion, raised by several at once."""

import sys

from kbot.text.recursion import recursion_limit


def test_the_limit_is_what_the_one_that_needs_most_needs_and_in_the_end_as_before() -> None:
    """As two threads do: the first leaves while the second is still deep within."""
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
