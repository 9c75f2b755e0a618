"""LockstepLink: a link that keeps the messages of lockstep peers until they are taken in order."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from typing import Protocol

from kbot.ros.bridges.link import PeerLink

POLL_SECONDS = 0.001
"""Seconds between two checks whether topics are connected."""


class Connections(Protocol):
    """A transport's side of its topics."""

    def is_connected(self, topic: str, peer: str, publishes: bool) -> bool:
        """Whether this side of a topic, which it `publishes` or not, is ready for a peer."""
        ...


class LockstepLink(PeerLink):
    """It drops no message of the peers in `sources`, and opens and delivers nothing between two ticks.

    Messages of other peers are delivered by `serve`.
    """

    def __init__(self, report: Callable[[str], None], raises_errors: bool = False) -> None:
        super().__init__(report, raises_errors=raises_errors)
        self.sources = set[str]()
        self._arrived = threading.Condition()
        self._kept: dict[tuple[str, str], deque[tuple[object, Callable[[str], None]]]] = {}
        """By topic and source."""

    def serve_in_time(self) -> None:
        """Does nothing: a topic that opens between two ticks would depend on the speed of the machine."""

    def send(
        self,
        topic: str,
        message: object,
        on_result: Callable[[str], None] = lambda reason: None,
        source: str = "",
    ) -> None:
        if source not in self.sources:
            super().send(topic, message, on_result, source)
            return
        with self._arrived:
            self._kept.setdefault((topic, source), deque()).append((message, on_result))
            self._arrived.notify_all()

    def deliver_next(
        self, topic: str, source: str, seconds: float, before: Callable[[], None] = lambda: None
    ) -> str | None:
        """Wait for the next message of a peer, call `before`, and publish the message.

        Returns why it was refused, or an empty text; None if no message arrived within some seconds.
        """
        key = topic, source
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._kept.get(key), seconds):
                return None
            message, on_result = self._kept[key].popleft()
        before()
        reason = self.deliver(topic, message)
        on_result(reason)
        return reason

    def wait_for_peers(
        self, side: Connections, wanted: Iterable[tuple[str, str, bool]], is_waiting: Callable[[], object]
    ) -> None:
        """Wait until this side is ready, as `is_connected` gets it, and has opened the topics.

        `is_waiting` is called in between. It raises an error to end the waiting.
        """
        for topic, peer, publishes in wanted:
            self.serve()
            while not side.is_connected(topic, peer, publishes):
                is_waiting()
                time.sleep(POLL_SECONDS)
                self.serve()
        self.serve()
        self.flush()
