"""Bookmarks: those of a run, and those of a recording, which stand in a file beside it."""

from pathlib import Path

import pytest

from kbot.text import KbotError
from kbot.workbench.protocol import Mark, NoteMark, RemoveMark
from kbot.workbench.timeline import marks
from kbot.workbench.timeline.marks import Marks


def test_they_are_in_the_order_of_their_moments_and_keep_their_numbers() -> None:
    known = Marks()
    known.obey(Mark(5.0, 5.0))
    known.obey(Mark(2.0, 2.0))
    assert [(one.number, one.at, one.note) for one in known.view.all] == [
        (2, 2.0, "Bookmark 2"),
        (1, 5.0, "Bookmark 1"),
    ]
    known.obey(NoteMark(1, "the wall"))
    known.obey(RemoveMark(2))
    known.obey(RemoveMark(2))  # another page was faster
    known.obey(Mark(1.0, 1.0))
    assert [(one.number, one.note) for one in known.view.all] == [(3, "Bookmark 1"), (1, "the wall")]


def test_those_of_a_recording_stand_beside_it(tmp_path: Path) -> None:
    recording = str(tmp_path / "run.mcap")
    known = Marks(recording)
    known.obey(Mark(1.5, 101.5))
    known.obey(NoteMark(1, "\u00fcber: die # Schwelle"))
    assert (tmp_path / "run.mcap.bookmarks.yaml").is_file()
    assert Marks(recording).view == known.view
    assert Marks(str(tmp_path / "other.mcap")).view.all == ()


def test_a_file_that_is_none_is_told_of_and_stays_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap.bookmarks.yaml"
    file.write_text("- at: 1.0\n  time: 1.0\n  note: fine\n- at: soon\n")
    known = Marks(str(tmp_path / "run.mcap"))
    assert f"{file}:4: a bookmark has 'at' and 'time'" in known.note
    assert known.view.all == ()
    with pytest.raises(KbotError, match="no others can be set"):
        known.obey(Mark(1.0, 1.0))
    assert "soon" in file.read_text()


def test_where_nothing_can_be_written_no_bookmark_is_set(tmp_path: Path) -> None:
    known = Marks(str(tmp_path / "gone" / "run.mcap"))
    with pytest.raises(KbotError, match="cannot be written"):
        known.obey(Mark(1.0, 1.0))
    assert known.view.all == ()


def test_there_is_an_end_to_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(marks, "MOST", 2)
    known = Marks()
    known.obey(Mark(1.0, 1.0))
    known.obey(Mark(2.0, 2.0))
    with pytest.raises(KbotError, match="2 bookmarks are set: remove some"):
        known.obey(Mark(3.0, 3.0))
