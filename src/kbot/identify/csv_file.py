"""Reads logs in CSV files: one row an interval, with a header."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from typing import NoReturn

import numpy as np

from kbot.identify.log import Array, DriveLog, held, jumps_ahead
from kbot.text import KbotError
from kbot.text.files import read_source
from kbot.text.notes import note
from kbot.text.numbers import to_float
from kbot.text.suggest import did_you_mean

WHEELS = ("left_wheel_velocity", "right_wheel_velocity")
DISPLACEMENT = ("displacement_x", "displacement_y", "displacement_yaw")
POSE = ("pose_x", "pose_y", "pose_yaw")
COMMANDS = ("cmd_v", "cmd_w")
GYRO = "imu_wz"
COLUMNS = ("duration", "time", *WHEELS, *DISPLACEMENT, *POSE, *COMMANDS, GYRO)

_LARGEST, _LATEST = 1e6, 1e12
"""Largest number in SI units, and largest time in s: times since 1970 are about 2e9 s."""


def read_csv(path: str) -> DriveLog:
    """Read a log. Raises KbotError with file, line and column: the file is not a log."""
    return _Reader(path).read()


class _Reader:
    """One pass over a file. `_lines` are the line numbers of the rows."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._lines: list[int] = []

    def read(self) -> DriveLog:
        text = read_source(self._path).text
        lines = text.splitlines()
        if not lines or not lines[0].strip():
            self._fail(1, 1, f"the header is missing. The first line names the columns, such as {WHEELS[0]}")
        names = [_bare(cell) for cell in lines[0].split(",")]
        self._check_header(lines[0], names)
        used = {name: index for index, name in enumerate(names) if name in COLUMNS}
        numbers = array("d")  # a list of numbers needs several times the memory
        for number, line in enumerate(lines[1:], 2):
            if line.strip():
                numbers.extend(self._row(number, line, names, used))
        if not self._lines:
            self._fail(1, 1, "the log has no rows below its header")
        table = np.array(numbers).reshape(len(self._lines), -1)
        columns = {name: table[:, index] for index, name in enumerate(used)}
        durations = columns["duration"] if "duration" in columns else self._passed(columns["time"])

        def together(wanted: Sequence[str]) -> Array:
            absent = np.full(len(table), np.nan)
            return np.column_stack([columns.get(name, absent) for name in wanted])

        return DriveLog(
            path=self._path,
            durations=durations,
            wheel_speeds=together(WHEELS),
            displacements=together(DISPLACEMENT),
            poses=together(POSE),
            commands=np.column_stack([_held(column) for column in together(COMMANDS).T]),
            gyro=together([GYRO])[:, 0],
        )

    def _check_header(self, line: str, names: Sequence[str]) -> None:
        """Fail if a column is missing or occurs twice, or if the reference is given twice."""
        for index, name in enumerate(names):
            if name in COLUMNS and name in names[:index]:
                self._fail(1, _column(line, index), f"the column '{name}' occurs twice")
        for mark, shown in ((";", "';'"), ("\t", "tabs")):
            if len(names) == 1 and mark in line:
                self._fail(1, 1, f"the columns are separated by {shown}. Separate them by ','")
        time = ("duration",) if "duration" in names or "time" not in names else ("time",)
        has_poses = any(name in names for name in POSE)
        if has_poses and any(name in names for name in DISPLACEMENT):
            at = next(index for index, name in enumerate(names) if name in POSE)
            self._fail(
                1, _column(line, at), "the log has both displacements and poses. Remove the columns of one"
            )
        needed = [*time, *WHEELS, *(POSE if has_poses else DISPLACEMENT)]
        if any(name in names for name in COMMANDS):
            needed += COMMANDS
        for name in needed:
            if name not in names:
                others = [other for other in names if other not in COLUMNS]
                near = next((other for other in others if did_you_mean(other, [name])), None)
                at = _column(line, names.index(near)) if near is not None else 1
                self._fail(1, at, self._missing(name, near, names))
        unused = [name or "(no name)" for name in names if name not in COLUMNS]
        if unused:
            note(f"{self._path}:1: columns that are not used: {', '.join(unused)}")

    def _missing(self, name: str, near: str | None, names: Sequence[str]) -> str:
        what = f"the column '{name}' is missing"
        if near is not None:
            return f"{what}. '{near}': did you mean '{name}'?"
        if name == "duration":
            what = "the log has neither 'duration' nor 'time'"
        elif name == DISPLACEMENT[0] and not any(other in names for other in DISPLACEMENT):
            what = f"the log has no reference: add {', '.join(DISPLACEMENT)}, or {', '.join(POSE)}"
        listed = ", ".join(other for other in names[:12] if other)
        return f"{what}. The header has {listed or 'no names'}"

    def _row(self, number: int, line: str, names: Sequence[str], used: Mapping[str, int]) -> list[float]:
        """The numbers of the used columns, NaN for empty cells."""
        cells = line.split(",")
        if len(cells) != len(names):
            self._fail(number, 1, f"the row has {len(cells)} cells, and the header {len(names)}")
        self._lines.append(number)
        values = []
        for name, index in used.items():
            text = _bare(cells[index])
            if not text:
                values.append(math.nan)
                continue
            try:
                value = to_float(text)
            except ValueError:
                self._fail(number, _column(line, index), f"{name} is not a number: '{text[:40]}'")
            if not math.isfinite(value):
                self._fail(
                    number,
                    _column(line, index),
                    f"{name} is {text}. Leave the cell empty if the value is absent",
                )
            largest = _LATEST if name == "time" else _LARGEST
            if abs(value) > largest:
                self._fail(
                    number,
                    _column(line, index),
                    f"{name} is {text}: the largest accepted value is {largest:g}. Check the unit",
                )
            if name == "duration" and value <= 0.0:
                self._fail(number, _column(line, index), f"the duration must be above 0 s, not {text}")
            values.append(value)
        return values

    def _passed(self, times: Array) -> Array:
        """The durations of rows with the time at their end. That of the first row is unknown."""
        for index in np.flatnonzero(~np.isfinite(times)):
            self._fail(self._lines[index], 1, "the time is missing")
        durations = np.diff(times, prepend=np.nan)
        for index in np.flatnonzero(durations <= 0.0):
            before, now = times[index - 1], times[index]
            self._fail(
                self._lines[index],
                1,
                f"the clock jumps back or stops: {before:.12g} s, then {now:.12g} s. Sort the rows by time, "
                "remove repeated ones, or split the log at this line",
            )
        for index in jumps_ahead(times) + 1:
            self._fail(
                self._lines[index],
                1,
                f"the clock jumps ahead by {durations[index]:.6g} s. Split the log at this line",
            )
        return durations

    def _fail(self, line: int, column: int, text: str) -> NoReturn:
        raise KbotError(f"{self._path}:{line}:{column}: {text}")


def _held(column: Array) -> Array:
    """The last number at or above each row: an empty cell does not end a command."""
    rows, is_given = np.arange(len(column), dtype=float), np.isfinite(column)
    return held(rows[is_given], column[is_given], rows)


def _bare(cell: str) -> str:
    """A cell without surrounding spaces and quotation marks."""
    return cell.strip().strip('"').strip()


def _column(line: str, index: int) -> int:
    """The column (1-based) at which the text of a cell begins."""
    cells = line.split(",")
    before = sum(len(cell) + 1 for cell in cells[:index])
    return before + len(cells[index]) - len(cells[index].lstrip()) + 1
