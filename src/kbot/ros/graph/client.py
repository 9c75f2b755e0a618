"""Client of a KBot that runs in another process: calls services, subscribes to topics and publishes."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack
from types import TracebackType
from typing import Any

from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidURI, WebSocketException
from websockets.frames import CloseCode
from websockets.sync.client import connect

from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.text.suggest import did_you_mean

LARGEST = 1 << 26
"""Bytes of the largest message that is received."""
OPEN_SECONDS = 5.0
RESPONSE_SECONDS = 30.0
"""Seconds to wait for a response. Some services, such as SpawnModel, compile the world again."""

Values = dict[str, Any]  # Any: JSON


class GraphClient:
    """One connection, over the rosbridge protocol. Not thread-safe."""

    def __init__(self, address: str) -> None:
        """Raises KbotError: no KBot answers at the address."""
        self._until_closed = ExitStack()
        try:
            self._socket = self._until_closed.enter_context(
                connect(
                    address, max_size=LARGEST, max_queue=None, open_timeout=OPEN_SECONDS, compression=None
                )
            )
        except (OSError, InvalidHandshake, InvalidURI, TimeoutError) as error:
            raise KbotError(f"no KBot answers at {address.rpartition('/')[0]}: {error}") from None
        self._calls = 0
        self._early: deque[Values] = deque()
        """Messages that arrived while `call` waited for a response."""

    def __enter__(self) -> GraphClient:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._until_closed.close()

    def call(self, service: str, /, **arguments: object) -> Values:
        """Call a service and return its response.

        Raises:
            KbotError: the call failed, or KBot closed the connection.
        """
        self._calls += 1
        number = str(self._calls)
        self._send({"op": "call_service", "service": service, "args": arguments, "id": number})
        while True:
            message = self._receive(RESPONSE_SECONDS)
            if message.get("op") == "service_response" and message.get("id") == number:
                values: Values = message.get("values") or {}
                if not message.get("result"):
                    raise KbotError(str(values.get("message", f"{service} failed")))
                return values
            if message.get("op") == "publish":
                self._early.append(message)

    def messages(self, *topics: str, seconds: float | None = None) -> Iterator[tuple[str, Values]]:
        """Subscribe to topics and yield (topic, message), endlessly or for `seconds`.

        Raises:
            KbotError: there is no such topic, or KBot closed the connection.
        """
        for topic in topics:
            self.subscribe(topic, self.type_of(topic))
        yield from self.receive(seconds)

    def receive(self, seconds: float | None = None) -> Iterator[tuple[str, Values]]:
        """Like `messages`, for the topics that are already subscribed."""
        end = None if seconds is None else time.monotonic() + seconds
        while True:
            message = self._early.popleft() if self._early else self._receive_until(end)
            if message is None:
                return
            if message.get("op") == "publish":
                yield str(message["topic"]), message["msg"]

    def subscribe(self, topic: str, type_name: str) -> None:
        """Make `receive` yield the messages of a topic too."""
        self._send({"op": "subscribe", "topic": topic, "type": type_name})

    def publish(self, topic: str, message: Values, type_name: str = "") -> None:
        """Publish on a topic."""
        if type_name:
            self._send({"op": "advertise", "topic": topic, "type": type_name})
        self._send({"op": "publish", "topic": topic, "msg": message})

    def publish_and_wait(self, topic: str, message: Values, type_name: str) -> None:
        """Publish and wait until the simulation has the message. Raises KbotError: KBot rejected it."""
        self._calls += 1
        number = str(self._calls)
        self._send({"op": "advertise", "topic": topic, "type": type_name})
        self._send({"op": "set_level", "level": "info"})
        self._send({"op": "publish", "topic": topic, "msg": message, "id": number})
        while True:
            reply = self._receive(RESPONSE_SECONDS)
            if reply.get("op") == "status" and reply.get("id") == number:
                return

    def advertise(self, topic: str, type_name: str) -> None:
        """Declare a topic's type before `publish`. Raises KbotError: KBot does not subscribe to the topic."""
        self._send({"op": "advertise", "topic": topic, "type": type_name})
        self.flush()

    def close(self) -> None:
        self._socket.close()

    def flush(self) -> None:
        """Wait until KBot has received all messages. Raises KbotError: KBot rejected a message."""
        self.call("/rosapi/get_time")

    def nanoseconds(self) -> int:
        """The simulated time."""
        now = self.call("/rosapi/get_time")["time"]
        return int(now["secs"]) * 10**9 + int(now["nsecs"])

    def topics(self) -> dict[str, str]:
        """The type of each topic, as ROS 2 writes it."""
        found = self.call("/rosapi/topics")
        types = (name.replace("/", "/msg/") for name in found["types"])
        return dict(sorted(zip(found["topics"], types, strict=True)))

    def subscribed(self) -> set[str]:
        """Names of the topics that KBot subscribes to."""
        nodes = self.call("/rosapi/nodes")["nodes"]
        details = [self.call("/rosapi/node_details", node=node) for node in nodes]
        return {name for found in details for name in found["subscribing"]}

    def type_of(self, topic: str) -> str:
        """A topic's type. Raises KbotError: there is no such topic."""
        known = self.topics()
        if topic not in known:
            hint = did_you_mean(topic, known)
            raise KbotError(f"there is no topic {topic}" + (f": {hint}" if hint else ""))
        return known[topic]

    def _send(self, message: Values) -> None:
        try:
            self._socket.send(json.dumps(message))
        except (OSError, WebSocketException) as error:
            raise _closed(error) from None

    def _receive(self, timeout: float) -> Values:
        message = self._receive_until(time.monotonic() + timeout)
        if message is None:
            raise KbotError(f"KBot did not answer within {timeout:g} s")
        return message

    def _receive_until(self, end: float | None) -> Values | None:
        """The next message, or None if none arrived until `end`."""
        try:
            left = None if end is None else max(0.0, end - time.monotonic())
            message: Values = parse_json(self._socket.recv(left))
        except TimeoutError:
            return None
        except (OSError, WebSocketException) as error:
            raise _closed(error) from None
        if message.get("op") == "status" and message.get("level") == "error":
            raise KbotError(str(message.get("msg")))
        return message


def _closed(error: Exception) -> KbotError:
    close = error.rcvd if isinstance(error, ConnectionClosed) else None
    if close is not None and close.code == CloseCode.MESSAGE_TOO_BIG:
        return KbotError("the message is larger than KBot accepts")
    return KbotError("KBot has closed the connection")
