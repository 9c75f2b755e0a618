"""Publishes a topic over TCPROS. A slow subscriber does not delay others."""

from __future__ import annotations

import asyncio
import struct
from collections import deque

from kbot.record.feed import Packet
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.loop import later
from kbot.ros.bridges.ros1.tcpros import encode_header
from kbot.ros.bridges.ros1.topic import TopicEndpoint

QUEUE = 100
"""Messages that wait for a slow subscriber. If there are more, the oldest are dropped."""
STALL_SECONDS = 10.0
"""Seconds after which a subscriber that reads nothing is disconnected."""
READ_BYTES = 1 << 12


class PublishedTopic(TopicEndpoint):
    """A topic that KBot publishes. It is received from the simulation while there are subscribers."""

    def __init__(self, link: PeerLink, topic: Topic, node: str) -> None:
        super().__init__(link, topic, node)
        self._subscribers: list[_Subscriber] = []

    @property
    def peers(self) -> list[str]:
        """Names of the nodes that are connected."""
        return [subscriber.node for subscriber in self._subscribers.copy()]

    async def serve(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, header: dict[str, str]
    ) -> None:
        """Send messages to a subscriber until it disconnects. What it sends is ignored.

        Raises:
            ProtocolError: it expects another type.
            OSError: it has disconnected.
        """
        self.check(header)
        writer.write(encode_header(self.header(latching=str(int(self.topic.is_latched)))))
        subscriber = _Subscriber(writer, header.get("callerid", "?"))
        self._subscribers.append(subscriber)
        self._link.fan_out.subscribe(self.topic.name, subscriber.send)
        try:
            while await reader.read(READ_BYTES):
                pass
        finally:
            self._link.fan_out.unsubscribe(self.topic.name, subscriber.send)
            self._subscribers.remove(subscriber)
            subscriber.close()

    def close(self) -> None:
        """Disconnect every subscriber. May be called on any thread."""
        for subscriber in self._subscribers.copy():
            later(subscriber.close)


class _Subscriber:
    def __init__(self, writer: asyncio.StreamWriter, node: str) -> None:
        self.node = node
        self._writer = writer
        self._waiting: deque[bytes] = deque(maxlen=QUEUE)
        self._sending: asyncio.Task[None] | None = None
        writer.transport.set_write_buffer_limits(0)  # so that `drain` waits until the buffer is empty

    def send(self, packet: Packet) -> None:
        """Send at once, or queue the packet while the subscriber is slow."""
        if self._writer.transport.is_closing():
            return  # asyncio logs a warning for writes to a lost connection
        data = struct.pack("<I", len(packet.ros1)) + packet.ros1
        if self._sending is not None:
            self._waiting.append(data)
            return
        self._writer.write(data)
        if self._writer.transport.get_write_buffer_size():
            self._sending = asyncio.create_task(self._catch_up())

    def close(self) -> None:
        self._writer.transport.abort()

    async def _catch_up(self) -> None:
        try:
            async with asyncio.timeout(STALL_SECONDS):
                await self._writer.drain()
            while self._waiting:
                self._writer.write(self._waiting.popleft())
                async with asyncio.timeout(STALL_SECONDS):
                    await self._writer.drain()
        except (OSError, TimeoutError):
            self.close()
        finally:
            self._sending = None
