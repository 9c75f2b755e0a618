"""The Foxglove WebSocket protocol, for Foxglove and Lichtblick.

Specification: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md. KBot treats both subprotocols
the same.
"""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from kbot.messages.bus import absolute
from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.encodings.serialization import decode_cdr, encode_cdr
from kbot.record.encodings.types import known_type, ros2_definition
from kbot.record.feed import Packet
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.loop import later
from kbot.ros.bridges.service import Service
from kbot.ros.bridges.websocket.server import Data, Wire
from kbot.ros.bridges.websocket.topic_server import MOST_SUBSCRIPTIONS, JsonSession, Request, TopicServer
from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.text.suggest import did_you_mean

SERVICE_REQUEST, SERVICE_RESPONSE = 2, 3
_HEAD = struct.Struct("<BIII")
"""Opcode, service ID, call ID, and the length of the encoding's name."""


class FoxgloveServices:
    """The services that one client was offered, and its calls."""

    def __init__(self, server: TopicServer, wire: Wire) -> None:
        """Advertise the services."""
        self._server, self._wire = server, wire
        self._services = list(server.link.services.values())
        offered = [_advertised(number, service) for number, service in enumerate(self._services)]
        wire.put(json.dumps({"op": "advertiseServices", "services": offered}), keep=True)

    def call(self, data: bytes) -> None:
        """Start a service call. Raises KbotError: the message is not a call, or there is no such service."""
        if len(data) < _HEAD.size:
            raise KbotError("the service call is too short")
        _, number, call, length = _HEAD.unpack_from(data)
        encoding = data[_HEAD.size : _HEAD.size + length].decode(errors="replace")
        body = data[_HEAD.size + length :]
        if number >= len(self._services):
            raise KbotError(f"there is no service with the ID {number}")
        kind = self._services[number].type

        def respond(done: Future[Any]) -> None:  # Any: each service has its own type
            error = done.exception()
            if error is not None:
                later(lambda: self._fail(number, call, str(error)))
                return
            if encoding == "cdr":
                answer = encode_cdr(done.result(), kind.response_name)
            else:
                answer = json.dumps(to_plain(done.result())).encode()
            head = _HEAD.pack(SERVICE_RESPONSE, number, call, len(encoding)) + encoding.encode()
            later(lambda: self._wire.put(head + answer))

        try:
            if encoding == "cdr":
                request = decode_cdr(body, kind.request, kind.request_name)
            elif encoding == "json":
                request = from_plain(parse_json(body), kind.request)
            else:
                raise KbotError(f"the encoding of a service call must be cdr or json, not {encoding[:20]!r}")
            self._server.link.call(self._services[number].name, request).add_done_callback(respond)
        except (KbotError, ValueError, RecursionError) as error:
            self._fail(number, call, str(error))

    def _fail(self, number: int, call: int, why: str) -> None:
        failure = {"op": "serviceCallFailure", "serviceId": number, "callId": call, "message": why}
        self._wire.put(json.dumps(failure))


def _advertised(number: int, service: Service) -> dict[str, object]:
    def part(name: str) -> dict[str, str]:
        text = ros2_definition(name)[0]
        return {"encoding": "cdr", "schemaName": name, "schemaEncoding": "ros2msg", "schema": text}

    kind = service.type
    request, response = part(kind.request_name), part(kind.response_name)
    return {
        "id": number,
        "name": service.name,
        "type": kind.ros2_name,
        "request": request,
        "response": response,
        # the fields of the older subprotocol
        "requestSchema": request["schema"],
        "responseSchema": response["schema"],
    }


SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
ORIGINS = ("https://app.foxglove.dev", "https://studio.foxglove.dev", "https://lichtblick-suite.github.io")
PORT = 8765
MESSAGE_DATA, TIME = 1, 2
ERROR_LEVEL = 2


class FoxgloveBridge(TopicServer):
    """A server whose channels are in CDR with ROS 2 definitions. Late subscribers receive latched messages.

    Clients can publish on inputs in CDR or JSON, call services, and read and set parameters.
    """

    def __init__(self, link: PeerLink, host: str | None = None, port: int = PORT) -> None:
        """Raises KbotError: no port is free, or the address is not one of this machine."""
        self.channels: dict[str, int] = {}
        """The channel ID of each topic."""
        self.session_id = f"{time.time_ns()}"
        self._sessions: list[_Session] = []
        super().__init__(
            "Foxglove",
            link,
            host,
            port,
            self._make_session,
            subprotocols=SUBPROTOCOLS,
            origins=ORIGINS,
        )
        link.watch(lambda: later(self._topics_changed))
        later(self._topics_changed)

    def describe(self) -> str:
        """Where clients connect, in one sentence."""
        return f"Foxglove: open a connection to {self.address}"

    def _make_session(self, wire: Wire) -> _Session:
        session = _Session(self, wire, self._sessions.remove)
        self._sessions.append(session)
        return session

    def _topics_changed(self) -> None:
        for name in self.link.topics:
            self.channels.setdefault(name, len(self.channels) + 1)
        for session in self._sessions:
            session.send_topics()
            session.send_changed_parameters()


class _Session(JsonSession):
    def __init__(self, bridge: FoxgloveBridge, wire: Wire, on_close: Callable[[_Session], None]) -> None:
        self._bridge, self._wire, self._on_close = bridge, wire, on_close
        self._sent_topics: dict[str, Topic] = {}
        self._sinks: dict[int, tuple[str, Callable[[Packet], None]]] = {}
        self._advertised: dict[int, tuple[str, str]] = {}
        self._send(
            op="serverInfo",
            name="KBot",
            capabilities=["clientPublish", "parameters", "parametersSubscribe", "services", "time"],
            supportedEncodings=["cdr", "json"],
            metadata={"ROS_DISTRO": "jazzy"},
            sessionId=bridge.session_id,
        )
        self.send_topics()
        self._services = FoxgloveServices(bridge, wire)
        self._sent_parameters = dict(bridge.link.parameters)
        self._watched: set[str] = set()
        bridge.link.fan_out.subscribe("/clock", self._send_time, wire.send)

    def close(self) -> None:
        self._bridge.link.fan_out.unsubscribe("/clock", self._send_time)
        for topic, sink in self._sinks.values():
            self._bridge.link.fan_out.unsubscribe(topic, sink)
        self._on_close(self)

    def send_error(self, text: str) -> None:
        self._wire.put(json.dumps({"op": "status", "level": ERROR_LEVEL, "message": text}))

    def send_topics(self) -> None:
        """Advertise new topics and unadvertise removed ones."""
        now = self._bridge.link.topics
        removed = [name for name, topic in self._sent_topics.items() if now.get(name) != topic]
        if removed:
            self._send(op="unadvertise", channelIds=[self._bridge.channels[name] for name in removed])
        new = [topic for name, topic in now.items() if self._sent_topics.get(name) != topic]
        if new:
            self._send(op="advertise", channels=[self._channel(topic) for topic in new])
        self._sent_topics = dict(now)

    def receive(self, data: Data) -> None:
        """Process a message. Raises KbotError: it is not one of the protocol, or it fails."""
        if isinstance(data, bytes):
            if data[:1] == bytes([SERVICE_REQUEST]):
                self._services.call(data)
            else:
                self._publish(data)
            return
        super().receive(data)

    def _subscribe(self, request: Request) -> None:
        names = {channel: name for name, channel in self._bridge.channels.items()}
        for item in request["subscriptions"]:
            number, topic = int(item["id"]), names.get(item["channelId"])
            if topic is None:
                raise KbotError(f"there is no channel with the ID {item['channelId']}")
            if number in self._sinks or not 0 <= number < 1 << 32:
                raise KbotError(f"subscription {number} is refused: the ID is in use, or is not 32 bits")
            if len(self._sinks) >= MOST_SUBSCRIPTIONS:
                raise KbotError(f"a client may have at most {MOST_SUBSCRIPTIONS} subscriptions")
            sink = self._sink(number)
            self._sinks[number] = topic, sink
            self._bridge.link.fan_out.subscribe(topic, sink, self._wire.send)

    def _sink(self, number: int) -> Callable[[Packet], None]:
        def send(packet: Packet) -> None:
            self._wire.add(struct.pack("<BIQ", MESSAGE_DATA, number, packet.nanoseconds) + packet.cdr)

        return send

    def _unsubscribe(self, request: Request) -> None:
        for number in request["subscriptionIds"]:
            if number in self._sinks:
                self._bridge.link.fan_out.unsubscribe(*self._sinks.pop(number))

    def _advertise(self, request: Request) -> None:
        for item in request["channels"]:
            topic, encoding = str(item["topic"]), item["encoding"]
            known = self._bridge.link.topics
            if topic not in known or not known[topic].is_input:
                hint = did_you_mean(topic, [name for name, t in known.items() if t.is_input])
                raise KbotError(f"KBot does not subscribe to {topic}" + (f": {hint}" if hint else ""))
            kind = known_type(str(item["schemaName"]))
            if kind is None or encoding not in ("cdr", "json"):
                raise KbotError(f"KBot does not accept {item['schemaName']} in {encoding} on {topic}")
            self._advertised[int(item["id"])] = topic, f"{encoding} {item['schemaName']}"

    def _unadvertise(self, request: Request) -> None:
        for number in request["channelIds"]:
            self._advertised.pop(number, None)

    def _publish(self, data: bytes) -> None:
        if len(data) < 5 or data[0] != MESSAGE_DATA:
            raise KbotError("unknown binary message")
        (number,) = struct.unpack_from("<I", data, 1)
        if number not in self._advertised:
            raise KbotError(f"channel {number} has not been advertised")
        topic, how = self._advertised[number]
        encoding, _, name = how.partition(" ")
        kind = known_type(name)
        if kind is None:
            return
        if encoding == "cdr":
            message = decode_cdr(data[5:], kind)
        else:
            try:
                message = from_plain(parse_json(data[5:]), kind)
            except (ValueError, RecursionError):
                raise KbotError(f"{topic}: the message is not JSON") from None
        self._bridge.link.send(topic, message)

    def send_changed_parameters(self) -> None:
        """Send the parameters that have changed and that the client watches."""
        now = self._bridge.link.parameters
        changed = [name for name, value in now.items() if self._sent_parameters.get(name) != value]
        removed = [name for name in self._sent_parameters if name not in now]
        self._sent_parameters = dict(now)
        if self._watched & {*changed, *removed}:
            self._send_parameters([name for name in (*changed, *removed) if name in self._watched])

    def _get_parameters(self, request: Request) -> None:
        wanted = request.get("parameterNames") or list(self._bridge.link.parameters)
        self._send_parameters([name for name in wanted if name in self._bridge.link.parameters], request)

    def _set_parameters(self, request: Request) -> None:
        names = []
        for item in request["parameters"]:
            names.append(absolute(str(item["name"])))
            self._bridge.link.set_parameter(names[-1], item.get("value"))
        if "id" in request:
            self._send_parameters(names, request)

    def _watch_parameters(self, request: Request) -> None:
        self._watched.update(map(str, request["parameterNames"]))

    def _unwatch_parameters(self, request: Request) -> None:
        self._watched.difference_update(map(str, request["parameterNames"]))

    def _send_parameters(self, names: list[str], request: Request | None = None) -> None:
        values = self._bridge.link.parameters
        found = [{"name": name, **({"value": values[name]} if name in values else {})} for name in names]
        answer = {"id": request["id"]} if request and "id" in request else {}
        self._wire.put(json.dumps({"op": "parameterValues", "parameters": found, **answer}))

    def _send_time(self, packet: Packet) -> None:
        self._wire.add(struct.pack("<BQ", TIME, packet.nanoseconds))

    def _channel(self, topic: Topic) -> dict[str, object]:
        return {
            "id": self._bridge.channels[topic.name],
            "topic": topic.name,
            "encoding": "cdr",
            "schemaName": topic.type_name,
            "schema": ros2_definition(topic.type_name)[0],
            "schemaEncoding": "ros2msg",
        }

    def _send(self, **message: object) -> None:
        self._wire.put(json.dumps(message), keep=True)

    operations = {  # noqa: RUF012 - a constant
        "subscribe": _subscribe,
        "unsubscribe": _unsubscribe,
        "advertise": _advertise,
        "unadvertise": _unadvertise,
        "getParameters": _get_parameters,
        "setParameters": _set_parameters,
        "subscribeParameterUpdates": _watch_parameters,
        "unsubscribeParameterUpdates": _unwatch_parameters,
    }
