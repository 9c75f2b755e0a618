"""Tests the conversion of user-defined names to file names."""

from pathlib import Path

import pytest

from kbot.text.file_names import plain_file_name


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("turtlebot3", "turtlebot3"),
        ("my robot 2.1", "my robot 2.1"),
        ("räuber", "räuber"),
        ("../evil", "___evil"),
        ("/tmp/x/abs", "_tmp_x_abs"),
        (r"C:\robots\r2", "C__robots_r2"),
        (".", "_"),
        ("..", "__"),
        (".hidden", "_hidden"),
        ("", "_"),
        ("a\nb\0c", "a_b_c"),
        ('a<b>c:d"e|f?g*h', "a_b_c_d_e_f_g_h"),
        ("ends in dots. .", "ends in dots"),
        ("CON", "_CON"),
        ("nul.robot", "_nul.robot"),
        ("com1", "_com1"),
        ("command", "command"),
        ("\ud800", "_"),
    ],
)
def test_a_name_becomes_a_valid_file_name(name, file):
    assert plain_file_name(name) == file


@pytest.mark.parametrize("letter", ["a", "ä", "機", "🤖"])
def test_a_long_name_leaves_room_for_a_date_and_a_suffix(letter, tmp_path):
    name = plain_file_name(letter * 10_000)
    assert 40 <= len(name) <= 100
    file = Path(tmp_path, f"{name}-20260101-120000-99.mcap.bookmarks.yaml")
    file.touch()  # within the 255 bytes that file systems allow
    assert file.parent == tmp_path
