"""The simulation as a ROS 2 node over Zenoh, compatible with rmw_zenoh.

Its keys, tokens and attachments: https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md
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
    PARAMETERS,
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
"""An object of the Zenoh library, which has no type annotations."""

_Sent = tuple[OfZenoh, bytes, bytes]
"""The library's publisher, a message and its attachment."""


class ZenohBridge:
    """The node /kbot, with topics, services and parameters. Late subscribers receive latched messages.

    It connects through the router. If none answers on this machine, it acts as the router.
    """

    def __init__(self, link: PeerLink, host: str | None = None) -> None:
        """Connect in the domain ROS_DOMAIN_ID, else 0.

        ZENOH_CONNECT is the address of the router, such as tcp/10.0.0.2:7447. If KBot acts as the router,
        `host` is the address that peers connect to.

        Raises:
            KbotError: no session can be opened.
        """
        self._link = link
        self.domain = _domain()
        self._session, self._where = _open(host)
        self._zid = str(self._session.zid())
        self._numbers = itertools.count(1)
        self._published: dict[str, _PublishedTopic] = {}
        self._batch = Batch(_put)
        self._incoming: dict[str, list[OfZenoh]] = {}
        self._closed, self._changed = threading.Event(), threading.Event()
        self._tokens = [self._session.liveliness().declare_token(node_token(self.domain, self._zid, NODE))]
        self._services = ServiceServer(self._session, self.domain, partial(self._token, "SS"), link.report)
        self._parameters = parameter_services(link, f"/{NODE}")
        self._events = self._events_of_parameters()
        link.watch(self._changed.set)
        self._changed.set()
        self._thread = threading.Thread(target=self._run, daemon=True, name="kbot-zenoh")
        self._thread.start()

    def describe(self) -> str:
        """The node, its domain and the router, in one sentence."""
        return f"Zenoh: node /{NODE} in domain {self.domain}, {self._where}"

    def close(self) -> None:
        """Disconnect. The process cannot exit while the session is open."""
        self._closed.set()
        self._changed.set()
        self._thread.join(5.0)
        for topic in self._published.values():
            topic.close()
        self._services.close()
        with suppress(zenoh.ZError):  # raised if a peer does not read
            self._session.close()

    def _run(self) -> None:
        while True:
            self._changed.wait()
            self._changed.clear()
            if self._closed.is_set():
                return
            self._declare_topics()
            self._offer_services()
            self._events.publish_changes()

    def _declare_topics(self) -> None:
        topics = self._link.topics_of(2)
        for name in [n for n, published in self._published.items() if topics.get(n) != published.topic]:
            self._published.pop(name).close()
        for name in self._incoming.keys() - topics.keys():
            for declared in self._incoming.pop(name):
                declared.undeclare()
        for topic in topics.values():
            if topic.is_input and topic.name not in self._incoming:
                self._incoming[topic.name] = self._subscribe(topic)
            elif not topic.is_input and topic.name not in self._published:
                kind = _kind(topic.type_name)
                token = self._token("MP", topic.name, kind, LATCHED if topic.is_latched else VOLATILE)
                key = topic_key(self.domain, topic.name, kind)
                self._published[topic.name] = _PublishedTopic(
                    self._link, topic, self._session, key, token, self._batch
                )

    def _subscribe(self, topic: Topic) -> list[OfZenoh]:
        """The subscribers and tokens of a topic. A Twist may also arrive as a TwistStamped."""
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
                self._link.report(f"Zenoh: rejected a message on {topic}: {error}")

        return deliver

    def _offer_services(self) -> None:
        """Offer the link's current services and the parameter services."""
        of_link = [served_of(self._link, service) for service in self._link.services.values()]
        self._services.offer([*of_link, *self._parameters])

    def _events_of_parameters(self) -> ParameterEvents:
        kind = _kind(EVENT_TYPE)
        publisher = self._session.declare_publisher(topic_key(self.domain, EVENTS, kind))
        self._tokens.append(self._token("MP", EVENTS, kind, PARAMETERS))
        mark, count = secrets.token_bytes(16), itertools.count(1)

        def put(data: bytes) -> None:
            _put([(publisher, data, ATTACHED.pack(next(count), self._link.nanoseconds, 16, mark))])

        return ParameterEvents(self._link, f"/{NODE}", put)

    def _token(self, role: str, name: str, kind: str, quality: str = VOLATILE) -> OfZenoh:
        key = entity_token(self.domain, self._zid, next(self._numbers), role, NODE, name, kind, quality)
        return self._session.liveliness().declare_token(key)


class _PublishedTopic:
    """A topic that KBot publishes, open while it is latched or has subscribers."""

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
            self._set_wanted(True)
        else:
            self._publisher = session.declare_publisher(key)
            self._publisher.declare_matching_listener(lambda status: self._set_wanted(status.matching))

    def close(self) -> None:
        """Stop publishing."""
        wait_for(self._unsubscribe())
        self._publisher.undeclare()
        self._token.undeclare()

    async def _unsubscribe(self) -> None:
        self._link.fan_out.unsubscribe(self.topic.name, self._send)

    def _set_wanted(self, is_wanted: bool) -> None:
        fan_out = self._link.fan_out
        if is_wanted:
            later(lambda: fan_out.subscribe(self.topic.name, self._send, self._batch.flush))
        else:
            later(lambda: fan_out.unsubscribe(self.topic.name, self._send))

    def _send(self, packet: Packet) -> None:
        if type(packet.message) is self.topic.message_type:
            self._count += 1
            attached = ATTACHED.pack(self._count, packet.nanoseconds, 16, self._gid)
            self._batch.add((self._publisher, packet.cdr, attached))


def _put(batch: list[_Sent]) -> None:
    with suppress(zenoh.ZError):  # the session is being closed
        for publisher, data, attached in batch:
            publisher.put(data, attachment=attached)


def _open(host: str | None) -> tuple[OfZenoh, str]:
    """A session connected to the router, or one that acts as the router, and a description for the user."""
    router = os.environ.get("ZENOH_CONNECT") or f"tcp/127.0.0.1:{ROUTER_PORT}"
    zenoh.init_log_from_env_or("off")
    joined = zenoh.Config()
    joined.insert_json5("mode", '"client"')
    joined.insert_json5("connect/endpoints", f'["{router}"]')
    joined.insert_json5("connect/timeout_ms", "500")
    _keep_local(joined)
    try:
        return zenoh.open(joined), f"connected to the router at {router}"
    except zenoh.ZError as error:
        if os.environ.get("ZENOH_CONNECT"):
            raise KbotError(f"no Zenoh router answers at {router}: {error}") from None
    endpoint = f"tcp/{host or '127.0.0.1'}:{ROUTER_PORT}"
    alone = zenoh.Config()
    alone.insert_json5("mode", '"router"')
    alone.insert_json5("listen/endpoints", f'["{endpoint}"]')
    _keep_local(alone)
    try:
        return zenoh.open(alone), f"acting as the router at {endpoint}"
    except zenoh.ZError as error:
        raise KbotError(f"Zenoh cannot be served at {endpoint}: {error}") from None


def _keep_local(config: OfZenoh) -> None:
    """Do not search for peers by multicast. Late subscribers need timestamps to receive latched messages."""
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("timestamping/enabled", "true")


def _kind(type_name: str) -> str:
    return type_key(type_name, ros2_definition(type_name)[1])


def _domain() -> int:
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not text.isdecimal():
        raise KbotError(f"ROS_DOMAIN_ID must be a whole number, 0 or above, not '{text}'")
    return int(text)
