"""Reads rosbag2's SQLite files. https://github.com/ros2/rosbag2/tree/rolling/rosbag2_storage_sqlite3"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from io import SEEK_END
from pathlib import Path
from typing import Any

from kbot.record.encodings.quality import latches
from kbot.record.entry import RecordedMessage, Types
from kbot.record.limits import LARGEST_PIECE, Allowance, RecordingTooLarge, check_names, size_on_disk

AT_ONCE = 1000
"""Messages read in one query while another program may still write the file, so that it waits only
briefly."""
_BYTES_AT_ONCE = 1 << 26
"""Bytes of these messages, so that 1000 images are not in memory at once. Ten images of 1920 x 1080 pixels
fit."""
_LARGEST_TIME = (1 << 63) - 1

_STEP = 100_000
_FREE_STEPS = 50_000_000
_STEPS_OF_A_BYTE = 20
"""Limit on the instructions of SQLite's virtual machine for one query: about a second of them, plus some for
each byte of the file. A malicious file can list the same page any number of times."""

_END_OF_NAME = bytes.fromhex("d9d505f920a163d7")
"""The end of a journal that names a second journal. https://www.sqlite.org/fileformat2.html"""

_CHECKED = "topics", "messages", "message_definitions"
_AFTER = (
    "SELECT messages.id, topic_id, timestamp, data FROM messages WHERE messages.id > ? "
    "ORDER BY messages.id LIMIT ?"
)

Row = tuple[int, Any, Any, Any]  # Any: SQLite gives each column its own type
"""Message id, topic id, time and bytes. SQLite does not enforce the types of columns."""


class SqliteFile:
    """One file, open until `close`. `topics` are names and types by topic id."""

    def __init__(self, file: Path, types: Types, *, is_closed: bool) -> None:
        """Open the file. With `is_closed` false it is opened for writing, so that SQLite removes uncommitted
        data.

        Raises:
            sqlite3.Error, ValueError: it is not a SQLite file of rosbag2.
            RecordingTooLarge: its names are too long, or it has too many definitions.
        """
        if not is_closed:
            _check_journal(file)
        mode = "mode=ro&immutable=1" if is_closed else "mode=rw"
        self._types, self._steps = types, 0
        self._qos: dict[int, str] = {}
        """The quality of service by topic id, in rosbag2's YAML."""
        self._most_steps = _FREE_STEPS + _STEPS_OF_A_BYTE * size_on_disk(file)
        self._database = sqlite3.connect(
            f"{file.absolute().as_uri()}?{mode}", uri=True, check_same_thread=False
        )
        try:
            self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_PIECE)
            self._database.set_progress_handler(self._is_spent, _STEP)
            self.topics = self._read_topics(self._read_tables())
        except (sqlite3.Error, ValueError, RecordingTooLarge):
            self.close()
            raise

    def close(self) -> None:
        self._database.close()

    @property
    def latched(self) -> set[str]:
        """The topics that kept their last message for late subscribers."""
        return {topic for number, (topic, _) in self.topics.items() if latches(topic, self._qos[number])}

    def counts(self) -> dict[str, int]:
        """The number of messages by topic."""
        found = self._query("SELECT topic_id, count(*) FROM messages GROUP BY topic_id")
        return {self.topics[number][0]: count for number, count in found if number in self.topics}

    def span(self) -> tuple[int, int] | None:
        """The times of the first and the last message."""
        ((start, end),) = self._query("SELECT min(timestamp), max(timestamp) FROM messages")
        return (start, end) if isinstance(start, int) and isinstance(end, int) else None

    def between(
        self, topics: Collection[str] | None, after: int, until: int, allowance: Allowance
    ) -> Iterator[RecordedMessage]:
        """The messages of topics (None for all) after one time and until another, sorted by time."""
        numbers = [n for n, (name, _) in self.topics.items() if topics is None or name in topics]
        of_topics = ",".join("?" * len(numbers))
        span = max(after, -_LARGEST_TIME), min(until, _LARGEST_TIME)
        # SQLite sorts text after all numbers: a message whose time is text is found here and reported
        rows = self._query(
            f"SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({of_topics}) "
            "AND timestamp > ? AND (timestamp <= ? OR typeof(timestamp) != 'integer') ORDER BY timestamp",
            *(*numbers, *span),
        )
        for row in rows:
            yield self._entry(row, allowance)

    def written(self, allowance: Allowance) -> Iterator[RecordedMessage]:
        """Every message in the order it was written, in small batches so that a writer does not wait."""
        last: int | None = -1
        damage: sqlite3.Error | None = None
        while damage is None and last is not None:
            rows: list[Row] = []
            try:
                held = 0
                for row in self._query(_AFTER, last, AT_ONCE):
                    rows.append(row)
                    held += len(row[3]) if isinstance(row[3], bytes) else 0
                    if held > _BYTES_AT_ONCE:
                        break
            except sqlite3.Error as error:
                damage = error
            for row in rows:
                if row[1] in self.topics:
                    yield self._entry(row, allowance)
            last = rows[-1][0] if rows else None
        if damage is not None:
            raise damage

    def _entry(self, row: Row, allowance: Allowance) -> RecordedMessage:
        """The message of a row. Raises ValueError: a column has the wrong type."""
        _, number, nanoseconds, data = row
        topic, type_name = self.topics[number]
        if not isinstance(nanoseconds, int) or nanoseconds < 0:
            raise ValueError(f"a message on {topic} has the invalid time {nanoseconds!r}")
        if not isinstance(data, bytes):
            raise ValueError(f"a message on {topic} contains {type(data).__name__}, not bytes")
        allowance.charge(len(data), records=1)
        return RecordedMessage(
            topic, type_name, nanoseconds, data, self._types, qos=self._qos.get(number, "")
        )

    def _read_tables(self) -> set[str]:
        """The names of the tables. Raises ValueError: one is a view or virtual, so that reading it would run
        its code."""
        marks = ",".join("?" * len(_CHECKED))
        found = self._query(f"SELECT name, type, sql FROM sqlite_master WHERE name IN ({marks})", *_CHECKED)
        tables = set()
        for name, kind, sql in found:
            columns = self._query(f"PRAGMA table_xinfo({name})")
            is_plain = kind == "table" and not str(sql).upper().startswith("CREATE VIRTUAL")
            if not is_plain or any(hidden for *_, hidden in columns):
                raise ValueError(f"its table {name} is not a plain table")
            tables.add(name)
        if not {"topics", "messages"} <= tables:
            raise ValueError("the tables 'topics' and 'messages' are missing")
        return tables

    def _read_topics(self, tables: set[str]) -> dict[int, tuple[str, str]]:
        topics: dict[int, tuple[str, str]] = {}
        columns = {name for _, name, *_ in self._query("PRAGMA table_info(topics)")}
        qos_column = "offered_qos_profiles" if "offered_qos_profiles" in columns else "''"  # since Foxy
        found = self._query(f"SELECT id, name, type, serialization_format, {qos_column} FROM topics")
        for number, name, type_name, encoding, qos in found:
            if not (isinstance(name, str) and isinstance(type_name, str)):
                raise ValueError(f"the name {name!r} or the type {type_name!r} of a topic is not text")
            check_names(name, type_name)
            if encoding == "cdr":
                topics[number] = name, type_name
                self._qos[number] = qos if isinstance(qos, str) else ""
        if "message_definitions" in tables:
            definitions = self._query(
                "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = ?",
                "ros2msg",
            )
            for type_name, definition in definitions:
                if not (isinstance(type_name, str) and isinstance(definition, str)):
                    raise ValueError(
                        f"the type {type_name!r} or its definition {definition!r:.60} is not text"
                    )
                self._types.learn(type_name, definition)
        return topics

    def _query(self, sql: str, *values: object) -> Iterator[Any]:
        """The rows, one at a time. Raises sqlite3.Error: the file is damaged, or the query takes too long."""
        self._steps = 0
        try:
            # `yield from` would close the cursor at the end, when the database may already be closed
            for row in self._database.execute(sql, values):  # noqa: UP028 - see above
                yield row
        except MemoryError:
            raise sqlite3.DatabaseError("a row does not fit in memory") from None
        except sqlite3.OperationalError as error:
            if self._steps > self._most_steps:
                raise sqlite3.DatabaseError("it has more rows than a file of its size can hold") from None
            raise error

    def _is_spent(self) -> bool:
        self._steps += _STEP
        return self._steps > self._most_steps


def _check_journal(file: Path) -> None:
    """Check the journal with which SQLite removes uncommitted data.

    SQLite deletes the second journal that it names, and this can be any file of the user.

    Raises:
        ValueError: it names a second journal, or is not a file.
    """
    journal = Path(f"{file.resolve()}-journal")
    if not journal.exists():
        return
    if not journal.is_file():
        raise ValueError(f"{journal.name} is not a file")
    with journal.open("rb") as stream:
        stream.seek(max(0, stream.seek(0, SEEK_END) - len(_END_OF_NAME)))
        if stream.read() == _END_OF_NAME:
            raise ValueError(f"{journal.name} names another file, which SQLite would delete")
