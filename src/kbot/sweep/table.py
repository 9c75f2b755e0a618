"""The table of a sweep as Apache Parquet: one row for each finished run, in the order of the runs.

Nothing in the table depends on when, where or in which order the runs were executed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kbot.sweep.journal import Journal, Row
from kbot.sweep.plan import Plan
from kbot.sweep.space import Dimension
from kbot.text import KbotError
from kbot.text.files import scratch_folder
from kbot.trials.measures import measures

if TYPE_CHECKING:
    import pyarrow

RUN_COLUMNS = ("run", "design", "scenario", "seed", "passed", "reason", "state_sha256")
"""The columns of each run. The values of its design follow `design`, and the measures are last."""
_ROWS = 2000
"""Rows that are written at once, so that memory does not depend on the length of the table."""


def write_table(path: Path, plan: Plan, journal: Journal) -> None:
    """Write the finished runs of a journal: all of the table or nothing.

    Raises:
        KbotError: the file cannot be written.
    """
    from pyarrow import parquet  # slow to import

    names = measure_columns(journal.measures)
    schema = _schema(plan, names)
    try:
        with scratch_folder(path) as scratch:
            with (
                Path(scratch).open("wb") as file,  # pyarrow takes a path for a URI, and only paths in UTF-8
                parquet.ParquetWriter(file, schema, compression="zstd") as writer,
            ):
                for rows in _chunks(journal.rows()):
                    writer.write_batch(_batch(rows, schema, plan))
            Path(scratch).replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise KbotError(f"{path} cannot be written: {reason}. {journal.path} has all finished runs") from None


def column_of(dimension: Dimension) -> str:
    """The column of a dimension: its name, or `set.NAME` if a column of the runs has this name."""
    taken = {*RUN_COLUMNS, *measures()} - {"seed"}
    return f"set.{dimension.name}" if dimension.name in taken else dimension.name


def measure_columns(names: Iterable[str]) -> list[str]:
    """The measures in the order of their columns, which does not depend on that of the runs."""
    order = {name: index for index, name in enumerate(measures())}
    return sorted(names, key=lambda name: (order.get(name, len(order)), name))


def _schema(plan: Plan, names: Iterable[str]) -> pyarrow.Schema:
    import pyarrow

    kinds = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
    fields = [("run", pyarrow.int64()), ("design", pyarrow.int64())]
    fields += [(column_of(each), kinds[each.kind]) for each in plan.space.dimensions if each.name != "seed"]
    fields += [("scenario", pyarrow.string()), ("seed", pyarrow.int64()), ("passed", pyarrow.bool_())]
    fields += [("reason", pyarrow.string()), ("state_sha256", pyarrow.string())]
    fields += [(name, pyarrow.float64()) for name in names]
    return pyarrow.schema(fields)


def _chunks(rows: Iterator[Row]) -> Iterator[list[Row]]:
    while chunk := list(islice(rows, _ROWS)):
        yield chunk


def _batch(rows: list[Row], schema: pyarrow.Schema, plan: Plan) -> pyarrow.RecordBatch:
    import pyarrow

    columns: dict[str, list[Any]] = {name: [getattr(row, name) for row in rows] for name in RUN_COLUMNS}
    for index, dimension in enumerate(plan.space.dimensions):
        columns.setdefault(column_of(dimension), [dimension.kind(row.values[index]) for row in rows])
    for name in schema.names:
        if name not in columns:
            found = [row.measures.get(name) for row in rows]
            columns[name] = [None if value is None else float(value) for value in found]
    arrays = [pyarrow.array(columns[field.name], field.type) for field in schema]
    return pyarrow.record_batch(arrays, schema=schema)
