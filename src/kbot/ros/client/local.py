"""A KBot that runs on this machine, without any ROS: its graph, spoken to as `kbot topic` does."""

from __future__ import annotations

import json
import os
import threading
from typing import Any

from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.feed import Packet
from kbot.ros.bridges.link import Link, Topic
from kbot.ros.graph.client import GraphClient
from kbot.ros.graph.presence import find
from kbot.text import KbotError


class LocalTransport:
    """Hears what the node's link hears, and says what it says. A thread of its own listens."""

    uses_sim_time = True

    def __init__(self, link: Link) -> None:
        """Raises KbotError: no KBot runs here, or several and KBOT_AT names none of them."""
        address = find(os.environ.get("KBOT_AT", ""), "KBOT_AT=NUMBER")
        self._link = link
        self._asks, self._listens = GraphClient(address), GraphClient(address)
        self._lock = threading.Lock()
        self._known: set[str] = set()
        self.failure: KbotError | None = None
        self._is_closed = False
        link.watch(self._look)
        self._thread = threading.Thread(target=self._hear, daemon=True, name="kbot-local")
        self._thread.start()

    def parameter(self, name: str) -> Any:  # noqa: ANN401 - what a parameter can hold
        with self._lock:
            if not self._asks.call("/rosapi/has_param", name=name).get("exists"):
                return None
            return json.loads(self._asks.call("/rosapi/get_param", name=name)["value"])

    def close(self) -> None:
        self._is_closed = True
        with self._lock:
            self._asks.close()
        self._listens.close()
        self._thread.join(2.0)

    def _look(self) -> None:
        """On the node's thread: a topic is new to it."""
        for topic in list(self._link.topics.values()):
            if topic.name in self._known:
                continue
            self._known.add(topic.name)
            try:
                if topic.is_input:
                    self._require(topic)
                    self._listens.subscribe(topic.name, topic.type_name)
                else:
                    with self._lock:
                        self._asks.advertise(topic.name, topic.type_name)
                    self._link.open(topic.name, self._say)
            except KbotError as error:
                self._link.tell(str(error))

    def _require(self, topic: Topic) -> None:
        with self._lock:
            kind = self._asks.type_of(topic.name)
        if kind != topic.type_name:
            raise KbotError(f"{topic.name} carries {kind}, not {topic.type_name}")

    def _say(self, packet: Packet) -> None:
        """On the node's thread. Raises KbotError: the KBot is gone, or hears no such topic."""
        with self._lock:
            self._asks.publish(packet.topic, to_plain(packet.message, exact=True))

    def _hear(self) -> None:
        try:
            for name, fields in self._listens.listen():
                topic = self._link.topics.get(name)
                if topic is not None:
                    self._link.send(name, from_plain(fields, topic.message_type))
        except KbotError as error:
            if not self._is_closed:
                self.failure = error
