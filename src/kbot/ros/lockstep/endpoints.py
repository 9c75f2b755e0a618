"""Where programs connect to a simulation: to its own server, ROS 1 master or ROS 2 domain."""

from __future__ import annotations

import errno
import socket
from typing import Protocol

from kbot.messages.types import Twist, TwistStamped
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import ros1_types
from kbot.ros.bridges import ros2
from kbot.ros.bridges.link import Topic
from kbot.ros.graph.server import GraphServer
from kbot.ros.lockstep.link import LockstepLink
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

LOOPBACK = "127.0.0.1"
REGISTER_SECONDS = 10.0
HIGHEST_FREE_DOMAIN = 100
"""The ROS documentation recommends domains up to 101, whose ports are below those of other programs."""
FIRST_PORT, DOMAIN_PORTS, UNICAST = 7400, 250, 10
"""The UDP ports of DDS: those of domain n begin at FIRST_PORT + n DOMAIN_PORTS, and UNICAST after that is the
port of its first participant."""


class Endpoint(Protocol):
    """The simulation, as the nodes of one or more programs see it."""

    simulation: str
    """The identity of the simulation."""
    repeats_latched: bool
    """Whether late subscribers receive the last message of a latched topic."""
    environment: dict[str, str]
    """Makes a node connect to it."""

    def identity_of(self, reported: str) -> str:
        """The source of a node's messages. The node has `reported` the identity that its transport has."""
        ...

    def publishes(self, topic: Topic) -> bool: ...

    def refusal(self, topic: str, type_name: str, publishes: bool) -> str:
        """Why a node cannot publish on a topic or subscribe to it, or an empty text."""
        ...

    def is_connected(self, topic: str, peer: str, publishes: bool) -> bool:
        """Whether the simulation's side of a topic, which it `publishes` or not, is ready for a node."""
        ...

    def has_peers(self) -> bool:
        """Whether anything is connected."""
        ...

    def close(self) -> None: ...


class LocalEndpoint:
    """A server for one program."""

    simulation = ""
    repeats_latched = True

    def __init__(self, link: LockstepLink, program: str) -> None:
        """Raises KbotError: no port is free."""
        self._link = link
        self._program = program
        self._server = GraphServer(link, program)
        self.environment = {"KBOT_TRANSPORT": "local", "KBOT_AT": self._server.address}

    def identity_of(self, reported: str) -> str:
        return self._program

    def publishes(self, topic: Topic) -> bool:
        return True  # it also passes on the messages of others

    def refusal(self, topic: str, type_name: str, publishes: bool) -> str:
        found = self._link.topics.get(topic)
        if found is None:
            hint = did_you_mean(topic, self._link.topics)
            return f"there is no topic {topic}" + (f": {hint}" if hint else "")
        if publishes and not found.is_input:
            return f"KBot publishes {topic} and does not subscribe to it"
        return _wrong_type(found, type_name, publishes)

    def is_connected(self, topic: str, peer: str, publishes: bool) -> bool:
        return not publishes or self._server.has_subscriber(topic)

    def has_peers(self) -> bool:
        return bool(self._server.sessions)

    def close(self) -> None:
        self._server.close()


class Ros1Endpoint:
    """The node /kbot and an own master on a free port, for any number of programs."""

    repeats_latched = True

    def __init__(self, link: LockstepLink) -> None:
        """Raises KbotError: no port is free."""
        from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes  # imported lazily: only ROS 1 needs it
        from kbot.ros.bridges.ros1.bridge import Ros1Bridge
        from kbot.ros.bridges.ros1.master import Master

        self._link = link
        try:
            self._master = Master(LOOPBACK, 0, AllowedNodes(LOOPBACK, link.report, False))
        except OSError as error:
            raise KbotError(f"a ROS 1 master cannot be started: {error.strerror or error}") from None
        self._bridge = Ros1Bridge(link, LOOPBACK, self._master.uri, own_master=False)
        if not self._bridge.wait_until_registered(REGISTER_SECONDS):  # else a program may miss a parameter
            raise KbotError(f"the ROS 1 master of the trial did not answer within {REGISTER_SECONDS:g} s")
        self.simulation, self.is_connected = self._bridge.identity, self._bridge.is_connected
        self.has_peers = self._bridge.has_peers
        self.environment = {"KBOT_TRANSPORT": "ros1", "ROS_MASTER_URI": self._master.uri}

    def identity_of(self, reported: str) -> str:
        return reported

    def publishes(self, topic: Topic) -> bool:
        return not topic.is_input and topic.type_name in ros1_types().fielddefs

    def refusal(self, topic: str, type_name: str, publishes: bool) -> str:
        found = self._link.topics.get(topic)
        return "" if found is None else _wrong_type(found, type_name, False)

    def close(self) -> None:
        self._bridge.close()
        self._master.close()


class Ros2Endpoint:
    """The node /kbot in a ROS 2 domain that nothing else uses, for any number of programs."""

    repeats_latched = False
    """Subscribers are volatile, as in ROS 2 by default."""

    def __init__(self, link: LockstepLink) -> None:
        """Raises KbotError: the extra is not installed, or no domain is free."""
        self._link = link
        domain = free_domain()
        self._bridge = ros2.open_bridge(link, LOOPBACK, domain=domain, lossless=True)
        self.simulation, self.is_connected = self._bridge.identity, self._bridge.is_connected
        self.has_peers = self._bridge.has_peers
        self.environment = {
            "KBOT_TRANSPORT": "ros2",
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }

    def identity_of(self, reported: str) -> str:
        return reported

    def publishes(self, topic: Topic) -> bool:
        return not topic.is_input

    def refusal(self, topic: str, type_name: str, publishes: bool) -> str:
        found = self._link.topics.get(topic)
        return "" if found is None else _wrong_type(found, type_name, publishes)

    def close(self) -> None:
        self._bridge.close()


def _wrong_type(found: Topic, type_name: str, may_be_stamped: bool) -> str:
    accepted = {found.type_name}
    if may_be_stamped and found.message_type is Twist:
        accepted.add(ros_name(TwistStamped))
    return "" if type_name in accepted else f"{found.name} carries {found.type_name}, not {type_name}"


_reserved: list[tuple[int, socket.socket]] = []
"""The domain of this process, and the socket that reserves it. DDS keeps a domain until the process ends."""


def free_domain() -> int:
    """A ROS domain that no other process uses, nor another KBot in its trials. It stays with this process.

    Raises:
        KbotError: all domains are in use.
    """
    for domain in range(HIGHEST_FREE_DOMAIN, 0, -1) if not _reserved else ():
        port = FIRST_PORT + DOMAIN_PORTS * domain
        try:
            # DDS uses only UDP, so the TCP port of the same number is free to mark the domain as taken
            mark = socket.create_server((LOOPBACK, port))
        except OSError:
            continue
        if _is_bound(port + UNICAST):
            mark.close()
            continue
        _reserved.append((domain, mark))
        break
    if not _reserved:
        raise KbotError(f"the ROS domains 1 to {HIGHEST_FREE_DOMAIN} are all in use. End other programs")
    return _reserved[0][0]


def _is_bound(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", port))
        except OSError as error:
            return error.errno == errno.EADDRINUSE
    return False
