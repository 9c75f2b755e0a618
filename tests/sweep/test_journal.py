"""The record of finished runs, after everything that can happen to a file."""

from __future__ import annotations

import errno
import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kbot.sweep import journal as journal_module
from kbot.sweep.designs import Method
from kbot.sweep.journal import DELETE, Journal, Row
from kbot.sweep.plan import Plan
from kbot.sweep.space import parse_space
from kbot.text import KbotError
from kbot.text.notes import notes_sent_to
from kbot.trials.pool import Task
from kbot.trials.scenario import RobotSource, Scenario

PLAN = Plan(
    RobotSource("robot.xacro"),
    parse_space(["a=0.0:1.0", "b=1,2,3", "c=left,right"]),
    (Task(Scenario("straight", 1.0), 7),) * 2,
    (),
    Method.RANDOM,
    50,
)


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
    with Journal(path, PLAN) as journal:
        for run in (3, 0, 1):
            journal.append(row(run, energy=0.1 + run, slip=None))
        assert [each.run for each in journal.rows()] == [0, 1, 3]
    with Journal(path, PLAN) as journal:
        assert list(journal.rows()) == [row(run, energy=0.1 + run, slip=None) for run in (0, 1, 3)]
        assert [run in journal for run in range(5)] == [True, True, False, True, False]
        assert (journal.count, list(journal.measures)) == (3, ["energy", "slip"])
        assert journal.row(3).values == (0.02, 3, "left")
        with pytest.raises(KeyError):
            journal.row(2)


@pytest.mark.parametrize("kept", range(0, 200, 7))
def test_a_file_that_was_cut_anywhere_continues_with_the_missing_runs(kept: int, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, PLAN) as journal:
        for run in range(3):
            journal.append(row(run, energy=1.5))
    whole = path.read_bytes()
    path.write_bytes(whole[:kept])
    complete = whole[:kept].count(b"\n")
    with Journal(path, PLAN) as journal:
        assert [each.run for each in journal.rows()] == list(range(complete))
        for run in range(complete, 3):
            journal.append(row(run, energy=1.5))
    assert path.read_bytes() == whole


def test_a_damaged_line_is_a_missing_run(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, PLAN) as journal:
        for run in range(3):
            journal.append(row(run))
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b"\0" * 20 + b"\n" + lines[2])  # as a loss of power may leave it
    told = f"{path}:2:1: it is not JSON. The line is not a run of this sweep and is ignored"
    with reported(told), Journal(path, PLAN) as journal:
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

    with Journal(path, PLAN) as journal:
        journal.append(row(0))
        monkeypatch.setattr(journal_module.os, "write", full)
        with pytest.raises(KbotError, match=r"No space left on device\. Finished runs are kept \(1\)\. Run"):
            journal.append(row(1))
        monkeypatch.undo()
        assert [each.run for each in journal.rows()] == [0]
    with Journal(path, PLAN) as journal:
        assert [each.run for each in journal.rows()] == [0]


@pytest.mark.parametrize(("written", "finished"), [(10, []), (10_000, [0])])
def test_ctrl_c_keeps_a_row_that_was_written(
    written: int, finished: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, write = tmp_path / "runs.jsonl", os.write

    def interrupted(file: int, data: bytes) -> int:
        write(file, bytes(data)[:written])
        raise KeyboardInterrupt

    with Journal(path, PLAN) as journal:
        monkeypatch.setattr(journal_module.os, "write", interrupted)
        with pytest.raises(KeyboardInterrupt):
            journal.append(row(0))
        monkeypatch.undo()
        assert (journal.count, [each.run for each in journal.rows()]) == (len(finished), finished)
        journal.append(row(1))
    with Journal(path, PLAN) as journal:
        assert [each.run for each in journal.rows()] == [*finished, 1]


def test_numbers_that_are_not_finite_have_no_value(tmp_path: Path) -> None:
    with Journal(tmp_path / "runs.jsonl", PLAN) as journal:
        journal.append(row(0, energy=float("nan"), slip=float("inf")))
        assert journal.row(0).measures == {"energy": None, "slip": None}


def test_a_text_that_is_not_unicode_is_recorded_with_escapes(tmp_path: Path) -> None:
    """A script may raise such a text, and a file name may have any bytes."""
    wrong = replace(row(0), passed=False, reason="ValueError: \ud800", scenario="caf\udce9")
    plan = replace(PLAN, trials=(Task(Scenario("caf\udce9", 1.0), 7),))
    with Journal(tmp_path / "runs.jsonl", plan) as journal:
        journal.append(wrong)
        found = journal.row(0)
    assert (found.reason, found.scenario) == ("ValueError: \\ud800", "caf\\udce9")


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"run": -1}, "1:{}: the sweep has 100 runs, and no run -1"),
        ({"run": 10**15}, "1:{}: the sweep has 100 runs, and no run 1000000000000000"),
        ({"run": "x"}, "1:{}: 'run' has the wrong type"),
        ({"run": True}, "1:{}: 'run' has the wrong type"),
        ({"seed": 2**63}, "1:{}: 'seed' has more than 64 bits"),
        (
            {"seed": 2**70},
            "1:{}: 'seed' has the wrong type",
        ),  # JSON's numbers beyond 64 bits are not integers
        ({"values": 5}, "1:{}: 'values' has the wrong type"),
        ({"values": [[]]}, "1:{}: a value is neither a number nor a text"),
        ({"measures": []}, "1:{}: 'measures' has the wrong type"),
        ({"measures": {"energy": "much"}}, "1:{}: the value of a measure is not a number"),
        ({"passed": "yes"}, "1:{}: 'passed' has the wrong type"),
        ({"passed": False}, "1:{}: 'passed' and 'reason' contradict each other"),
        ({"reason": "slip"}, "1:{}: 'passed' and 'reason' contradict each other"),
        ({"reason": 1}, "1:{}: 'reason' has the wrong type"),
        ({"more": 1}, "1:{}: unknown key 'more'"),
    ],
)
def test_a_line_that_is_not_a_row_is_not_a_finished_run(
    changes: dict[str, object], problem: str, tmp_path: Path
) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, PLAN) as journal:
        journal.append(row(0, energy=1.5))
        journal.append(row(1, energy=1.5))
    first, second = path.read_text().splitlines()
    first = json.dumps({**json.loads(first), **changes})
    path.write_text(f"{first}\n{second}\n")
    key = "reason" if changes.get("passed") is False else next(iter(changes))
    part = {"values": "[]]" if "[[]]" in first else "", "measures": '"energy"' if "much" in first else ""}
    column = first.index(part.get(key) or f'"{key}"') + 1
    told = f"{path}:{problem.format(column)}. The line is not a run of this sweep and is ignored"
    with reported(told), Journal(path, PLAN) as journal:
        assert [each.run for each in journal.rows()] == [1]
        assert journal.place(1) == f"{path}:2:1"
        journal.append(row(0, energy=1.5))
    with reported(told), Journal(path, PLAN) as journal:
        assert [each.run for each in journal.rows()] == [0, 1]


@pytest.mark.parametrize(
    "line", ["[]", '"text"', "null", "18446744073709551616", "1e999", "[" * 100_000, " "]
)
def test_a_line_that_is_not_an_object_is_ignored(line: str, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    path.write_text(f"{line}\n")
    notes: list[str] = []
    with notes_sent_to(notes.append), Journal(path, PLAN) as journal:
        assert journal.count == 0
    (note,) = notes
    assert re.fullmatch(rf"{path}:1:\d+: .* The line is not a run of this sweep and is ignored", note)


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("values", (), "is recorded with 0 values, but 3 vary"),
        ("values", (0.02, 3, 4), "is recorded with c = '4', which is not one of its values"),
        (
            "values",
            (0.02, 2**63, "left"),
            "is recorded with b = '9223372036854775808', which is not one of its values",
        ),
        (
            "values",
            (2**64 - 1, 3, "left"),
            "is recorded with a = '18446744073709551615', which is not one of its values",
        ),
        ("values", ("x", 3, "left"), "is recorded with a = 'x', which is not one of its values"),
        ("design", 3, "is recorded for design 3, but it is of design 0"),
        ("scenario", "other", "is recorded with another scenario, but it is of 'straight'"),
        ("seed", 8, "is recorded with the seed 8, but it has the seed 7"),
    ],
)
def test_a_row_of_another_run_than_the_plan_has_is_an_error(
    key: str, value: object, problem: str, tmp_path: Path
) -> None:
    path = tmp_path / "runs.jsonl"
    line = journal_module._line(replace(row(0, energy=1.5), **{key: value}))  # with a valid checksum
    path.write_bytes(line)
    with pytest.raises(KbotError) as raised:
        Journal(path, PLAN)
    where, _, error = str(raised.value).partition(": ")
    assert error == f"run 0 {problem}. {DELETE}"
    assert where.startswith(f"{path}:1:")
    wrong = re.search(r" = '(\w+)'", problem)
    shown = wrong[1].encode() if wrong else f'"{key}"'.encode()
    assert line[int(where.rpartition(":")[2]) - 1 :].removeprefix(b'"' if wrong else b"").startswith(shown)


def test_a_seed_that_varies_is_that_of_its_design(tmp_path: Path) -> None:
    plan = replace(PLAN, space=parse_space(["seed=3,4"]))
    for seed in (3, 4):
        made = replace(row(0), values=(3,), seed=seed)
        (tmp_path / "runs.jsonl").write_bytes(journal_module._line(made))
        if seed == 3:
            with Journal(tmp_path / "runs.jsonl", plan) as journal:
                assert list(journal.rows()) == [made]
        else:
            with pytest.raises(KbotError, match="with the seed 4, but it has the seed 3"):
                Journal(tmp_path / "runs.jsonl", plan)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("1.5", "1.6"),
        ('"ab"', '"ac"'),
        ("1.5", "1.50"),
        (":", ": "),
        ('"crc32":"', '"crc32":"0'),
        ("{", " {"),
    ],
)
def test_a_row_that_was_edited_is_an_error(old: str, new: str, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, PLAN) as journal:
        journal.append(row(3, energy=1.5))
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(KbotError) as raised:
        Journal(path, PLAN)
    assert str(raised.value) == f"{path}:1:1: the line of run 3 was changed after it was written. {DELETE}"


def test_a_run_that_is_recorded_twice_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    path.write_bytes(journal_module._line(row(3, energy=1.0)) + journal_module._line(row(3, energy=2.0)))
    with pytest.raises(KbotError) as raised:
        Journal(path, PLAN)
    assert str(raised.value) == f"{path}:2:2: run 3 is recorded twice. {DELETE}"


ROWS = [row(run, energy=1.5 + run, slip=None) for run in range(4)]
WRITTEN = b"".join(map(journal_module._line, ROWS))
PARTS = (b"[]", b'""', b"null", b"1e999", b"18446744073709551616", b"\n", b"{", b"-", b"\xff", b"\\ud800")


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    edits=st.lists(
        st.tuples(
            st.integers(0, len(WRITTEN)),
            st.integers(0, 40),
            st.one_of(st.binary(max_size=3), st.sampled_from(PARTS)),
        ),
        min_size=1,
        max_size=3,
    )
)
def test_a_damaged_journal_has_no_other_result(edits: list[tuple[int, int, bytes]], tmp_path: Path) -> None:
    """Whatever happens to the file: each row is as it was written, or is missing, or there is one error."""
    path, data = tmp_path / "runs.jsonl", WRITTEN
    for at, removed, inserted in edits:
        data = data[:at] + inserted + data[at + removed :]
    path.write_bytes(data)
    assert all(each == ROWS[each.run] for each in rows_or_error(path))


def rows_or_error(path: Path) -> list[Row]:
    """The rows of a journal. Empty if there is an error with a place."""
    notes: list[str] = []
    try:
        with notes_sent_to(notes.append), Journal(path, PLAN) as journal:
            return list(journal.rows())
    except KbotError as error:
        notes.append(str(error))
        return []
    finally:
        assert all(re.match(rf"{re.escape(str(path))}:\d+:\d+: ", note) for note in notes)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    key=st.sampled_from([*json.loads(journal_module._line(ROWS[0])), "more"]),
    value=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
        max_leaves=4,
    ),
)
def test_a_value_of_any_kind_has_no_other_result(key: str, value: object, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    first = {**json.loads(journal_module._line(ROWS[0])), key: value}
    path.write_bytes(json.dumps(first).encode() + b"\n" + journal_module._line(ROWS[1]))
    assert all(each == ROWS[each.run] for each in rows_or_error(path))


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match=r"runs\.jsonl cannot be read or written: No such file"):
        Journal(tmp_path / "missing" / "runs.jsonl", PLAN)


@pytest.mark.parametrize("end", [b"", b"\n"])
def test_a_line_that_is_far_longer_than_a_run_is_refused(end: bytes, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, PLAN) as journal:
        journal.append(row(0))
    with path.open("ab") as file:
        file.truncate(path.stat().st_size + 5_000_000_000)  # sparse: it takes no space
        file.seek(0, os.SEEK_END)
        file.write(end)
    size = path.stat().st_size
    with pytest.raises(KbotError) as raised:
        Journal(path, PLAN)
    assert str(raised.value) == (
        f"{path}:2:1: the line is not a run of a sweep: it is longer than 1,000,000 bytes. "
        "Delete this line, or choose another folder with --out"
    )
    assert path.stat().st_size == size


def test_empty_lines_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    path.write_bytes(b"\n" * 20_000 + journal_module._line(row(1)) + b"\n")
    notes: list[str] = []
    with notes_sent_to(notes.append), Journal(path, PLAN) as journal:
        journal.append(row(0))
        assert list(journal.rows()) == [row(0), row(1)]
    assert notes == []


def test_a_file_with_many_lines_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    path.write_bytes(b"x\n" * 10_001)
    with pytest.raises(KbotError) as raised:
        Journal(path, PLAN)
    assert str(raised.value) == (
        f"{path}:1:1: it is not JSON. More than 10,000 lines are not runs of this sweep. Delete them, or "
        "choose another folder with --out"
    )


@pytest.mark.parametrize("change", ["cut", "bytes", "other row", "other value"])
def test_a_file_that_is_edited_during_the_sweep_is_an_error(change: str, tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, PLAN) as journal:
        journal.append(row(0, energy=1.5))
        data = path.read_bytes()
        changed = {
            "cut": b"",
            "bytes": b"\0" * len(data),
            "other row": journal_module._line(row(2, energy=1.5)),
            "other value": data.replace(b"1.5", b"1.6"),
        }
        path.write_bytes(changed[change])
        for read in (lambda: journal.row(0), lambda: list(journal.rows())):
            with pytest.raises(KbotError) as raised:
                read()
            assert str(raised.value) == (
                f"{path}: the line of run 0 was changed during the sweep. Run the same command again"
            )


def test_a_long_reason_can_be_read_again(tmp_path: Path) -> None:
    path = tmp_path / "runs.jsonl"
    with Journal(path, PLAN) as journal:
        journal.append(replace(row(1), reason="x" * 2_000_000))
    with Journal(path, PLAN) as journal:
        assert journal.count == 1
