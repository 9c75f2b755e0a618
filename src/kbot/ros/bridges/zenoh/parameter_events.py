"""What changed of a node's parameters, said as rclcpp's nodes do."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from types import SimpleNamespace

from kbot.messages.types import Time
from kbot.record.encodings.types import ros2_types
from kbot.ros.bridges.link import Link, Value
from kbot.ros.bridges.zenoh.parameter_values import NOT_SET, Message, dotted, message_of, type_of

TOPIC, TYPE = "/parameter_events", "rcl_interfaces/msg/ParameterEvent"


class ParameterEvents:
    """Of the parameters that a link has, from the moment this is made; `put` sends a message in CDR."""

    def __init__(self, link: Link, node: str, put: Callable[[bytes], None]) -> None:
        self._link, self._node, self._put = link, node, put
        self._told = _known(link)

    def tell(self) -> None:
        """Say what changed since the last time."""
        before, now = self._told, _known(self._link)
        if now == before:
            return
        self._told = now
        event = SimpleNamespace(
            stamp=Time.from_nanoseconds(self._link.nanoseconds),
            node=self._node,
            new_parameters=_messages({name: now[name] for name in now.keys() - before.keys()}),
            changed_parameters=_messages(
                {name: now[name] for name in now.keys() & before.keys() if now[name] != before[name]}
            ),
            deleted_parameters=_messages({name: before[name] for name in before.keys() - now.keys()}),
        )
        with suppress(ValueError):  # a text that is no Unicode
            self._put(bytes(ros2_types().serialize_cdr(event, TYPE)))


def _known(link: Link) -> dict[str, Value]:
    return {dotted(full): value for full, value in link.parameters.items() if type_of(value) != NOT_SET}


def _messages(values: dict[str, Value]) -> list[Message]:
    return [SimpleNamespace(name=name, value=message_of(values[name])) for name in sorted(values)]
