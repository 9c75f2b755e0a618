"""A peer of one bridge, using the library of its protocol, for measuring bridges.

    python benchmarks/bridge_peers.py NAME [ADDRESS]

It prints a line for each message of /clock: its stamp in nanoseconds, and its arrival time by this machine's
clock (s). It also subscribes to the robot's other topics, except for ROS 1, where a connection carries one
topic.
"""

from __future__ import annotations

import json
import os
import socket
import struct
import sys
import time

NAMES = ("odom", "tf", "joint_states", "clock", "scan")


def receive_ros1(address: str) -> None:
    """`address` is that of a publisher of /clock, HOST:PORT."""
    from kbot.ros.bridges.ros1.tcpros import encode_header, read_block, read_header

    host, _, port = address.rpartition(":")
    with socket.create_connection((host, int(port))) as connection:
        connection.sendall(
            encode_header({"callerid": "/peer", "topic": "/clock", "type": "*", "md5sum": "*"})
        )
        read_header(connection)
        while True:
            secs, nsecs = struct.unpack("<II", read_block(connection))
            report(secs * 10**9 + nsecs)


def receive_foxglove(address: str) -> None:
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    with connect(address, subprotocols=[Subprotocol("foxglove.sdk.v1")]) as connection:
        while True:
            data = connection.recv()
            if isinstance(data, bytes) and data[0] == 2:
                report(struct.unpack_from("<Q", data, 1)[0])
            elif isinstance(data, str) and (received := json.loads(data))["op"] == "advertise":
                wanted = [
                    {"id": c["id"], "channelId": c["id"]}
                    for c in received["channels"]
                    if c["topic"][1:] in NAMES
                ]
                connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def receive_rosbridge(address: str) -> None:
    from websockets.sync.client import connect

    with connect(address) as connection:
        for name in NAMES:
            connection.send(json.dumps({"op": "subscribe", "topic": f"/{name}"}))
        while True:
            data = str(connection.recv())
            if "/clock" in data:
                clock = json.loads(data)["msg"]["clock"]
                report(clock["secs"] * 10**9 + clock["nsecs"])


def receive_ros2(_: str) -> None:
    from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
    from cyclonedds.domain import Domain, DomainParticipant
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    from kbot.ros.bridges.ros2.domain import reach
    from kbot.ros.bridges.ros2.samples import sample_type

    number = int(os.environ["ROS_DOMAIN_ID"])
    domain = Domain(number, reach(None, {}).config)  # it closes when it is garbage-collected
    participant = DomainParticipant(number)
    kinds = {
        "clock": "rosgraph_msgs/msg/Clock",
        "odom": "nav_msgs/msg/Odometry",
        "tf": "tf2_msgs/msg/TFMessage",
        "joint_states": "sensor_msgs/msg/JointState",
        "scan": "sensor_msgs/msg/LaserScan",
    }
    topics = [Topic(participant, f"rt/{name}", sample_type(kind)) for name, kind in kinds.items()]
    readers = [DataReader(participant, topic) for topic in topics]
    waiting = WaitSet(participant)
    any_new = ViewState.Any | InstanceState.Alive | SampleState.NotRead
    for reader in readers:
        waiting.attach(ReadCondition(reader, any_new))
    while domain:
        waiting.wait(duration(seconds=1))
        for sample in readers[0].take(64):
            if not sample.sample_info.valid_data:
                continue  # the writer has ended
            sec, nanosec = struct.unpack_from("<iI", sample.encoded, 4)
            report(sec * 10**9 + nanosec)
        for reader in readers[1:]:
            reader.take(64)


def receive_zenoh(_: str) -> None:
    import zenoh

    def receive(sample: zenoh.Sample) -> None:
        if "/clock/" in str(sample.key_expr):
            sec, nanosec = struct.unpack_from("<iI", sample.payload.to_bytes(), 4)
            report(sec * 10**9 + nanosec)

    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", '["tcp/127.0.0.1:7447"]')
    with zenoh.open(config) as session:
        subscribers = [session.declare_subscriber(f"*/{name}/**", receive) for name in NAMES]
        while subscribers:
            time.sleep(1)


PEERS = {
    "ros1": receive_ros1,
    "foxglove": receive_foxglove,
    "rosbridge": receive_rosbridge,
    "ros2": receive_ros2,
    "zenoh": receive_zenoh,
}


def report(nanoseconds: int) -> None:
    sys.stdout.write(f"{nanoseconds} {time.monotonic()}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    PEERS[sys.argv[1]](*sys.argv[2:])
