"""Folders of rosbag2 without their metadata, as a kill leaves them: what their SQLite files were given.

https://github.com/ros2/rosbag2/tree/rolling/rosbag2_storage_sqlite3
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from kbot.record.bags.columns import checked
from kbot.record.entry import Entry, Types
from kbot.record.formats import BrokenOff

AT_ONCE = 1000
"""Messages read at once: whoever still writes the file waits no longer than for these."""
_NEXT = (
    "SELECT messages.id, name, type, timestamp, data FROM messages JOIN topics ON topic_id = topics.id "
    "WHERE messages.id > ? ORDER BY messages.id LIMIT ?"
)


def salvaged_folder(folder: Path) -> Iterator[Entry]:
    """Every message that was committed, in the order it was written.

    Raises:
        BrokenOff: what follows cannot be read.
        KbotError: a definition cannot be understood.
    """
    types = Types()
    for file in sorted(folder.glob("*.db3"), key=lambda file: (len(file.name), file.name)):
        try:
            # to be written too: SQLite takes out what was not committed when it opens it
            with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=rw", uri=True)) as database:
                yield from _messages(database, types)
        except (sqlite3.Error, ValueError) as error:
            raise BrokenOff(f"{file} cannot be read further: {error}") from None


def _messages(database: sqlite3.Connection, types: Types) -> Iterator[Entry]:
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master")}
    if "message_definitions" in tables:
        found = "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = ?"
        for type_name, definition in database.execute(found, ("ros2msg",)):
            types.learn(type_name, definition)
    last = -1
    damage: sqlite3.Error | None = None
    while damage is None:
        rows: list[tuple[int, str, str, int, bytes]] = []
        try:
            rows.extend(database.execute(_NEXT, (last, AT_ONCE)))
        except sqlite3.Error as error:
            damage = error
        for _, topic, type_name, nanoseconds, data in rows:
            yield Entry(*checked(topic, type_name, nanoseconds, data), types)
        if not rows:
            break
        last = rows[-1][0]
    if damage is not None:
        raise damage
