"""Fuzzes messages over WebSockets: those of pages, of Foxglove's clients and of rosbridge's.

Any message is either processed or refused with a KbotError. No other exception may reach the server.
"""

import asyncio
import json
import typing
from contextlib import suppress
from functools import cache, partial
from typing import Any

from choices import Choices
from edits import edited
from simulated import LINK

from kbot.ros.bridges.foxglove import bridge as foxglove
from kbot.ros.bridges.loop import wait_for
from kbot.ros.bridges.rosbridge import bridge as rosbridge
from kbot.ros.bridges.websocket.topic_server import JsonSession
from kbot.text import KbotError
from kbot.workbench.protocol import FromPage
from kbot.workbench.protocol.codec import decode

KINDS = {typing.get_args(typing.get_type_hints(cls)["type"])[0]: cls for cls in typing.get_args(FromPage)}
NAMES = sorted(KINDS)
SEEDS: dict[str, list[bytes]] = {
    "foxglove": [
        b'{"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 1}]}',
        b'{"op": "unsubscribe", "subscriptionIds": [0]}',
        b'{"op": "advertise", "channels": [{"id": 1, "topic": "/cmd_vel", "encoding": "json", "schemaName": "geometry_msgs/msg/Twist"}]}',
        b'{"op": "getParameters", "parameterNames": ["/use_sim_time"], "id": "a"}',
        b'{"op": "setParameters", "parameters": [{"name": "/a", "value": [1, "b"]}], "id": "a"}',
        b'{"op": "subscribeParameterUpdates", "parameterNames": ["/a"]}',
        b'\x01\x01\x00\x00\x00{"linear": {"x": 1.0}}',
        b"\x02\x01\x00\x00\x00\x01\x00\x00\x00\x04\x00\x00\x00json{}",
    ],
    "rosbridge": [
        b'{"op": "subscribe", "topic": "/clock", "type": "rosgraph_msgs/Clock", "throttle_rate": 10, "id": "a"}',
        b'{"op": "unsubscribe", "topic": "/clock"}',
        b'{"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/Twist"}',
        b'{"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 1, "y": 0, "z": 0}, "angular": {"z": 1}}, "id": 1}',
        b'{"op": "call_service", "service": "/rosapi/topics", "args": {}, "id": "s"}',
        b'{"op": "call_service", "service": "/rosapi/message_details", "args": {"type": "geometry_msgs/Twist"}}',
        b'{"op": "call_service", "service": "/rosapi/get_param", "args": {"name": "/a", "default": "1"}}',
        b'{"op": "set_level", "level": "info"}',
    ],
}
WORDS = [
    b"{", b"}", b"[", b"]", b'"', b"null", b"true", b'"\\ud800"', b"1e999", b"NaN", b"-Infinity", b'"op": "publish", ', b'"id": {}, ',
    b'"topic": "/cmd_vel", ', b'"type": "std_msgs/String", ', b'"args": [1], ', b'"msg": 5, ',
]  # fmt: skip


class Wire:
    """Accepts messages as a client does. They must be text or bytes."""

    def put(self, data: str | bytes, *, keep: bool = False) -> None:
        assert isinstance(data, str | bytes)

    add = put

    def send(self) -> None:
        """Nothing is queued."""


@cache
def bridge(name: str) -> Any:
    made = (foxglove.FoxgloveBridge if name == "foxglove" else rosbridge.RosbridgeBridge)(LINK, port=0)
    wait_for(asyncio.sleep(0))  # until it has numbered the topics
    return made


def session(name: str) -> JsonSession:
    wire: Any = Wire()
    if name == "foxglove":
        return foxglove._Session(bridge(name), wire, lambda client: None)
    return rosbridge._Session(bridge(name), wire)


def page_message(choices: Choices) -> bytes:
    kind = choices.pick(NAMES)
    hints = typing.get_type_hints(KINDS[kind])
    values = [1, -1.0, "base_link", "/cmd_vel", True, [], {}, ["state twist.0"], 1e300, "box"]
    fields = {name: choices.pick(values) for name in hints if name != "type"}
    return json.dumps({"type": kind, **fields}).encode()


def one_page_message(choices: Choices) -> None:
    with suppress(KbotError):
        decode(edited(choices, [page_message(choices)], WORDS).decode("utf-8", "replace"))


def one_input(kind: str, choices: Choices) -> None:
    """Up to four messages of one client."""
    client = session(kind)
    for _ in range(choices.integer(1, 4)):
        message = edited(choices, SEEDS[kind], WORDS)
        is_binary = message.startswith((b"\x01", b"\x02"))
        with suppress(KbotError):
            client.receive(message if is_binary else message.decode("utf-8", "replace"))
            LINK.serve()
            LINK.answer_calls()
    client.close()


TARGETS = {"page": one_page_message} | {kind: partial(one_input, kind) for kind in SEEDS}
