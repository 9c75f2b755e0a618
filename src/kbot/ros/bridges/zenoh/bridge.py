"""The simulation as a ROS 2 node over Zenoh, as in rmw_zenoh.

Keys, tokens and attachments: https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md
"""

from __future__ import annotations

import itertools
import os
import secrets
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

import zenoh

from kbot.messages.types import Twist, TwistStamped
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import ros2_definition
from kbot.record.feed import Packet
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.loop import Batch, later, wait_for
from kbot.ros.bridges.zenoh import ROUTER_PORT
from kbot.ros.bridges.zenoh.names import (
    ATTACHED,
    LATCHED,
    OF_PARAMETERS,
    VOLATILE,
    entity_token,
    node_token,
    topic_key,
    type_key,
)
from kbot.ros.bridges.zenoh.parameters import TOPIC as EVENTS
from kbot.ros.bridges.zenoh.parameters import TYPE as EVENT_TYPE
from kbot.ros.bridges.zenoh.parameters import ParameterEvents, parameter_services
from kbot.ros.bridges.zenoh.queryables import ServiceServer, served_of
from kbot.text import KbotError

NODE = "kbot"

OfZenoh = Any
"""What the library gives and takes, which is not typed."""

_Sent = tuple[OfZenoh, bytes, bytes]
"""The library's publisher, a message and what is attached to it."""


class ZenohBridge:
    """A node /kbot: topics out, latched ones also for those who come late, commands and calls of services
    in. It meets peers through the router where one answers, else it listens in the router's place."""

    def __init__(self, link: PeerLink, host: str | None = None) -> None:
        """The domain is ROS_DOMAIN_ID's, else 0. `host` is the address that peers reach it at where it
        listens itself; ZENOH_CONNECT names another router's, as in tcp/10.0.0.2:7447.

        Raises:
            KbotError: no session can be opened.
        """
        self._link = link
        self.domain = _domain()
        self._session, self._place = _open(host)
        self._zid = str(self._session.zid())
        self._numbers = itertools.count(1)
        self._outgoing: dict[str, _Outgoing] = {}
        self._batch = Batch(_put)
        self._incoming: dict[str, list[OfZenoh]] = {}
        self._closed, self._changed = threading.Event(), threading.Event()
        self._tokens = [self._session.liveliness().declare_token(node_token(self.domain, self._zid, NODE))]
        self._services = ServiceServer(self._session, self.domain, partial(self._token, "SS"), link.tell)
        self._parameters = parameter_services(link, f"/{NODE}")
        self._events = self._events_of_parameters()
        link.watch(self._changed.set)
        self._changed.set()
        self._thread = threading.Thread(target=self._run, daemon=True, name="kbot-zenoh")
        self._thread.start()

    def describe(self) -> str:
        """Where it is to be found, in one sentence."""
        return f"Zenoh: node /{NODE} in domain {self.domain}, {self._place}"

    def close(self) -> None:
        """Take leave of all peers; a session that is left open keeps the process from ending."""
        self._closed.set()
        self._changed.set()
        self._thread.join(5.0)
        for topic in self._outgoing.values():
            topic.close()
        self._services.close()
        with suppress(zenoh.ZError):  # a peer that reads nothing is not waited for
            self._session.close()

    def _run(self) -> None:
        while True:
            self._changed.wait()
            self._changed.clear()
            if self._closed.is_set():
                return
            self._declare()
            self._offer()
            self._events.tell()

    def _declare(self) -> None:
        topics = self._link.topics
        for name in [n for n, out in self._outgoing.items() if topics.get(n) != out.topic]:
            self._outgoing.pop(name).close()
        for name in self._incoming.keys() - topics.keys():
            for declared in self._incoming.pop(name):
                declared.undeclare()
        for topic in topics.values():
            if topic.is_input and topic.name not in self._incoming:
                self._incoming[topic.name] = self._hear(topic)
            elif not topic.is_input and topic.name not in self._outgoing:
                kind = _kind(topic.type_name)
                token = self._token("MP", topic.name, kind, LATCHED if topic.is_latched else VOLATILE)
                key = topic_key(self.domain, topic.name, kind)
                self._outgoing[topic.name] = _Outgoing(
                    self._link, topic, self._session, key, token, self._batch
                )

    def _hear(self, topic: Topic) -> list[OfZenoh]:
        kinds = (Twist, TwistStamped) if topic.message_type is Twist else (topic.message_type,)
        made: list[OfZenoh] = []
        for message_type in kinds:
            kind = _kind(ros_name(message_type))
            made.append(self._token("MS", topic.name, kind))
            key = topic_key(self.domain, topic.name, kind)
            made.append(self._session.declare_subscriber(key, self._deliver(topic.name, message_type)))
        return made

    def _deliver(self, topic: str, kind: type) -> Callable[[OfZenoh], None]:
        def deliver(sample: OfZenoh) -> None:
            try:
                self._link.send(topic, decode_cdr(sample.payload.to_bytes(), kind))
            except KbotError as error:
                self._link.tell(f"Zenoh: a message on {topic} was refused: {error}")

        return deliver

    def _offer(self) -> None:
        """Have peers call what the link offers now, and ask for parameters."""
        of_link = [served_of(self._link, service) for service in self._link.services.values()]
        self._services.offer([*of_link, *self._parameters])

    def _events_of_parameters(self) -> ParameterEvents:
        kind = _kind(EVENT_TYPE)
        publisher = self._session.declare_publisher(topic_key(self.domain, EVENTS, kind))
        self._tokens.append(self._token("MP", EVENTS, kind, OF_PARAMETERS))
        mark, count = secrets.token_bytes(16), itertools.count(1)

        def put(data: bytes) -> None:
            _put([(publisher, data, ATTACHED.pack(next(count), self._link.nanoseconds, 16, mark))])

        return ParameterEvents(self._link, f"/{NODE}", put)

    def _token(self, role: str, name: str, kind: str, quality: str = VOLATILE) -> OfZenoh:
        key = entity_token(self.domain, self._zid, next(self._numbers), role, NODE, name, kind, quality)
        return self._session.liveliness().declare_token(key)


class _Outgoing:
    """One topic. What is latched is kept for those who come late; else only what somebody hears is made."""

    def __init__(
        self,
        link: PeerLink,
        topic: Topic,
        session: OfZenoh,
        key: str,
        token: OfZenoh,
        batch: Batch[_Sent],
    ) -> None:
        self.topic = topic
        self._link, self._token, self._batch = link, token, batch
        self._gid, self._count = secrets.token_bytes(16), 0
        self._publisher: OfZenoh
        if topic.is_latched:
            self._publisher = zenoh.ext.declare_advanced_publisher(
                session, key, cache=zenoh.ext.CacheConfig(max_samples=1), publisher_detection=True
            )
            self._want(True)
        else:
            self._publisher = session.declare_publisher(key)
            self._publisher.declare_matching_listener(lambda status: self._want(status.matching))

    def close(self) -> None:
        """Send nothing more."""
        wait_for(self._leave())
        self._publisher.undeclare()
        self._token.undeclare()

    async def _leave(self) -> None:
        self._link.fan_out.leave(self.topic.name, self._send)

    def _want(self, is_heard: bool) -> None:
        fan_out = self._link.fan_out
        if is_heard:
            later(lambda: fan_out.want(self.topic.name, self._send, self._batch.flush))
        else:
            later(lambda: fan_out.leave(self.topic.name, self._send))

    def _send(self, packet: Packet) -> None:
        if type(packet.message) is self.topic.message_type:
            self._count += 1
            attached = ATTACHED.pack(self._count, packet.nanoseconds, 16, self._gid)
            self._batch.add((self._publisher, packet.cdr, attached))


def _put(batch: list[_Sent]) -> None:
    with suppress(zenoh.ZError):  # the session is at its end
        for publisher, data, attached in batch:
            publisher.put(data, attachment=attached)


def _open(host: str | None) -> tuple[OfZenoh, str]:
    """A session with the router, else one that listens in its place; and in words where that is."""
    router = os.environ.get("ZENOH_CONNECT") or f"tcp/127.0.0.1:{ROUTER_PORT}"
    zenoh.init_log_from_env_or("off")
    joined = zenoh.Config()
    joined.insert_json5("mode", '"client"')
    joined.insert_json5("connect/endpoints", f'["{router}"]')
    joined.insert_json5("connect/timeout_ms", "500")
    _keep_local(joined)
    try:
        return zenoh.open(joined), f"by the router at {router}"
    except zenoh.ZError as error:
        if os.environ.get("ZENOH_CONNECT"):
            raise KbotError(f"no Zenoh router answers at {router}: {error}") from None
    place = f"tcp/{host or '127.0.0.1'}:{ROUTER_PORT}"
    alone = zenoh.Config()
    alone.insert_json5("mode", '"router"')
    alone.insert_json5("listen/endpoints", f'["{place}"]')
    _keep_local(alone)
    try:
        return zenoh.open(alone), f"in the router's place at {place}"
    except zenoh.ZError as error:
        raise KbotError(f"Zenoh cannot be served at {place}: {error}") from None


def _keep_local(config: OfZenoh) -> None:
    """Look for nobody by multicast; stamps are what those who come late are served by."""
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("timestamping/enabled", "true")


def _kind(type_name: str) -> str:
    return type_key(type_name, ros2_definition(type_name)[1])


def _domain() -> int:
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not text.isdecimal():
        raise KbotError(f"ROS_DOMAIN_ID is a whole number from 0 on, not '{text}'")
    return int(text)
