"""Undo and redo of changes to a description, beside changes of an editor."""

from pathlib import Path

import pytest

from kbot.text import Edit, KbotError, Span, read_source
from kbot.workbench.source.authoring import Editor


def test_dragging_one_number_is_one_change(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_text("x 1.0 y 2.0")
    editor = Editor(lambda files: None)
    for was, text in (("1.0", "1.1"), ("1.1", "1.2"), ("1.2", "9.99")):
        editor.replace(str(file), 1, 3, was, text)
    editor.replace(str(file), 1, 11, ".0", ".5")
    assert file.read_text() == "x 9.99 y 2.5"
    editor.undo()
    assert editor.undo_title == "1.0 → 9.99"
    editor.undo()
    assert file.read_text() == "x 1.0 y 2.0"


def test_edits_are_written_together_or_not_at_all(tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    first.write_text("ä one two")
    second.write_text("three")
    a, b = read_source(first), read_source(second)
    editor = Editor(lambda files: None)
    entry = (Edit(Span(a, 3, 6), "1"), "one")
    two = (Edit(Span(a, 7, 10), "2222"), "two")
    three = (Edit(Span(b, 0, 5), "3"), "three")
    editor.apply("numbers", [entry, two, three])
    assert (first.read_text(), second.read_text()) == ("ä 1 2222", "3")
    editor.undo()
    assert (first.read_text(), second.read_text()) == ("ä one two", "three")
    second.write_text("four")
    with pytest.raises(KbotError, match="has changed"):
        editor.apply("numbers", [entry, three])
    assert first.read_text() == "ä one two"
    with pytest.raises(KbotError, match="two edits overlap"):
        editor.apply("numbers", [entry, (Edit(Span(a, 4, 8), ""), "ne t")])


def test_a_change_of_an_editor_is_not_undone(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_text("1")
    editor = Editor(lambda files: None)
    editor.replace(str(file), 1, 1, "1", "2")
    file.write_text("3")
    with pytest.raises(KbotError, match="was changed at this place after the edit"):
        editor.undo()
    assert file.read_text() == "3"
    file.write_text("2")
    editor.undo()
    file.write_text("4")
    with pytest.raises(KbotError, match="was changed at this place after the edit"):
        editor.redo()
    assert file.read_text() == "4"
    editor.replace(str(file), 1, 1, "4", "5")
    assert editor.redo_title == ""


def test_other_lines_of_an_editor_survive_undo_and_redo(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"one\r\ntwo 2\r\nthree\r\nfour 4\r\nfive\r\n")
    editor = Editor(lambda files: None)
    editor.replace(str(file), 2, 5, "2", "22")
    editor.replace(str(file), 4, 6, "4", "44")
    file.write_bytes(b"new\r\none\r\ntwo 22\r\nthree 3\r\nfour 44\r\nfive\r\n")
    editor.undo()
    assert file.read_bytes() == b"new\r\none\r\ntwo 22\r\nthree 3\r\nfour 4\r\nfive\r\n"
    editor.undo()
    undone = b"new\r\none\r\ntwo 2\r\nthree 3\r\nfour 4\r\nfive\r\n"
    assert file.read_bytes() == undone
    file.write_bytes(undone + b"six\r\n")
    editor.redo()
    editor.redo()
    assert file.read_bytes() == b"new\r\none\r\ntwo 22\r\nthree 3\r\nfour 44\r\nfive\r\nsix\r\n"


@pytest.mark.parametrize("saved", ["a\nx 9\nb\n", "x 2\n", "a\nb\n", "a\nx 2\nx 2\nb\n", "q\nx 2\nq\n"])
def test_undo_is_refused_if_the_changed_line_is_missing_or_ambiguous(tmp_path: Path, saved: str) -> None:
    file = tmp_path / "a"
    file.write_text("a\nx 1\nb\n")
    editor = Editor(lambda files: None)
    editor.replace(str(file), 2, 3, "1", "2")
    file.write_text(saved)
    with pytest.raises(KbotError, match="was changed at this place after the edit"):
        editor.undo()
    assert file.read_text() == saved
