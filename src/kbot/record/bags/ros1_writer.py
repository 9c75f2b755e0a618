"""Writes ROS 1 bags, version 2.0."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from rosbags.rosbag1 import Writer

from kbot.messages.types import String
from kbot.record.feed import Packet
from kbot.record.formats import FIRST_TIME, NOTES_TOPIC, Recordable

if TYPE_CHECKING:
    from rosbags.interfaces import Connection


class Ros1Writer:
    """Writes chunks, and the index at the end. KBot reads an unfinished bag without its index, other programs
    after `rosbag reindex`.

    The bag is not compressed: ROS cannot read the LZ4 of the rosbags library, and BZ2 is too slow for
    recording.
    """

    def __init__(self, path: str) -> None:
        """Raises OSError: the file exists or cannot be created."""
        self._writer = Writer(path)
        self._writer.open()
        self._connections: dict[tuple[str, str], Connection] = {}
        self._time = FIRST_TIME

    def write(self, packet: Recordable) -> None:
        key = (packet.topic, packet.type_name)
        data = packet.ros1  # before the connection: a type that ROS 1 cannot read gets none
        connection = self._connections.get(key)
        if connection is None:
            definition, md5 = packet.ros1_definition
            connection = self._connections[key] = self._writer.add_connection(
                packet.topic,
                packet.type_name,
                msgdef=definition,
                md5sum=md5,
                callerid="/kbot",
                latching=int(packet.is_latched),
            )
        self._time = max(FIRST_TIME, packet.nanoseconds)
        self._writer.write(connection, self._time, data)

    def annotate(self, name: str, values: dict[str, str]) -> None:
        text = String(json.dumps({"name": name, **values}))
        self.write(Packet(NOTES_TOPIC, text, self._time, is_latched=True))

    def flush(self) -> None:
        if self._writer.bio:
            self._writer.write_chunk(self._writer.chunks[-1])
            self._writer.bio.flush()

    def close(self) -> None:
        self._writer.close()

    def abandon(self) -> None:
        if self._writer.bio:
            self._writer.bio.close()
