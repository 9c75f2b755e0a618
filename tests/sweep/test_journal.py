"""The record of finished runs, after everything that can happen to a file."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from kbot.sweep import journal as journal_module
from kbot.sweep.journal import Journal, Row
from kbot.text import KbotError
from kbot.text.notes import notes_sent_to


def row(run: int, **measures: float | None) -> Row:
    return Row(
        run,
        run // 2,
        (0.02, 3, "left"),
        "straight",
        7,
        run != 1,
        None if run != 1 else "slip",
        "ab",
        measures,
    )


@contextmanager
def reported(note: str) -> Iterator[None]:
    """Within the block, this note is sent and no other."""
    notes: list[str] = []
    with notes_sent_to(notes.append):
        yield
    assert notes == [note]


def test_rows_are_read_in_the_order_of_their_runs(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, 100) as journal:
        for run in (3, 0, 1):
            journal.append(row(run, energy=0.1 + run, slip=None))
        assert [each.run for each in journal.rows()] == [0, 1, 3]
    with Journal(path, 100) as journal:
        assert list(journal.rows()) == [row(run, energy=0.1 + run, slip=None) for run in (0, 1, 3)]
        assert [run in journal for run in range(5)] == [True, True, False, True, False]
        assert (journal.count, list(journal.measures)) == (3, ["energy", "slip"])
        assert journal.row(3).values == (0.02, 3, "left")
        with pytest.raises(KeyError):
            journal.row(2)


@pytest.mark.parametrize("kept", range(0, 200, 7))
def test_a_file_that_was_cut_anywhere_continues_with_the_missing_runs(kept: int, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, 100) as journal:
        for run in range(3):
            journal.append(row(run, energy=1.5))
    whole = path.read_bytes()
    path.write_bytes(whole[:kept])
    complete = whole[:kept].count(b"\n")
    with Journal(path, 100) as journal:
        assert [each.run for each in journal.rows()] == list(range(complete))
        for run in range(complete, 3):
            journal.append(row(run, energy=1.5))
    assert path.read_bytes() == whole


def test_a_damaged_line_is_a_missing_run(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, 100) as journal:
        for run in range(3):
            journal.append(row(run))
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b"\0" * 20 + b"\n" + lines[2])  # as a loss of power may leave it
    with reported(f"{path}:2 is not a run of this sweep. It is ignored"), Journal(path, 100) as journal:
        assert [each.run for each in journal.rows()] == [0, 2]
        journal.append(row(1))
        assert [each.run for each in journal.rows()] == [0, 1, 2]


def test_a_full_disk_leaves_the_complete_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "runs.jsonl"
    write = os.write
    left = [100]

    def full(file: int, data: bytes) -> int:
        """A disk with room for some bytes."""
        if not left[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        part = bytes(data)[: left[0]]
        left[0] -= len(part)
        return write(file, part)

    with Journal(path, 100) as journal:
        journal.append(row(0))
        monkeypatch.setattr(journal_module.os, "write", full)
        with pytest.raises(KbotError, match=r"No space left on device\. Finished runs are kept \(1\)\. Run"):
            journal.append(row(1))
        monkeypatch.undo()
        assert [each.run for each in journal.rows()] == [0]
    with Journal(path, 100) as journal:
        assert [each.run for each in journal.rows()] == [0]


def test_numbers_that_are_not_finite_have_no_value(tmp_path: Path) -> None:
    with Journal(tmp_path / "runs.jsonl", 100) as journal:
        journal.append(row(0, energy=float("nan"), slip=float("inf")))
        assert journal.row(0).measures == {"energy": None, "slip": None}


def test_a_text_that_is_not_unicode_is_recorded_with_escapes(tmp_path: Path) -> None:
    """A script may raise such a text, and a file name may have any bytes."""
    wrong = replace(row(0), reason="ValueError: \ud800", scenario="caf\udce9")
    with Journal(tmp_path / "runs.jsonl", 100) as journal:
        journal.append(wrong)
        found = journal.row(0)
    assert (found.reason, found.scenario) == ("ValueError: \\ud800", "caf\\udce9")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("run", -1),
        ("run", 10**15),
        ("run", "x"),
        ("run", True),
        ("values", 5),
        ("values", [[]]),
        ("measures", []),
        ("measures", {"energy": "much"}),
        ("passed", "yes"),
        ("passed", False),
        ("reason", "slip"),
        ("reason", 1),
        ("more", 1),
    ],
)
def test_an_edited_line_is_not_a_finished_run(key: str, value: object, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, 100) as journal:
        journal.append(row(0, energy=1.5))
        journal.append(row(1, energy=1.5))
    first, second = path.read_text().splitlines()
    path.write_text(f"{json.dumps({**json.loads(first), key: value})}\n{second}\n")
    with reported(f"{path}:1 is not a run of this sweep. It is ignored"), Journal(path, 100) as journal:
        assert [each.run for each in journal.rows()] == [1]
        assert journal.place(1) == f"{path}:2"
        journal.append(row(0, energy=1.5))
    with reported(f"{path}:1 is not a run of this sweep. It is ignored"), Journal(path, 100) as journal:
        assert [each.run for each in journal.rows()] == [0, 1]


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match=r"runs\.jsonl cannot be read or written: No such file"):
        Journal(tmp_path / "missing" / "runs.jsonl", 100)


@pytest.mark.parametrize("end", [b"", b"\n"])
def test_a_line_that_is_far_longer_than_a_run_is_refused(end: bytes, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, 100) as journal:
        journal.append(row(0))
    with path.open("ab") as file:
        file.truncate(path.stat().st_size + 5_000_000_000)  # sparse: it takes no space
        file.seek(0, os.SEEK_END)
        file.write(end)
    size = path.stat().st_size
    with pytest.raises(KbotError) as raised:
        Journal(path, 100)
    assert str(raised.value) == (
        f"{path}:2 is not a run of a sweep: it is longer than 1000000 bytes. "
        "Delete this line, or choose another folder with --out"
    )
    assert path.stat().st_size == size


def test_a_long_reason_can_be_read_again(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, 100) as journal:
        journal.append(replace(row(1), reason="x" * 2_000_000))
    with Journal(path, 100) as journal:
        assert journal.count == 1
