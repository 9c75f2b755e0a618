"""Publishes the same messages as the bridges, with the libraries alone, in a separate process.

    python benchmarks/bare_bridges.py WARM_SECONDS SECONDS < MESSAGES

The input is the pickled list of one period's messages: topic, type, CDR and JSON of each. Fifty times a
second, every library publishes them in its own encoding. rosbags makes the bytes and orjson the texts, once
for all. The output is two lines of JSON: the addresses by bridge; then the share of a core during SECONDS,
with the stamps of /clock in nanoseconds and the times at which their periods began.
"""

from __future__ import annotations

import asyncio
import json
import os
import pickle
import struct
import sys
import time
from types import SimpleNamespace
from typing import Any

import orjson
import zenoh
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from rosbags.typesys import Stores, get_typestore
from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.typing import Subprotocol

from kbot.ros.bridges.ros1.tcpros import encode_header
from kbot.ros.bridges.ros2.domain import reach
from kbot.ros.bridges.ros2.samples import sample_of, sample_type
from kbot.ros.bridges.zenoh.names import topic_key

PERIOD, SCAN_EVERY = 0.02, 5
ROS2, ROS1 = get_typestore(Stores.ROS2_JAZZY), get_typestore(Stores.ROS1_NOETIC)
ATTACHED = bytes(33)
"""The size of the attachment that rmw_zenoh adds to each message."""


class Message:
    """One message of each period as an object of the library, with its publishers."""

    def __init__(self, number: int, topic: str, type_name: str, cdr: bytes, text: str) -> None:
        self.number, self.topic, self.type_name = number, topic, type_name
        self.message: Any = ROS2.deserialize_cdr(cdr, type_name)
        self.plain = json.loads(text)
        self.kind = sample_type(type_name)
        self.writer: Any = None
        self.publisher: Any = None

    def set_time(self, nanoseconds: int) -> None:
        sec, nanosec = divmod(nanoseconds, 10**9)
        self.message = SimpleNamespace(clock=SimpleNamespace(sec=sec, nanosec=nanosec))
        self.plain = {"clock": {"secs": sec, "nsecs": nanosec}}


async def main(warm: float, seconds: float) -> None:
    """Publish to all peers. The share is measured for `seconds`, after `warm` seconds."""
    given = pickle.load(sys.stdin.buffer)
    messages = [Message(number, *parts) for number, parts in enumerate(given, 1)]
    ros1: set[asyncio.StreamWriter] = set()
    foxglove: set[ServerConnection] = set()
    rosbridge: set[ServerConnection] = set()

    async def accept_ros1(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read(1 << 16)
        writer.write(encode_header({"topic": "/clock", "type": "rosgraph_msgs/Clock", "md5sum": "*"}))
        ros1.add(writer)

    async def accept_foxglove(connection: ServerConnection) -> None:
        channels = [{"id": m.number, "topic": m.topic} for m in messages]
        await connection.send(json.dumps({"op": "advertise", "channels": channels}))
        foxglove.add(connection)
        await connection.wait_closed()

    async def accept_rosbridge(connection: ServerConnection) -> None:
        rosbridge.add(connection)
        await connection.wait_closed()

    tcp = await asyncio.start_server(accept_ros1, "127.0.0.1", 0)
    by_foxglove = await serve(
        accept_foxglove, "127.0.0.1", 0, compression=None, subprotocols=[Subprotocol("foxglove.sdk.v1")]
    )
    by_rosbridge = await serve(accept_rosbridge, "127.0.0.1", 0, compression=None)
    domain = int(os.environ["ROS_DOMAIN_ID"])
    held = Domain(domain, reach(None, {}).config), DomainParticipant(domain)
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:7447"]')
    session = zenoh.open(config)
    writers: dict[str, Any] = {}
    for m in messages:
        if m.topic not in writers:
            topic = Topic(held[1], f"rt{m.topic}", m.kind)
            key = topic_key(domain, m.topic, m.type_name)
            writers[m.topic] = DataWriter(held[1], topic), session.declare_publisher(key)
        m.writer, m.publisher = writers[m.topic]

    servers = {"ros1": tcp, "foxglove": by_foxglove, "rosbridge": by_rosbridge}
    ports = {name: next(iter(server.sockets)).getsockname()[1] for name, server in servers.items()}
    heads = {"ros1": "", "foxglove": "ws://", "rosbridge": "ws://"}
    print(json.dumps({name: f"{heads[name]}127.0.0.1:{port}" for name, port in ports.items()}), flush=True)
    due, periods, before = time.monotonic(), [], 0.0
    for number in range(round((warm + seconds) / PERIOD)):
        if number == round(warm / PERIOD):
            before = time.process_time()
            periods.clear()
        now = number * round(PERIOD * 1e9)
        periods.append((now, time.monotonic()))
        due_messages = [m for m in messages if m.topic != "/scan" or number % SCAN_EVERY == 0]
        clock = next(m for m in due_messages if m.topic == "/clock")
        clock.set_time(now)
        data = bytes(ROS1.serialize_ros1(clock.message, clock.type_name))
        for writer in ros1:
            writer.write(struct.pack("<I", len(data)) + data)
        encoded = [bytes(ROS2.serialize_cdr(m.message, m.type_name)) for m in due_messages]
        for m, data in zip(due_messages, encoded, strict=True):
            m.writer.write(sample_of(m.kind, data))
        for m, data in zip(due_messages, encoded, strict=True):
            m.publisher.put(data, attachment=ATTACHED)
        for m, data in zip(due_messages, encoded, strict=True):
            broadcast(foxglove, struct.pack("<BIQ", 1, m.number, now) + data)
        broadcast(foxglove, struct.pack("<BQ", 2, now))
        for m in due_messages:
            published = {"op": "publish", "topic": m.topic, "msg": m.plain}
            broadcast(rosbridge, orjson.dumps(published).decode())
        due += PERIOD
        await asyncio.sleep(due - time.monotonic())
    share = (time.process_time() - before) / seconds
    print(json.dumps([share, periods]), flush=True)
    await asyncio.Event().wait()  # the peers end first


if __name__ == "__main__":
    asyncio.run(main(float(sys.argv[1]), float(sys.argv[2])))
