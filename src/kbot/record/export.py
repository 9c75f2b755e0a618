"""Exports a topic of a recording as a table: a row for each message, a column for each field."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from kbot.record.limits import size_on_disk
from kbot.record.reader import Recording
from kbot.text import KbotError
from kbot.text.extras import needs_extra
from kbot.text.suggest import did_you_mean

Cell = float | int | str | bool
TIME = "time"
FREE_CELLS, CELLS_OF_A_BYTE = 1_000_000, 4
"""Limit on the values of a table: 1,000,000, which take 2 s, plus 4 for each byte of the recording. A long
list of zeros compresses to almost nothing but makes one column per entry."""


@dataclass(frozen=True)
class MessageTable:
    """The messages of a topic as a table.

    The first column is `time` in seconds. The entries of a list are columns with a number, those of joint
    states with the joint's name. Bytes, such as images, are one column in Base64.
    """

    topic: str
    columns: tuple[str, ...]
    rows: tuple[Mapping[str, Cell], ...]

    @classmethod
    def of(cls, path: str, topic: str) -> MessageTable:
        """Read a topic. Raises KbotError: there is no such recording or topic, or a message cannot be
        read."""
        recording = Recording(path)
        (topic,) = recording.require_topics((topic,))
        rows: list[dict[str, Cell]] = []
        columns: dict[str, None] = {TIME: None}
        left = most = FREE_CELLS + CELLS_OF_A_BYTE * size_on_disk(Path(path))
        for entry in recording.entries():
            if entry.topic == topic:
                row: dict[str, Cell] = {TIME: entry.nanoseconds / 1e9}
                row.update(islice(_cells(entry.message(), ""), left + 1))
                left -= len(row)
                if left < 0:
                    raise KbotError(f"{path}: {topic} has too many values for a table (limit: {most:,})")
                columns.update(dict.fromkeys(row))
                rows.append(row)
        if not rows:
            raise KbotError(f"{path} has no messages on {topic}")
        return cls(topic, tuple(columns), tuple(rows))

    def only(self, names: Sequence[str]) -> MessageTable:
        """The table with only these columns and the time, or all if `names` is empty.

        Raises:
            KbotError: a column does not exist.
        """
        for name in names:
            if name not in self.columns:
                hint = did_you_mean(name, self.columns)
                reason = hint or f"fields that change: {', '.join(self.numbers) or 'none'}"
                raise KbotError(f"{self.topic} has no field {name}: {reason}")
        return replace(self, columns=(TIME, *dict.fromkeys(names))) if names else self

    @property
    def numbers(self) -> tuple[str, ...]:
        """The numeric columns whose values change."""
        return tuple(
            name
            for name in self.columns
            if name != TIME
            and not any(isinstance(row.get(name), str) for row in self.rows)
            and len({row.get(name) for row in self.rows}) > 1
        )

    @property
    def times(self) -> list[float]:
        """Seconds of the recording's clock."""
        return [float(row[TIME]) for row in self.rows]

    def column(self, name: str) -> list[float | None]:
        """The numbers of a column, None for a missing value. Raises KbotError: the column is text."""
        values: list[float | None] = []
        for row in self.rows:
            value = row.get(name)
            if isinstance(value, str):
                raise KbotError(f"{name} of {self.topic} is text: only numbers can be plotted")
            values.append(None if value is None or not math.isfinite(value) else float(value))
        return values

    def csv(self) -> str:
        """The table as CSV. Numbers are written with all digits, so that reading gives the same value."""
        text = io.StringIO()
        table = csv.DictWriter(text, self.columns, lineterminator="\n", extrasaction="ignore")
        table.writeheader()
        table.writerows(self.rows)
        return text.getvalue()

    def parquet(self) -> bytes:
        """The table as a compressed Apache Parquet file. Needs the extra `parquet`.

        Raises:
            KbotError: the extra is not installed.
        """
        try:
            import pyarrow  # an extra
            from pyarrow import parquet
        except ModuleNotFoundError:
            raise KbotError(needs_extra("Parquet", "parquet")) from None
        table = pyarrow.table({name: [row.get(name) for row in self.rows] for name in self.columns})
        buffer = io.BytesIO()
        parquet.write_table(table, buffer, compression="zstd")
        return buffer.getvalue()


def _cells(value: object, name: str) -> Iterator[tuple[str, Cell]]:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            f.name: getattr(value, f.name) for f in dataclasses.fields(value) if f.name != "__msgtype__"
        }
        names = fields.get("name")
        by_joint = isinstance(names, list) and {"position", "velocity", "effort"} <= fields.keys()
        for key, part in fields.items():
            if by_joint and key == "name":
                continue
            label = f"{name}.{key}" if name else key
            yield from _list(part, label, names) if by_joint and key != "header" else _cells(part, label)
    elif isinstance(value, str | bool | int | float):
        yield name, value
    else:
        yield from _list(value, name, None)


def _list(values: object, name: str, labels: list[str] | None) -> Iterator[tuple[str, Cell]]:
    if isinstance(values, np.ndarray) and values.dtype == np.uint8:
        yield name, b64encode(values.tobytes()).decode()
        return
    if not isinstance(values, list | np.ndarray):
        yield name, values if isinstance(values, int | float | str) else str(values)
        return
    # one number at a time, because a list of all would take four times the memory of the array
    items = map(np.generic.item, values) if isinstance(values, np.ndarray) else values
    for index, item in enumerate(items):
        label = labels[index] if labels is not None and index < len(labels) else str(index)
        yield from _cells(item, f"{name}.{label}")
