"""The services of rosapi that clients of rosbridge ask to find their way."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from kbot.messages.bus import absolute
from kbot.messages.types import Time
from kbot.ros.bridges.link import Link
from kbot.text import KbotError
from kbot.text.json_text import parse_json
from kbot.text.suggest import did_you_mean

NODE = "/kbot"

Values = dict[str, Any]


def call_rosapi(link: Link, service: str, arguments: Values) -> Values:
    """The answer of one service; parameters' values are JSON, as rosapi has them.

    Raises:
        KbotError: there is no such service, topic or parameter.
    """
    answer = SERVICES.get(service.removeprefix("/rosapi/")) if service.startswith("/rosapi/") else None
    if answer is None:
        hint = did_you_mean(service, [*link.services, *_OWN])
        raise KbotError(f"there is no service {service}" + (f": {hint}" if hint else ""))
    if not isinstance(arguments, dict):
        raise KbotError(f"{service} takes its arguments by name")
    return answer(link, arguments)


def _short(name: str) -> str:
    return name.replace("/msg/", "/")


def _topics(link: Link, arguments: Values) -> Values:
    topics = link.topics.values()
    return {"topics": [t.name for t in topics], "types": [_short(t.type_name) for t in topics]}


def _topics_for_type(link: Link, arguments: Values) -> Values:
    wanted = _short(str(arguments.get("type", "")))
    return {"topics": [t.name for t in link.topics.values() if _short(t.type_name) == wanted]}


def _topic_type(link: Link, arguments: Values) -> Values:
    topic = link.topics.get(str(arguments.get("topic", "")))
    return {"type": _short(topic.type_name) if topic else ""}


def _publishers(link: Link, arguments: Values) -> Values:
    topic = link.topics.get(str(arguments.get("topic", "")))
    return {"publishers": [NODE] if topic and not topic.is_input else []}


def _subscribers(link: Link, arguments: Values) -> Values:
    topic = link.topics.get(str(arguments.get("topic", "")))
    return {"subscribers": [NODE] if topic and topic.is_input else []}


def _get_param(link: Link, arguments: Values) -> Values:
    name = str(arguments.get("name", ""))
    if name not in link.parameters:
        if arguments.get("default"):
            return {"value": arguments["default"]}
        hint = did_you_mean(name, link.parameters)
        raise KbotError(f"there is no parameter {name}" + (f": {hint}" if hint else ""))
    return {"value": json.dumps(link.parameters[name])}


def _set_param(link: Link, arguments: Values) -> Values:
    """The value is JSON, as rosapi has it."""
    name = str(arguments.get("name", ""))
    try:
        value = parse_json(str(arguments.get("value")))
        link.set_parameter(absolute(name), value)
    except ValueError:
        raise KbotError(f"the value of {name} is not JSON, or is nested too deeply") from None
    return {}


def _delete_param(link: Link, arguments: Values) -> Values:
    link.set_parameter(str(arguments.get("name", "")), None)
    return {}


def _types(link: Link) -> Values:
    return {name: service.type.name for name, service in link.services.items()}


def _service_type(link: Link, arguments: Values) -> Values:
    return {"type": _types(link).get(str(arguments.get("service", "")), "")}


def _services_for_type(link: Link, arguments: Values) -> Values:
    wanted = str(arguments.get("type", "")).replace("/srv/", "/")
    return {"services": [name for name, kind in _types(link).items() if kind == wanted]}


def _node_details(link: Link, arguments: Values) -> Values:
    topics = link.topics.values()
    return {
        "publishing": [topic.name for topic in topics if not topic.is_input],
        "subscribing": [topic.name for topic in topics if topic.is_input],
        "services": list(link.services),
    }


def _service_node(link: Link, arguments: Values) -> Values:
    return {"node": NODE if arguments.get("service") in link.services else ""}


def _get_time(link: Link, arguments: Values) -> Values:
    now = Time.from_nanoseconds(link.nanoseconds)
    return {"time": {"secs": now.sec, "nsecs": now.nanosec}}


SERVICES: dict[str, Callable[[Link, Values], Values]] = {
    "topics": _topics,
    "topics_for_type": _topics_for_type,
    "topic_type": _topic_type,
    "publishers": _publishers,
    "subscribers": _subscribers,
    "nodes": lambda link, arguments: {"nodes": [NODE]},
    "services": lambda link, arguments: {"services": [*link.services, *_OWN]},
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
_OWN: list[str] = [f"/rosapi/{name}" for name in SERVICES]
