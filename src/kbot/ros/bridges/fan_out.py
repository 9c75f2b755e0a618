"""Passes messages from the simulation's thread to the loop of the bridges, for subscribed topics."""

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
"""Packets that wait for the loop. If there are more, the oldest are dropped."""


def _no_flush() -> None:
    """The flush of sinks that send each packet at once."""


class TopicSource(Protocol):
    """Where messages come from: the PeerLink."""

    def open(self, topic: str, receiver: Sink) -> None: ...

    def close(self, topic: str, receiver: Sink) -> None: ...

    def schedule(self, wake: Callable[[], None]) -> None:
        """Call `wake` once, after all messages of the current time step have been received."""

    def is_latched(self, topic: str) -> bool: ...

    def report(self, text: str) -> None: ...


class FanOut:
    """Opens a topic while it has subscribers, once for the peers of all bridges.

    Therefore all peers share one packet, and each message is encoded once. `subscribe` and `unsubscribe` must
    be called on the loop, and sinks are called there.
    """

    def __init__(self, source: TopicSource) -> None:
        self._source = source
        self._peers: dict[Flush, dict[str, list[Sink]]] = {_no_flush: {}}
        """For each flush, the topics and sinks that use it. A flush belongs to one peer."""
        self._slow = set[Flush]()
        self._last: dict[str, Packet] = {}
        """The last packet of each latched topic."""
        self._waiting: deque[Packet] = deque(maxlen=WAITING)
        self._is_scheduled = False

    def subscribe(self, topic: str, sink: Sink, flush: Flush = _no_flush, *, slow: bool = False) -> None:
        """Pass the packets of a topic to `sink`, with the latched one at once.

        `flush` is called after its sinks have received all packets of a time step, so that they can send them
        together. `slow` sinks, whose encoding takes long, are served after the others.
        """
        is_first = not any(topic in sinks for sinks in self._peers.values())
        if slow:
            self._slow.add(flush)
        self._peers.setdefault(flush, {}).setdefault(topic, []).append(sink)
        if is_first:
            self._source.open(topic, self._receive)
        elif topic in self._last:
            sink(self._last[topic])
            flush()

    def unsubscribe(self, topic: str, sink: Sink) -> None:
        """End a subscription. Does nothing if there is none."""
        for flush, topics in self._peers.items():
            sinks = topics.get(topic, [])
            if sink in sinks:
                sinks.remove(sink)
                if not sinks:
                    del topics[topic]
                if not topics and flush is not _no_flush:
                    del self._peers[flush]
                    self._slow.discard(flush)
                break
        else:
            return
        if not any(topic in sinks for sinks in self._peers.values()):
            self._source.close(topic, self._receive)
            self._last.pop(topic, None)

    def _receive(self, packet: Packet) -> None:
        """Called on the simulation's thread."""
        self._waiting.append(packet)
        if not self._is_scheduled:
            self._is_scheduled = True
            self._source.schedule(self._wake)

    def _wake(self) -> None:
        self._is_scheduled = False
        later(self._distribute)

    def _distribute(self) -> None:
        """Pass the waiting packets to all sinks, then flush.

        Sinks collect first and flushes send afterwards, because system calls are faster one after the other.
        Large packets come last, so that /clock does not wait for an image.
        """
        packets = [self._waiting.popleft() for _ in range(len(self._waiting))]
        packets.sort(key=lambda packet: packet.is_large)
        for packet in packets:
            if self._source.is_latched(packet.topic):
                self._last[packet.topic] = packet
        for is_slow in (False, True):
            peers = [peer for peer in self._peers.items() if (peer[0] in self._slow) is is_slow]
            for _, sinks in peers:
                self._pass_on(packets, sinks)
            for flush, _ in peers:
                flush()

    def _pass_on(self, packets: list[Packet], sinks: dict[str, list[Sink]]) -> None:
        for packet in packets:
            for sink in tuple(sinks.get(packet.topic, ())):
                try:
                    sink(packet)
                except KbotError as error:
                    self._source.report(f"{packet.topic}: a message cannot be sent: {error}")
