"""How a node reaches others: a KBot on this machine, a ROS 1 master, or DDS."""

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
    """Hears what the node's link hears, and says what it says. A thread of its own listens."""

    uses_sim_time = True

    def __init__(self, link: PeerLink) -> None:
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

    def parameter(self, name: str) -> ParameterValue:
        with self._lock:
            if not self._asks.call("/rosapi/has_param", name=name).get("exists"):
                return None
            value: ParameterValue = json.loads(self._asks.call("/rosapi/get_param", name=name)["value"])
            return value

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


TRANSPORTS = ("local", "ros1", "ros2")
_SAYS = "KBOT_TRANSPORT"


class Transport(Protocol):
    """Carries a link's topics, on threads of its own."""

    uses_sim_time: bool
    """Whether the node's time is that of /clock."""
    failure: KbotError | None
    """Why it reaches nobody any more, if that is for good."""

    def parameter(self, name: str) -> ParameterValue:
        """The value of a parameter by its full name; None where there is none."""
        ...

    def close(self) -> None: ...


def wanted_transport(environment: Mapping[str, str]) -> str:
    """`ros1` in an environment of ROS 1, `ros2` in one of ROS 2, else `local`; KBOT_TRANSPORT says otherwise.

    Raises:
        KbotError: KBOT_TRANSPORT is none of these.
    """
    said = environment.get(_SAYS)
    if said:
        if said not in TRANSPORTS:
            raise KbotError(f"{_SAYS} is {', '.join(TRANSPORTS[:-1])} or {TRANSPORTS[-1]}, not '{said}'")
        return said
    if environment.get("ROS_VERSION") == "2":
        return "ros2"
    if environment.get("ROS_MASTER_URI") or environment.get("ROS_VERSION") == "1":
        return "ros1"
    return "ros2" if environment.get("ROS_DISTRO") else "local"


def open_transport(kind: str, link: PeerLink, node: NodeArguments) -> Transport:
    """Raises KbotError: there is nothing to reach that way; the text says what to start."""
    if kind == "local":
        return LocalTransport(link)
    if kind == "ros1":
        return _Ros1(link, node)
    return _Ros2(link, node)


class _Ros1:
    failure: KbotError | None = None
    """Never: a master may come back."""

    def __init__(self, link: PeerLink, node: NodeArguments) -> None:
        from kbot.ros.bridges.ros1.bridge import Ros1Bridge  # lazy in this module: only with ROS 1

        self._node = node.full_name
        # a user's own node trusts the master that its environment names, like any node of ROS 1
        self._bridge = Ros1Bridge(link, node=self._node, own_master=False, other_machines=True)
        self.uses_sim_time = bool(self.parameter("/use_sim_time"))

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

    def __init__(self, link: PeerLink, node: NodeArguments) -> None:
        self._bridge = ros2.open_bridge(link, None, node.full_name)
        self.uses_sim_time = bool(node.parameters.get("use_sim_time"))

    def parameter(self, name: str) -> ParameterValue:
        return None  # a node of ROS 2 has its parameters from its command line alone

    def close(self) -> None:
        self._bridge.close()
