"""The rosbridge protocol, version 2, for roslibjs and roslibpy: JSON over a WebSocket.

https://github.com/RobotWebTools/rosbridge_suite/blob/ros1/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from kbot.messages.bus import absolute
from kbot.messages.types import Time
from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.encodings.types import known_type
from kbot.record.feed import Packet
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.loop import later, wait_for
from kbot.ros.bridges.websocket.server import Wire
from kbot.ros.bridges.websocket.topic_server import MOST_SUBSCRIPTIONS, JsonSession, Request, TopicServer
from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.text.suggest import did_you_mean

NODE = "/kbot"

Values = dict[str, Any]  # Any: JSON


def call_rosapi(link: PeerLink, service: str, arguments: Values) -> Values:
    """Call a service of rosapi and return its response.

    Raises:
        KbotError: there is no such service, topic or parameter.
    """
    answer = SERVICES.get(service.removeprefix("/rosapi/")) if service.startswith("/rosapi/") else None
    if answer is None:
        hint = did_you_mean(service, [*link.services, *_ROSAPI])
        raise KbotError(f"there is no service {service}" + (f": {hint}" if hint else ""))
    if not isinstance(arguments, dict):
        raise KbotError(f"the arguments of {service} must be a JSON object")
    return answer(link, arguments)


def _short(name: str) -> str:
    return name.replace("/msg/", "/")


def _topics(link: PeerLink, arguments: Values) -> Values:
    topics = link.topics.values()
    return {"topics": [t.name for t in topics], "types": [_short(t.type_name) for t in topics]}


def _topics_for_type(link: PeerLink, arguments: Values) -> Values:
    wanted = _short(str(arguments.get("type", "")))
    return {"topics": [t.name for t in link.topics.values() if _short(t.type_name) == wanted]}


def _topic_type(link: PeerLink, arguments: Values) -> Values:
    topic = link.topics.get(str(arguments.get("topic", "")))
    return {"type": _short(topic.type_name) if topic else ""}


def _publishers(link: PeerLink, arguments: Values) -> Values:
    topic = link.topics.get(str(arguments.get("topic", "")))
    return {"publishers": [NODE] if topic and not topic.is_input else []}


def _subscribers(link: PeerLink, arguments: Values) -> Values:
    topic = link.topics.get(str(arguments.get("topic", "")))
    return {"subscribers": [NODE] if topic and topic.is_input else []}


def _get_param(link: PeerLink, arguments: Values) -> Values:
    name = str(arguments.get("name", ""))
    if name not in link.parameters:
        if arguments.get("default"):
            return {"value": arguments["default"]}
        hint = did_you_mean(name, link.parameters)
        raise KbotError(f"there is no parameter {name}" + (f": {hint}" if hint else ""))
    return {"value": json.dumps(link.parameters[name])}


def _set_param(link: PeerLink, arguments: Values) -> Values:
    """As in rosapi, the value is a text that contains JSON."""
    name = str(arguments.get("name", ""))
    try:
        value = parse_json(str(arguments.get("value")))
        link.set_parameter(absolute(name), value)
    except ValueError:
        raise KbotError(f"the value of {name} is not JSON, or is nested too deeply") from None
    return {}


def _delete_param(link: PeerLink, arguments: Values) -> Values:
    link.set_parameter(str(arguments.get("name", "")), None)
    return {}


def _types(link: PeerLink) -> Values:
    return {name: service.type.name for name, service in link.services.items()}


def _service_type(link: PeerLink, arguments: Values) -> Values:
    return {"type": _types(link).get(str(arguments.get("service", "")), "")}


def _services_for_type(link: PeerLink, arguments: Values) -> Values:
    wanted = str(arguments.get("type", "")).replace("/srv/", "/")
    return {"services": [name for name, kind in _types(link).items() if kind == wanted]}


def _node_details(link: PeerLink, arguments: Values) -> Values:
    topics = link.topics.values()
    return {
        "publishing": [topic.name for topic in topics if not topic.is_input],
        "subscribing": [topic.name for topic in topics if topic.is_input],
        "services": list(link.services),
    }


def _service_node(link: PeerLink, arguments: Values) -> Values:
    return {"node": NODE if arguments.get("service") in link.services else ""}


def _get_time(link: PeerLink, arguments: Values) -> Values:
    now = Time.from_nanoseconds(link.nanoseconds)
    return {"time": {"secs": now.sec, "nsecs": now.nanosec}}


SERVICES: dict[str, Callable[[PeerLink, Values], Values]] = {
    "topics": _topics,
    "topics_for_type": _topics_for_type,
    "topic_type": _topic_type,
    "publishers": _publishers,
    "subscribers": _subscribers,
    "nodes": lambda link, arguments: {"nodes": [NODE]},
    "services": lambda link, arguments: {"services": [*link.services, *_ROSAPI]},
    "services_for_type": _services_for_type,
    "service_type": _service_type,
    "service_node": _service_node,
    "node_details": _node_details,
    "set_param": _set_param,
    "delete_param": _delete_param,
    "get_param": _get_param,
    "has_param": lambda link, arguments: {"exists": arguments.get("name") in link.parameters},
    "get_param_names": lambda link, arguments: {"names": list(link.parameters)},
    "get_time": _get_time,
}
_ROSAPI: list[str] = [f"/rosapi/{name}" for name in SERVICES]


PORT = 9090


class RosbridgeBridge(TopicServer):
    """A server with topics, services, and the services of rosapi about them."""

    def __init__(
        self,
        link: PeerLink,
        host: str | None = None,
        port: int = PORT,
        *,
        token: str = "",
        exact: bool = False,
        client: str = "",
    ) -> None:
        """Start the server.

        `token` is the path that clients must use. With `exact`, NaN and infinity, which JSON lacks, are sent
        as Python's `json` writes them; otherwise they are null. `client` is the source of its clients'
        messages at the link.

        Raises:
            KbotError: no port is free, or the address is not one of this machine.
        """
        self.exact, self.client = exact, client
        self.sessions = set[_Session]()
        """The sessions of the connected clients. Used on the loop."""
        super().__init__("rosbridge", link, host, port, lambda wire: _Session(self, wire), token=token)

    def describe(self) -> str:
        """Where clients connect, in one sentence."""
        return f"rosbridge: {self.address}"

    def has_subscriber(self, topic: str) -> bool:
        """Whether a client receives the messages of a topic."""
        return wait_for(self._has_subscriber(topic))

    async def _has_subscriber(self, topic: str) -> bool:
        return any(session.subscribes(topic) for session in self.sessions)


class _Subscription:
    """One client's subscription. `throttle` is the shortest interval of messages, in ns of simulated time."""

    def __init__(self, wire: Wire, topic: str, is_ros1: bool, throttle: int, exact: bool) -> None:
        self._wire, self.topic, self._throttle = wire, topic, throttle
        self._is_ros1, self._exact = is_ros1, exact
        self._head = f'{{"op": "publish", "topic": {json.dumps(topic)}, "msg": '
        self._last: int | None = None

    def send(self, packet: Packet) -> None:
        now = packet.nanoseconds
        if self._last is not None and 0 <= now - self._last < self._throttle:
            return
        self._last = now
        self._wire.add(self._head + packet.json(ros1=self._is_ros1, exact=self._exact) + "}")


class _Session(JsonSession):
    def __init__(self, bridge: RosbridgeBridge, wire: Wire) -> None:
        self._bridge, self._wire = bridge, wire
        self._subscriptions: dict[tuple[str, str], _Subscription] = {}
        self._types: dict[str, type] = {}
        self._confirms = False
        """Whether the client asked for a status also when a message was accepted."""
        bridge.sessions.add(self)

    def subscribes(self, topic: str) -> bool:
        return any(name == topic for name, _ in self._subscriptions)

    def close(self) -> None:
        self._bridge.sessions.discard(self)
        for subscription in self._subscriptions.values():
            self._bridge.link.fan_out.unsubscribe(subscription.topic, subscription.send)

    def send_error(self, text: str) -> None:
        self._wire.put(json.dumps({"op": "status", "level": "error", "msg": text}))

    def _subscribe(self, request: Request) -> None:
        topic = self._known(str(request["topic"]))
        wanted = str(request.get("type") or "")
        if wanted and known_type(wanted) is not topic.message_type:
            raise KbotError(f"{topic.name} carries {topic.type_name}, not {wanted}")
        if request.get("compression", "none") != "none":
            raise KbotError("messages are sent as JSON only, without compression")
        key = topic.name, str(request.get("id") or "")
        if key in self._subscriptions:
            self._end(key)
        if len(self._subscriptions) >= MOST_SUBSCRIPTIONS:
            raise KbotError(f"a client may have at most {MOST_SUBSCRIPTIONS} subscriptions")
        throttle = round(float(request.get("throttle_rate") or 0) * 1e6)
        subscription = _Subscription(
            self._wire, topic.name, "/msg/" not in wanted, throttle, self._bridge.exact
        )
        self._subscriptions[key] = subscription
        self._bridge.link.fan_out.subscribe(topic.name, subscription.send, self._wire.send, slow=True)

    def _unsubscribe(self, request: Request) -> None:
        name, number = str(request["topic"]), request.get("id")
        for key in [k for k in self._subscriptions if k[0] == name and number in (None, k[1])]:
            self._end(key)

    def _end(self, key: tuple[str, str]) -> None:
        subscription = self._subscriptions.pop(key)
        self._bridge.link.fan_out.unsubscribe(subscription.topic, subscription.send)

    def _advertise(self, request: Request) -> None:
        topic = self._input(str(request["topic"]))
        kind = known_type(str(request["type"]))
        if kind is None:
            raise KbotError(f"{topic.name} carries {topic.type_name}, not {request['type']}")
        self._types[topic.name] = kind

    def _unadvertise(self, request: Request) -> None:
        self._types.pop(str(request["topic"]), None)

    def _publish(self, request: Request) -> None:
        topic = self._input(str(request["topic"]))
        kind = self._types.get(topic.name, topic.message_type)
        message, number = from_plain(request["msg"], kind), request.get("id")
        if number is None:
            self._bridge.link.send(topic.name, message, source=self._bridge.client)
            return

        def send_status(refusal: str) -> None:
            if refusal or self._confirms:
                level, text = ("error", refusal) if refusal else ("info", "accepted")
                status = json.dumps({"op": "status", "level": level, "msg": text, "id": number})
                later(lambda: self._wire.put(status))

        self._bridge.link.send(topic.name, message, send_status, self._bridge.client)

    def _set_level(self, request: Request) -> None:
        self._confirms = request["level"] == "info"

    def _call_service(self, request: Request) -> None:
        service, number = str(request["service"]), request.get("id")
        name = f"/{service.lstrip('/')}"  # roslibjs leaves out the slash
        arguments = request.get("args") or {}
        link = self._bridge.link

        def respond(values: Values, succeeded: bool) -> None:
            response = {"op": "service_response", "service": service, "values": values, "result": succeeded}
            self._wire.put(json.dumps(response if number is None else {**response, "id": number}))

        def on_done(done: Future[Any]) -> None:
            error = done.exception()
            plain = {"message": str(error)} if error else to_plain(done.result(), ros1=not self._bridge.exact)
            later(lambda: respond(plain, error is None))

        try:
            if name in link.services:
                call = from_plain(arguments, link.services[name].type.request)
                link.call(name, call).add_done_callback(on_done)
            else:
                respond(call_rosapi(link, name, arguments), True)
        except KbotError as error:
            respond({"message": str(error)}, False)

    def _known(self, name: str) -> Topic:
        topics = self._bridge.link.topics
        if name not in topics:
            hint = did_you_mean(name, topics)
            raise KbotError(f"there is no topic {name}" + (f": {hint}" if hint else ""))
        return topics[name]

    def _input(self, name: str) -> Topic:
        topic = self._known(name)
        if not topic.is_input:
            raise KbotError(f"KBot publishes {name} and does not subscribe to it")
        return topic

    operations = {  # noqa: RUF012 - a constant
        "subscribe": _subscribe,
        "unsubscribe": _unsubscribe,
        "advertise": _advertise,
        "unadvertise": _unadvertise,
        "publish": _publish,
        "call_service": _call_service,
        "set_level": _set_level,
    }
