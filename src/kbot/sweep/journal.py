"""The record of finished runs: one line of JSON each, which survives every interruption.

A line that is not a row, as after a loss of power, is reported and ignored. Its run is executed again. A row
that was edited, or that has another run than the plan, is an error: its result may be any other one.
"""

from __future__ import annotations

import os
import time
import zlib
from array import array
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Protocol

import orjson

from kbot.sweep.space import LARGEST, Values
from kbot.text import KbotError, Source
from kbot.text.notes import note
from kbot.text.render import encodable, printable
from kbot.text.yaml import YamlError, read_yaml

NEWLINE = b"\n"
_CHECKSUM = b',"crc32":"%08x"}\n'
"""The end of each line: the CRC-32 of all before it. It differs after each edit of up to 32 adjacent bits,
and after all but one of four billion other edits."""
DELETE = "Delete this line to run it again, or choose another folder with --out"
"""What to do about a line that is not what KBot wrote."""
LONGEST_LINE = 1_000_000
"""Bytes of a line that is read. A run has a few thousand."""
_LONGEST_REASON = 10_000
"""Characters of a reason that are recorded. A program may raise a text of any length."""
_MOST_IGNORED = 10_000
"""Lines that are not a run. A loss of power leaves one or two. Each takes time, at every start."""
SYNC_SECONDS = 1.0
"""The disk has all runs but those of the last second, even after a loss of power. A killed process loses none
of them."""


@dataclass(frozen=True, slots=True)
class Row:
    """A finished run.

    run           its number
    design        the number of its combination of values
    values        one for each dimension, in the order of `Space.dimensions`, with the units of the files in
                  which the names are defined
    scenario      the scenario's name
    seed          of the simulation
    passed        whether all expectations are met
    reason        why it failed; None only if it passed
    state_sha256  digest of the last state; empty if there is none
    measures      the values of all measures by name, in the units of `kbot.trials.measures`; None where the
                  run does not show one, which is NaN before it is recorded
    """

    run: int
    design: int
    values: Values
    scenario: str
    seed: int
    passed: bool
    reason: str | None
    state_sha256: str
    measures: Mapping[str, float | None]


class PlannedRuns(Protocol):
    """The runs of a sweep, as its plan has them."""

    @property
    def runs(self) -> int:
        """The number of runs."""
        ...

    def difference(self, row: Row) -> tuple[str, ...] | None:
        """How a row differs from what its run executes, with the path of the value that differs."""
        ...


class Journal:
    """The file of finished runs."""

    def __init__(self, path: Path, plan: PlannedRuns) -> None:
        """Open the file of a sweep, or create it.

        Raises:
            KbotError: it cannot be read or written, or a row was edited or is not of this plan.
        """
        self.path, self._plan = path, plan
        self.count = 0
        """The number of finished runs."""
        self.measures: dict[str, None] = {}
        """The names of the measures of all runs, in the order in which they were first seen."""
        self._offsets = array("q")
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
            self._end = self._read()
            self._cut()
        except OSError as error:
            raise KbotError(f"{path} cannot be read or written: {error.strerror}") from None
        self._synced = time.monotonic()

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(OSError):  # what could be written is written
            os.fsync(self._file)
        os.close(self._file)

    def __contains__(self, run: int) -> bool:
        return run < len(self._offsets) and self._offsets[run] >= 0

    def append(self, row: Row) -> None:
        """Record a finished run.

        Raises:
            KbotError: the disk is full, or the file cannot be written. The file is as before.
        """
        # a user's program may raise any text
        reason = None if row.reason is None else encodable(row.reason[:_LONGEST_REASON])
        line = _line(replace(row, reason=reason, scenario=encodable(row.scenario)))
        try:
            self._write(line)
        except OSError as error:
            with suppress(OSError):
                self._cut()
            raise KbotError(
                f"{self.path} cannot be written: {error.strerror}. Finished runs are kept ({self.count}). "
                "Run the same command again to continue"
            ) from None
        except KeyboardInterrupt:
            if os.fstat(self._file).st_size == self._end + len(line):  # it came after the last byte
                self._count(row, line)
            else:
                self._cut()
            raise
        self._count(row, line)

    def _count(self, row: Row, line: bytes) -> None:
        self._add(row.run, self._end, row.measures)
        self._end += len(line)

    def rows(self) -> Iterator[Row]:
        """The finished runs in the order of their numbers. Raises KbotError: someone has edited the file."""
        with self.path.open("rb") as file:
            for run, offset in enumerate(self._offsets):
                if offset >= 0:
                    yield self._row_at(file, run)

    def row(self, run: int) -> Row:
        """A finished run.

        Raises:
            KeyError: it is not finished.
            KbotError: someone has edited the file.
        """
        if run not in self:
            raise KeyError(run)
        with self.path.open("rb") as file:
            return self._row_at(file, run)

    def _row_at(self, file: IO[bytes], run: int) -> Row:
        """The row of a run, which was checked when its place was recorded."""
        file.seek(self._offsets[run])
        line = file.readline(LONGEST_LINE + 1)
        try:
            found = _row(line)
            if found.run == run and line == _line(found):
                return found
        except _Fault:
            pass  # the same as another row there
        raise KbotError(
            f"{self.path}: the line of run {run} was changed during the sweep. Run the same command again"
        )

    def place(self, run: int, *keys: str) -> str:
        """The file, line and column of a value of a finished run."""
        with self.path.open("rb") as file:
            number = 1
            while file.tell() < self._offsets[run]:
                number += file.readline().endswith(NEWLINE)
            return self._place(number, file.readline(), *keys)

    def _write(self, line: bytes) -> None:
        rest = line
        while rest:
            rest = rest[os.write(self._file, rest) :]
        if time.monotonic() - self._synced > SYNC_SECONDS:
            os.fsync(self._file)
            self._synced = time.monotonic()

    def _read(self) -> int:
        """Find the rows. Returns where the next one begins: after the last complete line.

        Raises:
            KbotError: a line is far longer than a run, was edited, or is not of this plan.
        """
        offset = 0
        ignored, first = 0, ""
        with self.path.open("rb") as file:
            for number, line in enumerate(iter(partial(file.readline, LONGEST_LINE + 1), b""), 1):
                if line == NEWLINE:  # nothing is lost
                    offset += len(line)
                    continue
                if len(line) > LONGEST_LINE:
                    raise KbotError(
                        f"{self.path}:{number}:1: the line is not a run of a sweep: it is longer than "
                        f"{LONGEST_LINE:,} bytes. Delete this line, or choose another folder with --out"
                    )
                if not line.endswith(NEWLINE):
                    break
                try:
                    row = self._checked(line)
                    self._add(row.run, offset, row.measures)
                except _Fault as error:
                    ignored += 1
                    if ignored > _MOST_IGNORED:
                        raise KbotError(
                            f"{first}. More than {_MOST_IGNORED:,} lines are not runs of this sweep. Delete "
                            "them, or choose another folder with --out"
                        ) from None
                    if ignored == 1 or error.is_row:
                        place = self._place(number, line, *error.keys, column=error.column)
                        first = f"{place}: {error}"
                    if error.is_row:
                        raise KbotError(f"{first}. {DELETE}") from None
                offset += len(line)
        if ignored:
            more = f", and so are {ignored - 1} more" if ignored > 1 else ""
            note(f"{first}. The line is not a run of this sweep and is ignored{more}")
        return offset

    def _checked(self, line: bytes) -> Row:
        """The row of a line. Raises _Fault."""
        row = _row(line)
        if not 0 <= row.run < self._plan.runs:
            raise _Fault(f"the sweep has {self._plan.runs} runs, and no run {row.run}", "run")
        if row.run in self:
            raise _Fault(f"run {row.run} is recorded twice", "run", is_row=True)
        difference = self._plan.difference(row)
        if difference:
            raise _Fault(*difference, is_row=True)
        if line != _line(row):
            raise _Fault(f"the line of run {row.run} was changed after it was written", is_row=True)
        return row

    def _place(self, number: int, line: bytes, *keys: str, column: int = 1) -> str:
        """The place of a value in a line, or else of a column."""
        with suppress(YamlError):
            if keys:  # JSON is YAML, whose reader knows the places of values
                text = line.decode("utf-8", "replace")
                column = read_yaml(Source("", text)).span(*keys).column
        return f"{self.path}:{number}:{column}"

    def _cut(self) -> None:
        """Remove what follows the last complete line, and write there next."""
        os.ftruncate(self._file, self._end)
        os.lseek(self._file, self._end, os.SEEK_SET)

    def _add(self, run: int, offset: int, measures: Mapping[str, float | None]) -> None:
        if run >= len(self._offsets):
            self._offsets.extend([-1] * (run + 1 - len(self._offsets)))
        self._offsets[run] = offset
        self.count += 1
        for name in measures:
            self.measures.setdefault(name)


class _Fault(Exception):
    """A line is not a row. If `is_row`, it is one, but not the one that KBot wrote.

    The message has the reason. `keys` is the path of the wrong value, or `column` the place in the line.
    """

    def __init__(self, problem: str, *keys: str, is_row: bool = False, column: int = 1) -> None:
        super().__init__(problem)
        self.keys, self.is_row, self.column = keys, is_row, column


def _line(row: Row) -> bytes:
    text = orjson.dumps(row).removesuffix(b"}")
    return text + _CHECKSUM % zlib.crc32(text)


_TYPES: dict[str, tuple[type, ...]] = {
    "run": (int,),
    "design": (int,),
    "values": (list,),
    "scenario": (str,),
    "seed": (int,),
    "passed": (bool,),
    "reason": (str, type(None)),
    "state_sha256": (str,),
    "measures": (dict,),
    "crc32": (str,),
}
"""The keys of a line, and the types of their values. `True` is not an integer here."""


def _row(line: bytes) -> Row:
    """The row of a line. Raises _Fault: it has other keys, or values of other types."""
    try:
        found: Any = orjson.loads(line)
    except orjson.JSONDecodeError as error:
        raise _Fault("it is not JSON", column=error.colno) from None
    if not isinstance(found, dict):
        raise _Fault("it is not an object of JSON")
    for key in (*_TYPES, *found):
        if key not in found:
            raise _Fault(f"'{key}' is missing")
        if key not in _TYPES:
            raise _Fault(f"unknown key '{printable(key)[:50]}'", key)
        if type(found[key]) not in _TYPES[key]:
            raise _Fault(f"'{key}' has the wrong type", key)
    for key in ("run", "design", "seed"):
        if abs(found[key]) > LARGEST:
            raise _Fault(f"'{key}' has more than 64 bits", key)
    for index, value in enumerate(found["values"]):
        if type(value) not in (int, float, str):
            raise _Fault("a value is neither a number nor a text", "values", str(index))
    for name, value in found["measures"].items():
        if type(value) not in (int, float, type(None)):
            raise _Fault("the value of a measure is not a number", "measures", name)
    if found["passed"] != (found["reason"] is None):
        raise _Fault("'passed' and 'reason' contradict each other", "reason")
    return Row(
        **{key: value for key, value in found.items() if key != "crc32"} | {"values": tuple(found["values"])}
    )
