"""The record of finished runs: one line of JSON each, which survives every interruption.

A line that is not a row of the sweep, as after a loss of power or an edit, is reported and ignored. Its run
is executed again.
"""

from __future__ import annotations

import os
import time
from array import array
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

import orjson

from kbot.sweep.space import Value, Values
from kbot.text import KbotError
from kbot.text.notes import note
from kbot.text.render import encodable

NEWLINE = b"\n"
LONGEST_LINE = 1_000_000
"""Bytes of a line that is read. A run has a few thousand."""
_LONGEST_REASON = 10_000
"""Characters of a reason that are recorded. A program may raise a text of any length."""
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


class Journal:
    """The file of finished runs."""

    def __init__(self, path: Path, runs: int) -> None:
        """Open the file of a sweep with this number of runs, or create it.

        Raises:
            KbotError: it cannot be read or written.
        """
        self.path, self._runs = path, runs
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
        line = orjson.dumps(replace(row, reason=reason, scenario=encodable(row.scenario))) + NEWLINE
        try:
            self._write(line)
        except OSError as error:
            with suppress(OSError):
                self._cut()
            raise KbotError(
                f"{self.path} cannot be written: {error.strerror}. Finished runs are kept ({self.count}). "
                "Run the same command again to continue"
            ) from None
        self._add(row.run, self._end, row.measures)
        self._end += len(line)

    def rows(self) -> Iterator[Row]:
        """The finished runs in the order of their numbers."""
        with self.path.open("rb") as file:
            for offset in self._offsets:
                if offset >= 0:
                    file.seek(offset)
                    yield _row(file.readline())

    def row(self, run: int) -> Row:
        """A finished run. Raises KeyError: it is not finished."""
        if run not in self:
            raise KeyError(run)
        with self.path.open("rb") as file:
            file.seek(self._offsets[run])
            return _row(file.readline())

    def place(self, run: int) -> str:
        """The file and line of a finished run."""
        return f"{self.path}:{self.path.read_bytes()[: self._offsets[run]].count(NEWLINE) + 1}"

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
            KbotError: a line is far longer than a run.
        """
        offset = 0
        ignored: list[int] = []
        with self.path.open("rb") as file:
            for number, line in enumerate(iter(partial(file.readline, LONGEST_LINE + 1), b""), 1):
                if len(line) > LONGEST_LINE:
                    raise KbotError(
                        f"{self.path}:{number} is not a run of a sweep: it is longer than {LONGEST_LINE} "
                        "bytes. Delete this line, or choose another folder with --out"
                    )
                if not line.endswith(NEWLINE):
                    break
                row = None
                with suppress(orjson.JSONDecodeError, KeyError, TypeError):
                    row = _row(line)
                if row is not None and self._is_valid(row) and row.run not in self:
                    self._add(row.run, offset, row.measures)
                else:
                    ignored.append(number)
                offset += len(line)
        if ignored:
            more = f", and {len(ignored) - 1} more of its lines," if len(ignored) > 1 else ""
            note(f"{self.path}:{ignored[0]}{more} is not a run of this sweep. It is ignored")
        return offset

    def _cut(self) -> None:
        """Remove what follows the last complete line, and write there next."""
        os.ftruncate(self._file, self._end)
        os.lseek(self._file, self._end, os.SEEK_SET)

    def _is_valid(self, row: Row) -> bool:
        """Whether a row has values of the right types that agree, and the number of a run of the sweep."""
        numbers = (row.run, row.design, row.seed)
        texts = (row.scenario, row.state_sha256, "" if row.reason is None else row.reason)
        return (
            all(type(each) is int for each in numbers)
            and all(isinstance(each, str) for each in texts)
            and isinstance(row.passed, bool)
            and row.passed == (row.reason is None)
            and isinstance(row.measures, dict)
            and all(each is None or isinstance(each, int | float) for each in row.measures.values())
            and all(isinstance(each, int | float | str) for each in row.values)
            and 0 <= row.run < self._runs
        )

    def _add(self, run: int, offset: int, measures: Mapping[str, float | None]) -> None:
        if run >= len(self._offsets):
            self._offsets.extend([-1] * (run + 1 - len(self._offsets)))
        self._offsets[run] = offset
        self.count += 1
        for name in measures:
            self.measures.setdefault(name)


def _row(line: bytes) -> Row:
    found: dict[str, Any] = orjson.loads(line)
    values: list[Value] = found["values"]
    return Row(**{**found, "values": tuple(values)})
