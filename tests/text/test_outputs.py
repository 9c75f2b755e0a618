"""Tests which outputs of long runs are refused before the runs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from kbot.text import KbotError
from kbot.text.outputs import require_different, require_report_place

MARK = "<report>"


def test_a_report_may_be_new_or_replace_a_report(tmp_path: Path) -> None:
    path = tmp_path / "report"
    require_report_place(str(path), MARK)
    path.touch()  # as mktemp makes it
    require_report_place(str(path), MARK)
    path.write_text(f"beginning {MARK} more")
    require_report_place(str(path), MARK)
    require_report_place(os.devnull, MARK)


@pytest.mark.parametrize("text", ["mine", "x" * 5000 + MARK])
def test_another_file_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "mine"
    path.write_text(text)
    (tmp_path / "link").symlink_to(path)
    for name in ("mine", "link"):
        with pytest.raises(KbotError, match=f"{name} exists and is not a report of this command"):
            require_report_place(str(tmp_path / name), MARK)


def test_the_same_file_is_found_by_every_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("link").symlink_to("a")
    require_different(["a", "b", os.devnull, os.devnull])
    for other in ("./a", str(tmp_path / "a"), "link"):
        with pytest.raises(KbotError, match="two outputs of this command are the same file"):
            require_different(["a", other])
