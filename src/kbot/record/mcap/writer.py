"""Recordings as MCAP: CDR messages with ROS 2 definitions, in compressed chunks."""

from __future__ import annotations

from importlib.metadata import version
from typing import IO, Any, cast

from mcap.writer import CompressionType, Writer

from kbot.record.formats import Recordable
from kbot.record.whole_file import WholeFile

CHUNK_BYTES = 256 * 1024


class McapWriter:
    """Writes chunk by chunk: one that is not whole is not there, so a broken run is readable up to it."""

    def __init__(self, path: str, *, compress: bool = True) -> None:
        """Raises OSError: the file exists or cannot be made."""
        self._file = WholeFile(path)
        compression = CompressionType.ZSTD if compress else CompressionType.NONE
        self._writer: Any = Writer(cast(IO[Any], self._file), CHUNK_BYTES, compression)
        self._writer.start(profile="ros2", library=f"kbot {version('kbot')}")
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}
        self._count = 0

    def write(self, packet: Recordable) -> None:
        key = (packet.topic, packet.type_name)
        channel = self._channels.get(key) or self._new_channel(packet)
        self._count += 1
        self._writer.add_message(channel, packet.nanoseconds, packet.cdr, packet.nanoseconds, self._count)

    def annotate(self, name: str, values: dict[str, str]) -> None:
        self._writer.add_metadata(name, values)

    def flush(self) -> None:
        self._writer.flush()

    def close(self) -> None:
        self._writer.finish()
        self._file.close()

    def abandon(self) -> None:
        self._file.close()

    def _new_channel(self, packet: Recordable) -> int:
        topic, type_name = packet.topic, packet.type_name
        if type_name not in self._schemas:
            text = packet.ros2_definition[0].encode()
            self._schemas[type_name] = self._writer.register_schema(type_name, "ros2msg", text)
        schema = self._schemas[type_name]
        channel: int = self._writer.register_channel(topic, "cdr", schema, {"offered_qos_profiles": ""})
        self._channels[topic, type_name] = channel
        return channel
