"""From the simulation's thread to a server's loop: which topics are wanted, and what they said last."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

from kbot.bridges.link import Link
from kbot.wire import Packet

Sink = Callable[[Packet], None]
WAITING = 1000


class Outlets:
    """Opens a topic while somebody wants it. `want` and `leave` are called on the loop, sinks too."""

    def __init__(self, link: Link, prepare: Callable[[Packet], object]) -> None:
        """`prepare` makes the encoding that sinks need, on the simulation's thread."""
        self._link, self._prepare = link, prepare
        self._loop: asyncio.AbstractEventLoop | None = None
        self._sinks: dict[str, list[Sink]] = {}
        self._last: dict[str, Packet] = {}
        self._waiting: deque[Packet] = deque(maxlen=WAITING)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Hand out on this loop from now on."""
        self._loop = loop

    def want(self, topic: str, sink: Sink) -> None:
        """Hear a topic; what is latched comes at once."""
        sinks = self._sinks.setdefault(topic, [])
        sinks.append(sink)
        if len(sinks) == 1:
            self._link.open(topic, self._receive)
        elif topic in self._last:
            sink(self._last[topic])

    def leave(self, topic: str, sink: Sink) -> None:
        """Hear it no more."""
        sinks = self._sinks.get(topic, [])
        if sink in sinks:
            sinks.remove(sink)
            if not sinks:
                self._link.close(topic, self._receive)
                self._last.pop(topic, None)

    def _receive(self, packet: Packet) -> None:
        """On the simulation's thread."""
        self._prepare(packet)
        self._waiting.append(packet)
        self._link.stir(self._wake)

    def _wake(self) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._hand_out)

    def _hand_out(self) -> None:
        for _ in range(len(self._waiting)):
            packet = self._waiting.popleft()
            topic = self._link.topics.get(packet.topic)
            if topic is not None and topic.is_latched:
                self._last[packet.topic] = packet
            for sink in tuple(self._sinks.get(packet.topic, ())):
                sink(packet)
