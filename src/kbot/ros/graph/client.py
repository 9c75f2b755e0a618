"""Client of a running KBot in another process: calls services, subscribes to topics and publishes."""

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
OPEN_SECONDS = 5.0
ANSWER_SECONDS = 30.0

Values = dict[str, Any]  # Any: JSON


class GraphClient:
    """One conversation; not for several threads."""

    def __init__(self, address: str) -> None:
        """Raises KbotError: nothing answers there."""
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
        """Messages that arrived while a reply was awaited."""

    def __enter__(self) -> GraphClient:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._until_closed.close()

    def call(self, service: str, /, **arguments: object) -> Values:
        """The response of a service. Raises KbotError: the call failed, or KBot has closed the connection."""
        self._calls += 1
        number = str(self._calls)
        self._send({"op": "call_service", "service": service, "args": arguments, "id": number})
        while True:
            message = self._receive(ANSWER_SECONDS)
            if message.get("op") == "service_response" and message.get("id") == number:
                values: Values = message.get("values") or {}
                if not message.get("result"):
                    raise KbotError(str(values.get("message", f"{service} failed")))
                return values
            if message.get("op") == "publish":
                self._early.append(message)

    def listen(self, *topics: str, seconds: float | None = None) -> Iterator[tuple[str, Values]]:
        """Topic and message, as they come, for good or for so many seconds. Raises KbotError: no such topic,
        or the KBot is gone."""
        for topic in topics:
            self.subscribe(topic, self.type_of(topic))
        yield from self.heard(seconds)

    def heard(self, seconds: float | None = None) -> Iterator[tuple[str, Values]]:
        """As `listen`, of the topics that are subscribed already."""
        end = None if seconds is None else time.monotonic() + seconds
        while True:
            message = self._early.popleft() if self._early else self._receive_until(end)
            if message is None:
                return
            if message.get("op") == "publish":
                yield str(message["topic"]), message["msg"]

    def subscribe(self, topic: str, type_name: str) -> None:
        """Make `listen` yield the messages of a topic too."""
        self._send({"op": "subscribe", "topic": topic, "type": type_name})

    def publish(self, topic: str, message: Values, type_name: str = "") -> None:
        """Publish on a topic."""
        if type_name:
            self._send({"op": "advertise", "topic": topic, "type": type_name})
        self._send({"op": "publish", "topic": topic, "msg": message})

    def say(self, topic: str, message: Values, type_name: str) -> None:
        """Publish, and wait until KBot has the message. Raises KbotError: KBot rejected it."""
        self._calls += 1
        number = str(self._calls)
        self._send({"op": "advertise", "topic": topic, "type": type_name})
        self._send({"op": "set_level", "level": "info"})
        self._send({"op": "publish", "topic": topic, "msg": message, "id": number})
        while True:
            reply = self._receive(ANSWER_SECONDS)
            if reply.get("op") == "status" and reply.get("id") == number:
                return

    def advertise(self, topic: str, type_name: str) -> None:
        """Declare the type of what `publish` sends. Raises KbotError: KBot does not subscribe to it."""
        self._send({"op": "advertise", "topic": topic, "type": type_name})
        self.settle()

    def close(self) -> None:
        self._socket.close()

    def settle(self) -> None:
        """Wait until KBot has every message that was sent. Raises KbotError: KBot rejected one."""
        self.call("/rosapi/get_time")

    def nanoseconds(self) -> int:
        """The simulation's time."""
        now = self.call("/rosapi/get_time")["time"]
        return int(now["secs"]) * 10**9 + int(now["nsecs"])

    def topics(self) -> dict[str, str]:
        """Names and types, as ROS 2 writes them."""
        found = self.call("/rosapi/topics")
        types = (name.replace("/", "/msg/") for name in found["types"])
        return dict(sorted(zip(found["topics"], types, strict=True)))

    def subscribed(self) -> set[str]:
        """Names of the topics that KBot subscribes to."""
        nodes = self.call("/rosapi/nodes")["nodes"]
        details = [self.call("/rosapi/node_details", node=node) for node in nodes]
        return {name for found in details for name in found["subscribing"]}

    def type_of(self, topic: str) -> str:
        """Raises KbotError: there is no such topic."""
        known = self.topics()
        if topic not in known:
            hint = did_you_mean(topic, known)
            raise KbotError(f"there is no topic {topic}" + (f": {hint}" if hint else ""))
        return known[topic]

    def _send(self, message: Values) -> None:
        try:
            self._socket.send(json.dumps(message))
        except (OSError, WebSocketException) as error:
            raise _gone(error) from None

    def _receive(self, timeout: float) -> Values:
        message = self._receive_until(time.monotonic() + timeout)
        if message is None:
            raise KbotError(f"KBot does not answer within {timeout:g} s")
        return message

    def _receive_until(self, end: float | None) -> Values | None:
        """The next message, or None if none came until `end`."""
        try:
            left = None if end is None else max(0.0, end - time.monotonic())
            message: Values = parse_json(self._socket.recv(left))
        except TimeoutError:
            return None
        except (OSError, WebSocketException) as error:
            raise _gone(error) from None
        if message.get("op") == "status" and message.get("level") == "error":
            raise KbotError(str(message.get("msg")))
        return message


def _gone(error: Exception) -> KbotError:
    closed = error.rcvd if isinstance(error, ConnectionClosed) else None
    if closed is not None and closed.code == CloseCode.MESSAGE_TOO_BIG:
        return KbotError("that is more than KBot takes in one message")
    return KbotError("the KBot is gone")
