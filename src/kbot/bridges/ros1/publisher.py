"""One topic going out over TCPROS: each subscriber has its own queue and thread; none waits for another."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from collections import deque

from kbot.bridges.link import Link, Topic
from kbot.bridges.ros1.services import serve_service
from kbot.bridges.ros1.tcpros import HANDSHAKE_SECONDS, ProtocolError, encode_header, read_header
from kbot.bridges.ros1.topic import TopicEnd
from kbot.wire import Packet

QUEUE = 100
"""Messages that wait for a slow subscriber; of more the newest are kept."""
SILENT_SECONDS = 10.0
"""A subscriber that takes nothing for this long is let go."""


class Outgoing(TopicEnd):
    """A topic that subscribers come to. It is heard of the simulation while one is there."""

    def __init__(self, link: Link, topic: Topic, node: str) -> None:
        super().__init__(link, topic, node)
        self._subscribers: list[_Subscriber] = []
        self._last: bytes | None = None
        self._is_closed = False
        if topic.is_latched:
            link.open(topic.name, self._send)

    @property
    def peers(self) -> list[str]:
        """Names of the nodes that are connected."""
        with self._lock:
            return [subscriber.node for subscriber in self._subscribers]

    def serve(self, connection: socket.socket, header: dict[str, str]) -> None:
        """Talk to one subscriber until it goes; on a thread of its own.

        Raises:
            ProtocolError: it wants another type.
            OSError: it is gone.
        """
        self.check(header)
        connection.sendall(encode_header(self.header(latching=str(int(self.topic.is_latched)))))
        connection.settimeout(SILENT_SECONDS)
        subscriber = _Subscriber(connection, header.get("callerid", "?"))
        self._add(subscriber)
        try:
            subscriber.run()
        finally:
            self._remove(subscriber)

    def close(self) -> None:
        """Let every subscriber go."""
        with self._lock:
            self._is_closed = True
            subscribers = list(self._subscribers)
        for subscriber in subscribers:
            subscriber.close()
        self._link.close(self.topic.name, self._send)

    def _add(self, subscriber: _Subscriber) -> None:
        with self._lock:
            if self._is_closed:
                raise ConnectionAbortedError("the topic is gone")
            if not self._subscribers and not self.topic.is_latched:
                self._link.open(self.topic.name, self._send)
            self._subscribers.append(subscriber)
            if self._last is not None:
                subscriber.put(self._last)
                subscriber.wake()

    def _remove(self, subscriber: _Subscriber) -> None:
        with self._lock:
            self._subscribers.remove(subscriber)
            if not self._subscribers and not self.topic.is_latched:
                self._link.close(self.topic.name, self._send)

    def _send(self, packet: Packet) -> None:
        """On the simulation's thread."""
        data = struct.pack("<I", len(packet.ros1)) + packet.ros1
        with self._lock:
            if self.topic.is_latched:
                self._last = data
            for subscriber in self._subscribers:
                subscriber.put(data)
                self._link.stir(subscriber.wake)


class _Subscriber:
    def __init__(self, connection: socket.socket, node: str) -> None:
        self.node = node
        self._connection = connection
        self._queue: deque[bytes] = deque(maxlen=QUEUE)
        self._wake = threading.Condition()
        self._is_open = True

    def put(self, data: bytes) -> None:
        with self._wake:
            self._queue.append(data)

    def wake(self) -> None:
        """Let what was put be sent."""
        with self._wake:
            self._wake.notify()

    def close(self) -> None:
        with self._wake:
            self._is_open = False
            self._wake.notify()
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)

    def run(self) -> None:
        """Send what comes until the other side goes. Raises OSError."""
        while True:
            with self._wake:
                if not self._queue and self._is_open:
                    self._wake.wait(1.0)
                if not self._is_open:
                    return
                waiting = list(self._queue)
                self._queue.clear()
            if waiting:
                self._connection.sendall(b"".join(waiting))
            elif _is_gone(self._connection):
                return


def _is_gone(connection: socket.socket) -> bool:
    """Whether the other side has hung up; subscribers never say anything."""
    connection.setblocking(False)
    try:
        return connection.recv(1, socket.MSG_PEEK) == b""
    except BlockingIOError:
        return False
    finally:
        connection.settimeout(SILENT_SECONDS)


class Door:
    """Where subscribers of all topics, and callers of all services, come in."""

    MOST = 200

    def __init__(self, host: str, link: Link, node: str, topics: dict[str, Outgoing]) -> None:
        """`topics` may change while it is open. Raises OSError: the address is not this machine's."""
        self._listening = socket.create_server((host, 0), backlog=64)
        self.port = int(self._listening.getsockname()[1])
        self._link, self._node, self._topics = link, node, topics
        self._free = threading.BoundedSemaphore(self.MOST)
        threading.Thread(target=self._accept, daemon=True, name="kbot-ros1-door").start()

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listening.accept()
            except OSError:
                if self._listening.fileno() < 0:
                    return
                continue
            if not self._free.acquire(blocking=False):
                connection.close()
                continue
            threading.Thread(
                target=self._serve, args=(connection,), daemon=True, name="kbot-ros1-out"
            ).start()

    def _serve(self, connection: socket.socket) -> None:
        try:
            with connection:
                self._talk(connection)
        except OSError:
            return  # it went; others are not concerned
        finally:
            self._free.release()

    def _talk(self, connection: socket.socket) -> None:
        connection.settimeout(HANDSHAKE_SECONDS)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        try:
            header = read_header(connection)
            if "service" in header:
                serve_service(self._link, self._node, connection, header)
                return
            outgoing = self._topics.get(header.get("topic", ""))
            if outgoing is None:
                raise ProtocolError(f"there is no topic '{header.get('topic', '')}' here")
            outgoing.serve(connection, header)
        except ProtocolError as error:
            self._link.tell(f"ROS 1: a peer was turned away: {error}")
            connection.sendall(encode_header({"error": str(error)}))
