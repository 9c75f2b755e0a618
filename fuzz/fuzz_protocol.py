"""Coverage-guided fuzzing of messages from pages and peers: the decoders of the page, Foxglove and rosbridge.

    pip install atheris
    python fuzz/fuzz_protocol.py [-max_total_time=300]

Any message is either processed or refused with a KbotError. No other exception may reach the server.
"""

# ruff: noqa: E501 - seeds are files in the style of other programs

import json
import sys
import typing
from typing import Any

import atheris

with atheris.instrument_imports(
    include=["kbot.workbench.protocol", "kbot.ros.bridges", "kbot.record.encodings"]
):
    import kbot
    from kbot.record.feed import Feed
    from kbot.ros.bridges.foxglove import bridge as foxglove
    from kbot.ros.bridges.link import PeerLink
    from kbot.ros.bridges.rosbridge import bridge as rosbridge
    from kbot.ros.bridges.websocket.topic_server import JsonSession
    from kbot.ros.gazebo.gazebo_services import gazebo_services
    from kbot.text import KbotError
    from kbot.workbench.protocol import FromPage
    from kbot.workbench.protocol.codec import decode

from edits import edited

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


SIMULATION = kbot.Simulation(kbot.load("kbot"))
LINK = PeerLink(lambda text: None)
LINK.services = gazebo_services()
LINK.attach(SIMULATION, Feed(SIMULATION.bus, lambda: SIMULATION.clock.nanoseconds))
BRIDGES: dict[str, Any] = {
    "foxglove": foxglove.FoxgloveBridge(LINK, port=0),
    "rosbridge": rosbridge.RosbridgeBridge(LINK, port=0),
}


def session(name: str) -> JsonSession:
    wire: Any = Wire()
    if name == "foxglove":
        return foxglove._Session(BRIDGES[name], wire, lambda client: None)
    return rosbridge._Session(BRIDGES[name], wire)


def page_message(provider: atheris.FuzzedDataProvider) -> bytes:
    kind = NAMES[provider.ConsumeIntInRange(0, len(NAMES) - 1)]
    hints = typing.get_type_hints(KINDS[kind])
    values = [1, -1.0, "base_link", "/cmd_vel", True, [], {}, ["state twist.0"], 1e300, "box"]
    fields = {
        name: values[provider.ConsumeIntInRange(0, len(values) - 1)] for name in hints if name != "type"
    }
    return json.dumps({"type": kind, **fields}).encode()


def one_input(data: bytes) -> None:
    provider = atheris.FuzzedDataProvider(data)
    kind = ("page", "foxglove", "rosbridge")[provider.ConsumeIntInRange(0, 2)]
    seed = page_message(provider) if kind == "page" else SEEDS[kind][provider.ConsumeIntInRange(0, 7)]
    message = edited(provider, seed, WORDS)
    received: str | bytes = message
    if not message.startswith((b"\x01", b"\x02")):
        received = message.decode("utf-8", "replace")
    try:
        if kind == "page":
            decode(received)
        else:
            client = session(kind)
            client.receive(received)
            LINK.serve()
            LINK.answer_calls()
            client.close()
    except KbotError:
        return


if __name__ == "__main__":
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
