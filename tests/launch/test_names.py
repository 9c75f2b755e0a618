"""Which nodes a pattern of a parameter file means."""

import pytest

from kbot.kinematics.controller_files import matches


@pytest.mark.parametrize(
    ("pattern", "node", "is_meant"),
    [
        ("/a/b", "/a/b", True),
        ("a", "/a", True),
        ("/a", "/a/b", False),
        ("/*", "/a", True),
        ("/*", "/a/b", False),
        ("/*/b", "/a/b", True),
        ("/**", "/a/b/c", True),
        ("/**/c", "/c", True),
        ("/**/c", "/a/b/c", True),
        ("/**/c", "/a/c/b", False),
        ("/a/**/c/*", "/a/b/c/c/d", True),
        ("/a/**/b/**/c", "/a/b/x/c", True),
        ("/a/**/b/**/c", "/a/c/x/b", False),
        ("/a.b", "/axb", False),
    ],
)
def test_patterns(pattern: str, node: str, is_meant: bool) -> None:
    assert matches(pattern, node) is is_meant


def test_many_wildcards_are_matched_at_once() -> None:
    """Trying each way to divide 60 names among 30 wildcards would not end."""
    assert not matches("/**/a" * 30 + "/b", "/a" * 60)
