"""Subscribes to a topic over TCPROS, with a thread for each publisher."""

from __future__ import annotations

import contextlib
import socket
import threading

from kbot.record.encodings.serialization import decode_ros1
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes
from kbot.ros.bridges.ros1.rpc import RpcFailed, call
from kbot.ros.bridges.ros1.tcpros import (
    HANDSHAKE_SECONDS,
    ProtocolError,
    encode_header,
    read_block,
    read_header,
)
from kbot.ros.bridges.ros1.topic import TopicEndpoint
from kbot.text import KbotError

RETRY_SECONDS = 1.0
"""Seconds between two attempts to connect to a publisher."""
MOST_PUBLISHERS = 32
"""Publishers of a topic that are connected. Each needs a thread."""


class SubscribedTopic(TopicEndpoint):
    """Connects to each publisher of a topic and passes its messages to the simulation."""

    def __init__(self, link: PeerLink, topic: Topic, node: str, allowed_nodes: AllowedNodes) -> None:
        super().__init__(link, topic, node)
        self.allowed_nodes = allowed_nodes
        self._lock = threading.Lock()
        self._publishers: dict[str, _Publisher] = {}

    @property
    def peers(self) -> list[str]:
        """URIs of the publishers."""
        with self._lock:
            return list(self._publishers)

    def update(self, uris: list[str]) -> None:
        """Connect to these publishers, if they are allowed, and to no others."""
        with self._lock:
            removed = [self._publishers.pop(uri) for uri in list(self._publishers) if uri not in uris]
            allowed = [uri for uri in uris if not self.allowed_nodes.refusal_of_uri(uri)]
            for uri in allowed[:MOST_PUBLISHERS]:
                if uri not in self._publishers:
                    self._publishers[uri] = _Publisher(self, self._link, self._node, uri)
        for publisher in removed:
            publisher.close()

    def close(self) -> None:
        self.update([])


class _Publisher:
    def __init__(self, endpoint: SubscribedTopic, link: PeerLink, node: str, uri: str) -> None:
        self._endpoint, self._link, self._node, self._uri = endpoint, link, node, uri
        self._closed = threading.Event()
        self._connection: socket.socket | None = None
        threading.Thread(target=self._run, daemon=True, name="kbot-ros1-in").start()

    def close(self) -> None:
        self._closed.set()
        connection = self._connection
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                self._receive()
            except (OSError, RpcFailed):
                pass  # try again, as long as the master lists the publisher
            except (ProtocolError, KbotError) as error:
                name = self._endpoint.topic.name
                self._link.report(f"ROS 1: cannot subscribe to {name} of {self._uri}: {error}")
            self._closed.wait(RETRY_SECONDS)

    def _receive(self) -> None:
        topic = self._endpoint.topic
        answer = call(self._uri, "requestTopic", self._node, topic.name, [["TCPROS"]])
        try:
            _, host, port = answer
            address = str(host), int(port)
        except (TypeError, ValueError):
            raise ProtocolError(f"its answer to requestTopic has no address: {answer!r}") from None
        if refusal := self._endpoint.allowed_nodes.refusal(address[0]):
            raise ProtocolError(refusal)
        with socket.create_connection(address, HANDSHAKE_SECONDS) as connection:
            self._connection = connection
            connection.sendall(encode_header(self._endpoint.header(tcp_nodelay="1")))
            header = read_header(connection)
            self._endpoint.check(header)
            node = header.get("callerid", "")
            connection.settimeout(None)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            while not self._closed.is_set():
                message = decode_ros1(read_block(connection), topic.message_type)
                self._link.send(topic.name, message, source=node)
