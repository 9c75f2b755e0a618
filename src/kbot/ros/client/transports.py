"""The transports of a node: a KBot on this machine, a ROS 1 master, or ROS 2 over DDS."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Mapping
from typing import Protocol

from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.feed import Packet
from kbot.ros.bridges import ros2
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.client.arguments import NodeArguments
from kbot.ros.graph.client import GraphClient
from kbot.ros.graph.presence import find
from kbot.ros.parameter_values import ParameterValue
from kbot.text import KbotError


class LocalTransport:
    """Connects the node's topics to a KBot on this machine. Its own thread receives messages."""

    uses_sim_time = True
    identity = ""
    """KBot knows this client by its connection."""

    def __init__(self, link: PeerLink) -> None:
        """Raises KbotError: no KBot runs, or several run and KBOT_AT selects none of them."""
        address = find(os.environ.get("KBOT_AT", ""), "KBOT_AT=NUMBER")
        self._link = link
        # two connections: one blocks on messages while the other calls services and publishes
        self._requests, self._incoming = GraphClient(address), GraphClient(address)
        self._lock = threading.Lock()
        """Held while `_requests` is used."""
        self._known: set[str] = set()
        self.failure: KbotError | None = None
        self._is_closed = False
        link.watch(self._connect_topics)
        self._thread = threading.Thread(target=self._receive, daemon=True, name="kbot-local")
        self._thread.start()

    def parameter(self, name: str) -> ParameterValue:
        with self._lock:
            if not self._requests.call("/rosapi/has_param", name=name).get("exists"):
                return None
            value: ParameterValue = json.loads(self._requests.call("/rosapi/get_param", name=name)["value"])
            return value

    def is_connected(self, topic: str, peer: str, publishes: bool) -> bool:
        return True  # KBot knows when it has the subscription, and `advertise` waits

    def close(self) -> None:
        self._is_closed = True
        with self._lock:
            self._requests.close()
        self._incoming.close()
        self._thread.join(2.0)

    def _connect_topics(self) -> None:
        """Subscribe to or advertise the node's new topics. Called on the node's thread."""
        for topic in list(self._link.topics.values()):
            if topic.name in self._known:
                continue
            self._known.add(topic.name)
            try:
                if topic.is_input:
                    self._require(topic)
                    self._incoming.subscribe(topic.name, topic.type_name)
                else:
                    with self._lock:
                        self._requests.advertise(topic.name, topic.type_name)
                    self._link.open(topic.name, self._publish)
            except KbotError as error:
                self._link.report(str(error))

    def _require(self, topic: Topic) -> None:
        with self._lock:
            kind = self._requests.type_of(topic.name)
        if kind != topic.type_name:
            raise KbotError(f"{topic.name} carries {kind}, not {topic.type_name}")

    def _publish(self, packet: Packet) -> None:
        """Called on the node's thread. Raises KbotError: KBot has disconnected or rejects the message."""
        with self._lock:
            self._requests.publish(packet.topic, to_plain(packet.message, exact=True))

    def _receive(self) -> None:
        try:
            for name, fields in self._incoming.receive():
                topic = self._link.topics.get(name)
                if topic is not None:
                    self._link.send(name, from_plain(fields, topic.message_type))
        except KbotError as error:
            if not self._is_closed:
                self.failure = error


TRANSPORTS = ("local", "ros1", "ros2")
_VARIABLE = "KBOT_TRANSPORT"


class Transport(Protocol):
    """Connects a link's topics to peers, on its own threads."""

    uses_sim_time: bool
    """Whether the node's time is that of /clock."""
    failure: KbotError | None
    """Why the connection was lost for good; None while it may still work."""

    @property
    def identity(self) -> str:
        """The `source` of this node's messages at the links of its peers."""
        ...

    def is_connected(self, topic: str, peer: str, publishes: bool) -> bool:
        """Whether this side of a topic, which it `publishes` or not, is ready for a peer."""
        ...

    def parameter(self, name: str) -> ParameterValue:
        """The value of a parameter by its full name; None if it is not set."""
        ...

    def close(self) -> None: ...


def wanted_transport(environment: Mapping[str, str]) -> str:
    """The transport that the environment selects: KBOT_TRANSPORT, else the variables of ROS, else `local`.

    Raises:
        KbotError: KBOT_TRANSPORT has another value.
    """
    selected = environment.get(_VARIABLE)
    if selected:
        if selected not in TRANSPORTS:
            names = f"{', '.join(TRANSPORTS[:-1])} or {TRANSPORTS[-1]}"
            raise KbotError(f"{_VARIABLE} must be {names}, not '{selected}'")
        return selected
    if environment.get("ROS_VERSION") == "2":
        return "ros2"
    if environment.get("ROS_MASTER_URI") or environment.get("ROS_VERSION") == "1":
        return "ros1"
    return "ros2" if environment.get("ROS_DISTRO") else "local"


def open_transport(kind: str, link: PeerLink, node: NodeArguments, *, lossless: bool = False) -> Transport:
    """Connect a node. With `lossless`, no message is dropped, as lockstep needs it.

    Raises:
        KbotError: no peer was found. The error names what to start.
    """
    if kind == "local":
        return LocalTransport(link)
    if kind == "ros1":
        return _Ros1(link, node)
    return _Ros2(link, node, lossless)


class _Ros1:
    failure: KbotError | None = None
    """Always None: the bridge reconnects when the master is back."""

    def __init__(self, link: PeerLink, node: NodeArguments) -> None:
        from kbot.ros.bridges.ros1.bridge import Ros1Bridge  # imported lazily: only ROS 1 needs it

        self._node = node.full_name
        # like any ROS 1 node, a user's node contacts all nodes that the master of its environment names
        self._bridge = Ros1Bridge(link, node=self._node, own_master=False, other_machines=True)
        self.uses_sim_time = bool(self.parameter("/use_sim_time"))
        self.identity = self._bridge.identity
        self.is_connected = self._bridge.is_connected

    def parameter(self, name: str) -> ParameterValue:
        from kbot.ros.bridges.ros1.rpc import RpcFailed, call

        try:
            if not call(self._bridge.master, "hasParam", self._node, name):
                return None
            value: ParameterValue = call(self._bridge.master, "getParam", self._node, name)
            return value
        except RpcFailed:
            return None

    def close(self) -> None:
        self._bridge.close()


class _Ros2:
    failure: KbotError | None = None

    def __init__(self, link: PeerLink, node: NodeArguments, lossless: bool) -> None:
        self._bridge = ros2.open_bridge(link, None, node.full_name, lossless=lossless)
        self.uses_sim_time = bool(node.parameters.get("use_sim_time"))
        self.identity = self._bridge.identity
        self.is_connected = self._bridge.is_connected

    def parameter(self, name: str) -> ParameterValue:
        return None  # in ROS 2 a node gets its parameters only from its command line

    def close(self) -> None:
        self._bridge.close()
