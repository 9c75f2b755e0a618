"""Which nodes a pattern in a parameter file matches."""

import pytest

from kbot.kinematics.controller_files import matches


@pytest.mark.parametrize(
    ("pattern", "node", "matches_node"),
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
def test_pattern_matches_nodes(pattern: str, node: str, matches_node: bool) -> None:
    assert matches(pattern, node) is matches_node


def test_many_wildcards_are_matched_quickly() -> None:
    """Trying every way to divide 60 names among 30 wildcards would take too long."""
    assert not matches("/**/a" * 30 + "/b", "/a" * 60)
