"""From the simulation's thread to the loop of the bridges: which topics are wanted, what they said last."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from kbot.bridges.loop import later
from kbot.text import KbotError
from kbot.wire import Packet

if TYPE_CHECKING:
    from kbot.bridges.link import Link

Sink = Callable[[Packet], None]
WAITING = 1000


class Outlets:
    """Opens a topic while somebody wants it, once for the peers of all bridges, so that they share what a
    message is encoded to. `want` and `leave` are called on the loop, sinks too."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._sinks: dict[str, list[Sink]] = {}
        self._last: dict[str, Packet] = {}
        self._waiting: deque[Packet] = deque(maxlen=WAITING)
        self._is_stirred = False

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
        self._waiting.append(packet)
        if not self._is_stirred:
            self._is_stirred = True
            self._link.stir(self._wake)

    def _wake(self) -> None:
        self._is_stirred = False
        later(self._hand_out)

    def _hand_out(self) -> None:
        for _ in range(len(self._waiting)):
            packet = self._waiting.popleft()
            topic = self._link.topics.get(packet.topic)
            if topic is not None and topic.is_latched:
                self._last[packet.topic] = packet
            try:
                for sink in tuple(self._sinks.get(packet.topic, ())):
                    sink(packet)
            except KbotError as error:
                self._link.tell(f"{packet.topic}: a message cannot be sent: {error}")
