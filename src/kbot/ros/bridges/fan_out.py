"""Hands messages from the simulation's thread to the bridges' loop, for the topics that peers want."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

from kbot.record.feed import Packet
from kbot.ros.bridges.loop import later
from kbot.text import KbotError

Sink = Callable[[Packet], None]
Flush = Callable[[], None]
WAITING = 1000


def _at_once() -> None:
    """Of sinks that keep nothing back."""


class TopicSource(Protocol):
    """Where messages come from; `stir` calls back when all of one moment have been received."""

    def open(self, topic: str, receiver: Sink) -> None: ...

    def close(self, topic: str, receiver: Sink) -> None: ...

    def stir(self, wake: Callable[[], None]) -> None: ...

    def is_latched(self, topic: str) -> bool: ...

    def tell(self, text: str) -> None: ...


class FanOut:
    """Opens a topic while somebody wants it, once for the peers of all bridges, so that they share what a
    message is encoded to. `want` and `leave` are called on the loop, sinks too."""

    def __init__(self, source: TopicSource) -> None:
        self._source = source
        self._peers: dict[Flush, dict[str, list[Sink]]] = {_at_once: {}}
        """The sinks of each topic, by what sends on what they collect."""
        self._late = set[Flush]()
        self._last: dict[str, Packet] = {}
        self._waiting: deque[Packet] = deque(maxlen=WAITING)
        self._is_stirred = False

    def want(self, topic: str, sink: Sink, flush: Flush = _at_once, *, late: bool = False) -> None:
        """Hear a topic; what is latched comes at once. `flush` is called when the sinks that have it in
        common were given all that was said at one moment; those whose bytes take long to make are `late`,
        so that the others need not wait for them."""
        is_first = not any(topic in sinks for sinks in self._peers.values())
        if late:
            self._late.add(flush)
        self._peers.setdefault(flush, {}).setdefault(topic, []).append(sink)
        if is_first:
            self._source.open(topic, self._receive)
        elif topic in self._last:
            sink(self._last[topic])
            flush()

    def leave(self, topic: str, sink: Sink) -> None:
        """Hear it no more."""
        for flush, topics in self._peers.items():
            sinks = topics.get(topic, [])
            if sink in sinks:
                sinks.remove(sink)
                if not sinks:
                    del topics[topic]
                if not topics and flush is not _at_once:
                    del self._peers[flush]
                    self._late.discard(flush)
                break
        else:
            return
        if not any(topic in sinks for sinks in self._peers.values()):
            self._source.close(topic, self._receive)
            self._last.pop(topic, None)

    def _receive(self, packet: Packet) -> None:
        """On the simulation's thread."""
        self._waiting.append(packet)
        if not self._is_stirred:
            self._is_stirred = True
            self._source.stir(self._wake)

    def _wake(self) -> None:
        self._is_stirred = False
        later(self._hand_out)

    def _hand_out(self) -> None:
        """All are given what was said before anything is sent on, for calls of the system are quicker one
        after another; what is large comes at the end, so that the clock does not wait for a picture."""
        packets = [self._waiting.popleft() for _ in range(len(self._waiting))]
        packets.sort(key=lambda packet: packet.is_large)
        for packet in packets:
            if self._source.is_latched(packet.topic):
                self._last[packet.topic] = packet
        for is_late in (False, True):
            peers = [peer for peer in self._peers.items() if (peer[0] in self._late) is is_late]
            for _, sinks in peers:
                self._give(packets, sinks)
            for flush, _ in peers:
                flush()

    def _give(self, packets: list[Packet], sinks: dict[str, list[Sink]]) -> None:
        for packet in packets:
            for sink in tuple(sinks.get(packet.topic, ())):
                try:
                    sink(packet)
                except KbotError as error:
                    self._source.tell(f"{packet.topic}: a message cannot be sent: {error}")
