"""Command lines are split into words as a shell does, on both systems."""

import pytest

from kbot.ros.launch.quoting import split_words


@pytest.mark.parametrize("windows", [False, True])
def test_words_are_split_as_in_a_shell(windows: bool) -> None:
    text = """-d '/a b/c.rviz' "it's" -x=1 # --y"""
    assert split_words(text, windows=windows) == ["-d", "/a b/c.rviz", "it's", "-x=1", "#", "--y"]
    with pytest.raises(ValueError, match="No closing quotation"):
        split_words("'a", windows=windows)


def test_backslash_is_part_of_a_path_on_windows() -> None:
    r"""`$(find robot)/urdf/r.xacro`, where the package is C:\ws\my robot."""
    words = split_words(r'xacro "C:\ws\my robot/urdf/r.xacro" name:=a\b', windows=True)
    assert words == ["xacro", r"C:\ws\my robot/urdf/r.xacro", r"name:=a\b"]
    assert split_words(r"a\ b", windows=False) == ["a b"]
