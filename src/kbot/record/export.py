"""A topic of a recording as a table: one row a message, one column a number or text."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Iterator

from kbot.record.reader import Recording
from kbot.text import KbotError

Cell = float | int | str | bool


def to_csv(path: str, topic: str) -> str:
    """The topic as CSV. The first column is `time` in seconds; a list's entries are numbered, those of
    joint states named by joint. Numbers are written so that they read back the same.

    Raises:
        KbotError: no such recording or topic, or its messages cannot be read.
    """
    columns, rows = _table(path, topic)
    text = io.StringIO()
    table = csv.DictWriter(text, columns, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def to_parquet(path: str, topic: str) -> bytes:
    """The same table as an Apache Parquet file, compressed; by the extra `parquet`.

    Raises:
        KbotError: as `to_csv`, or the extra is not installed.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError:
        raise KbotError("Parquet needs an extra: pip install 'kbot[parquet]'") from None
    columns, rows = _table(path, topic)
    table = pyarrow.table({name: [row.get(name) for row in rows] for name in columns})
    buffer = io.BytesIO()
    parquet.write_table(table, buffer, compression="zstd")
    return buffer.getvalue()


def _table(path: str, topic: str) -> tuple[list[str], list[dict[str, Cell]]]:
    recording = Recording(path)
    recording.require_topics((topic,))
    rows: list[dict[str, Cell]] = []
    columns: dict[str, None] = {"time": None}
    for entry in recording.entries():
        if entry.topic == topic:
            row: dict[str, Cell] = {"time": entry.nanoseconds * 1e-9, **dict(_cells(entry.message(), ""))}
            columns.update(dict.fromkeys(row))
            rows.append(row)
    if not rows:
        raise KbotError(f"{path} holds no messages on {topic}")
    return list(columns), rows


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
    items = values.tolist() if hasattr(values, "tolist") else values
    if not isinstance(items, list):
        yield name, items if isinstance(items, int | float | str) else str(items)
        return
    for index, item in enumerate(items):
        label = labels[index] if labels is not None and index < len(labels) else str(index)
        yield from _cells(item, f"{name}.{label}")
