"""Bookmarks of a run, and those of a recording in a file beside it."""

from pathlib import Path

import pytest

from kbot.text import KbotError
from kbot.workbench.protocol import Mark, NoteMark, RemoveMark
from kbot.workbench.timeline import marks
from kbot.workbench.timeline.marks import Marks


def test_bookmarks_are_ordered_by_time_and_keep_their_numbers() -> None:
    known = Marks()
    known.handle(Mark(5.0, 5.0))
    known.handle(Mark(2.0, 2.0))
    assert [(entry.number, entry.at, entry.note) for entry in known.view.all] == [
        (2, 2.0, "Bookmark 2"),
        (1, 5.0, "Bookmark 1"),
    ]
    known.handle(NoteMark(1, "the wall"))
    known.handle(RemoveMark(2))
    known.handle(RemoveMark(2))  # another page was faster
    known.handle(Mark(1.0, 1.0))
    assert [(entry.number, entry.note) for entry in known.view.all] == [(3, "Bookmark 1"), (1, "the wall")]


def test_bookmarks_of_a_recording_are_in_a_file_beside_it(tmp_path: Path) -> None:
    recording = str(tmp_path / "run.mcap")
    known = Marks(recording)
    known.handle(Mark(1.5, 101.5))
    known.handle(NoteMark(1, "\u00fcber: die # Schwelle"))
    assert (tmp_path / "run.mcap.bookmarks.yaml").is_file()
    assert Marks(recording).view == known.view
    assert Marks(str(tmp_path / "other.mcap")).view.all == ()


def test_an_invalid_file_is_reported_and_not_changed(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap.bookmarks.yaml"
    file.write_text("- at: 1.0\n  time: 1.0\n  note: fine\n- at: soon\n")
    known = Marks(str(tmp_path / "run.mcap"))
    assert f"{file}:4: a bookmark needs 'at' and 'time'" in known.note
    assert known.view.all == ()
    with pytest.raises(KbotError, match="you cannot set new ones"):
        known.handle(Mark(1.0, 1.0))
    assert "soon" in file.read_text()


def test_no_bookmark_is_set_if_the_file_cannot_be_written(tmp_path: Path) -> None:
    known = Marks(str(tmp_path / "gone" / "run.mcap"))
    with pytest.raises(KbotError, match="cannot be written"):
        known.handle(Mark(1.0, 1.0))
    assert known.view.all == ()


def test_the_number_of_bookmarks_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(marks, "MOST", 2)
    known = Marks()
    known.handle(Mark(1.0, 1.0))
    known.handle(Mark(2.0, 2.0))
    with pytest.raises(KbotError, match="the limit of 2 bookmarks is reached"):
        known.handle(Mark(3.0, 3.0))


@pytest.mark.parametrize(
    ("at", "words"),
    [
        (f"1{'0' * 400}", "a number is too large"),
        ("!!int ''", '"" is not a valid int'),
        ("!!bool perhaps", '"perhaps" is not a valid bool'),
        ("!!timestamp soon", '"soon" is not a valid timestamp'),
        ("!other 1", "could not determine a constructor for the tag '!other'"),
        ("2020-13-45", "is not a valid timestamp: month must be in 1..12"),
    ],
)
def test_an_invalid_yaml_value_is_reported_at_its_line(at: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap.bookmarks.yaml"
    file.write_text(f"- at: 1.0\n  time: 1.0\n  note: fine\n- at: {at}\n  time: 1.0\n  note: odd\n")
    known = Marks(str(tmp_path / "run.mcap"))
    assert f"{file}:4: " in known.note
    assert words in known.note


def test_a_file_of_another_program_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap.bookmarks.yaml"
    text = "- at: 1.0\n  time: 1.0\n  note: fine\n  colour: red\n"
    file.write_text(text)
    known = Marks(str(tmp_path / "run.mcap"))
    assert f"{file}:4: unknown field 'colour' in a bookmark" in known.note
    with pytest.raises(KbotError, match="you cannot set new ones"):
        known.handle(Mark(1.0, 1.0))
    assert file.read_text() == text


@pytest.mark.parametrize(
    "comment", ["# mine\n{}", "{}# mine\n", "{}  # mine", "# Bookmarks of a recording\n{}"]
)
def test_comments_in_the_file_are_not_lost(comment: str, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap.bookmarks.yaml"
    text = comment.format("- at: 1.0\n  time: 1.0\n  note: fine\n")
    file.write_text(text)
    known = Marks(str(tmp_path / "run.mcap"))
    assert [entry.note for entry in known.view.all] == ["fine"]
    with pytest.raises(KbotError, match="has comments, which would be lost"):
        known.handle(Mark(2.0, 2.0))
    assert (file.read_text(), len(known.view.all)) == (text, 1)


def test_a_hash_sign_in_a_note_is_not_a_comment(tmp_path: Path) -> None:
    recording = str(tmp_path / "run.mcap")
    known = Marks(recording)
    known.handle(Mark(1.0, 1.0))
    known.handle(NoteMark(1, "first\n# second\nthird # fourth"))
    again = Marks(recording)
    again.handle(Mark(2.0, 2.0))
    assert [entry.note for entry in Marks(recording).view.all] == [
        "first\n# second\nthird # fourth",
        "Bookmark 1",
    ]


def test_a_manual_edit_is_not_overwritten(tmp_path: Path) -> None:
    recording, file = str(tmp_path / "run.mcap"), tmp_path / "run.mcap.bookmarks.yaml"
    known = Marks(recording)
    known.handle(Mark(1.0, 1.0))
    by_hand = file.read_text().replace("Bookmark 1", "by hand")
    file.write_text(by_hand)
    with pytest.raises(KbotError, match="has changed since it was read"):
        known.handle(Mark(2.0, 2.0))
    assert file.read_text() == by_hand
    assert [entry.note for entry in known.view.all] == ["Bookmark 1"]
    file.unlink()
    known.handle(Mark(2.0, 2.0))
    assert len(Marks(recording).view.all) == 2


def test_a_file_with_a_tab_before_a_value_can_be_changed(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap.bookmarks.yaml"
    file.write_text("- at:\t1.0\n  time: 1.0\n  note: fine\n")
    known = Marks(str(tmp_path / "run.mcap"))
    known.handle(Mark(2.0, 2.0))
    assert [entry.at for entry in known.view.all] == [1.0, 2.0]
