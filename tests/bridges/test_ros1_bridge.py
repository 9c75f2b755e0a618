"""The ROS 1 bridge without ROS: raw peers, correct and faulty ones."""

import os
import random
import socket
import struct
import time
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

import pytest

from kbot.messages import types as msg
from kbot.record.encodings.serialization import decode_ros1, encode_ros1
from kbot.record.encodings.types import ros1_definition
from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes
from kbot.ros.bridges.ros1.bridge import Ros1Bridge
from kbot.ros.bridges.ros1.master import Master
from kbot.ros.bridges.ros1.rpc import LARGEST_BODY, RpcFailed, RpcServer, call
from kbot.ros.bridges.ros1.tcpros import encode_header, read_block, read_header

from .conftest import Running, wait_until

ME = "/tester"


@pytest.fixture
def bridge(running: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ros1Bridge]:
    for name in ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME"):
        monkeypatch.delenv(name, raising=False)
    bridge = Ros1Bridge(running.link, master=f"http://127.0.0.1:{free_port()}")
    try:
        wait_until(lambda: "/odom" in dict(call(bridge.master, "getPublishedTopics", ME, "")))
        yield bridge
    finally:
        bridge.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@contextmanager
def subscribed(bridge: Ros1Bridge, topic: str, kind: str, md5: str | None = None) -> Iterator[socket.socket]:
    protocol, host, port = call(bridge.uri, "requestTopic", ME, topic, [["TCPROS"]])
    assert protocol == "TCPROS"
    with socket.create_connection((host, port), 60) as connection:
        sum_ = md5 or ros1_definition(kind.replace("/", "/msg/"))[1]
        connection.sendall(encode_header({"callerid": ME, "topic": topic, "type": kind, "md5sum": sum_}))
        yield connection


def test_a_subscriber_receives_messages_at_50_hz_of_simulated_time(
    running: Running, bridge: Ros1Bridge
) -> None:
    with subscribed(bridge, "/odom", "nav_msgs/Odometry") as connection:
        header = read_header(connection)
        assert header["type"] == "nav_msgs/Odometry"
        stamps = [
            decode_ros1(read_block(connection), msg.Odometry).header.stamp.nanoseconds for _ in range(5)
        ]
    assert [after - before for before, after in pairwise(stamps)] == [20_000_000] * 4


def test_a_late_subscriber_receives_latched_messages(running: Running, bridge: Ros1Bridge) -> None:
    assert running.is_stepping()
    for _ in range(2):
        with subscribed(bridge, "/tf_static", "tf2_msgs/TFMessage") as connection:
            assert read_header(connection)["latching"] == "1"
            message = decode_ros1(read_block(connection), msg.TFMessage)
            assert "base_link" in {t.child_frame_id for t in message.transforms}


def test_a_subscriber_with_another_type_is_refused_with_the_reason(
    running: Running, bridge: Ros1Bridge
) -> None:
    with subscribed(bridge, "/odom", "std_msgs/String") as connection:
        assert "nav_msgs/Odometry" in read_header(connection)["error"]
    with subscribed(bridge, "/odom", "nav_msgs/Odometry", "0" * 32) as connection:
        assert "md5sum" in read_header(connection)["error"]
    wait_until(lambda: any("refused a connection" in text for text in running.reported))


def test_parameters_are_on_the_master(bridge: Ros1Bridge) -> None:
    assert call(bridge.master, "getParam", ME, "/robot_description") == "<robot/>"
    assert call(bridge.master, "getParam", ME, "/use_sim_time") is True
    with pytest.raises(RpcFailed, match=r"\[/nothing\] is not set"):
        call(bridge.master, "getParam", ME, "nothing")


def test_values_that_one_side_cannot_represent_stay_on_the_other(
    running: Running, bridge: Ros1Bridge
) -> None:
    """Parameters that follow are still exchanged."""
    deep: list[object] = []
    for _ in range(150):
        deep = [deep]
    strange = {"/huge": 1 << 40, "/nothing": {"a": None}, "/numbered": {1: 2}, "/control": "a\0b"}
    strange |= {"/deep": deep, "/long": "a" * LARGEST_BODY}
    for name, value in strange.items():
        running.link.set_parameter(name, value)
        wait_until(lambda name=name: any(f"parameter {name} is not" in text for text in running.reported))
    running.link.set_parameter("/after", 3)
    wait_until(lambda: call(bridge.master, "hasParam", ME, "/after"))
    assert not any(call(bridge.master, "hasParam", ME, name) for name in strange)
    for name, value in (("/bytes", xmlrpc.client.Binary(b"a")), ("/dates", [xmlrpc.client.DateTime(0)])):
        call(bridge.master, "setParam", ME, name, value)
    call(bridge.master, "setParam", ME, "/plain", [1, "a"])
    wait_until(lambda: running.link.parameters.get("/plain") == [1, "a"])
    assert not {"/bytes", "/dates"} & set(running.link.parameters)


class Publisher:
    """A node that publishes /cmd_vel. It sends `script` after the header."""

    def __init__(self, bridge: Ros1Bridge, script: bytes, header: dict[str, str] | None = None) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(60)
        self._script = script
        self._header = header or {
            "type": "geometry_msgs/Twist",
            "md5sum": ros1_definition("geometry_msgs/msg/Twist")[1],
        }
        self.server = RpcServer(
            "127.0.0.1",
            0,
            {"requestTopic": lambda *_: (1, "", ["TCPROS", "127.0.0.1", self.listener.getsockname()[1]])},
        )
        uri = f"http://127.0.0.1:{self.server.port}/"
        call(bridge.master, "registerPublisher", ME, "/cmd_vel", "geometry_msgs/Twist", uri)

    def accept(self) -> socket.socket:
        connection, _ = self.listener.accept()
        read_header(connection)
        connection.sendall(encode_header(self._header) + self._script)
        return connection

    def close(self) -> None:
        self.listener.close()
        self.server.close()


def twist(speed: float) -> bytes:
    data = encode_ros1(msg.Twist(msg.Vector3(speed)))
    return struct.pack("<I", len(data)) + data


def test_a_twist_of_a_peer_drives_the_robot(running: Running, bridge: Ros1Bridge) -> None:
    publisher = Publisher(bridge, twist(0.2) * 3)
    with publisher.accept():
        wait_until(lambda: running.simulation.robots.first.twist.x > 0.1)
        # the watchdog stops it after half a second
        wait_until(lambda: running.simulation.robots.first.twist.x == 0.0)
    publisher.close()


@pytest.mark.parametrize(
    ("script", "header"),
    [
        (b"", None),
        (twist(0.2)[:20], None),
        (struct.pack("<I", 1 << 31) + b"x" * 1000, None),
        (struct.pack("<I", 4) + b"abcd", None),
        (twist(float("nan")) * 100, None),
        (os.urandom(5000), None),
        (twist(0.2), {"type": "std_msgs/String", "md5sum": "*"}),
        (twist(0.2), {"error": "I do not like you"}),
    ],
    ids=["silent", "half", "huge", "short", "nan", "noise", "type", "error"],
)
def test_a_faulty_publisher_has_no_effect(
    running: Running, bridge: Ros1Bridge, script: bytes, header: dict[str, str] | None
) -> None:
    publisher = Publisher(bridge, script, header)
    with publisher.accept():
        assert running.is_stepping()
    assert running.simulation.robots.first.twist.x == 0.0
    publisher.close()
    assert running.is_stepping()


def test_a_subscriber_that_never_reads_does_not_delay_others(running: Running, bridge: Ros1Bridge) -> None:
    with subscribed(bridge, "/odom", "nav_msgs/Odometry") as idle:
        idle.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        with subscribed(bridge, "/odom", "nav_msgs/Odometry") as reading:
            read_header(reading)
            for _ in range(100):
                assert len(read_block(reading)) > 600
    assert running.is_stepping()


def test_a_thousand_aborted_connections_have_no_effect(running: Running, bridge: Ros1Bridge) -> None:
    _, host, port = call(bridge.uri, "requestTopic", ME, "/odom", [["TCPROS"]])
    rpc = int(bridge.uri.rstrip("/").rpartition(":")[2])
    for number in range(1000):
        with socket.create_connection((host, (port, rpc)[number % 2]), 60) as connection:
            if number % 3:
                connection.sendall(b"\x10\0\0\0half")
    assert running.is_stepping()
    with subscribed(bridge, "/odom", "nav_msgs/Odometry") as connection:
        read_header(connection)
        read_block(connection)


def test_random_bytes_on_every_port_have_no_effect(running: Running, bridge: Ros1Bridge) -> None:
    noise = random.Random(1)
    _, host, port = call(bridge.uri, "requestTopic", ME, "/odom", [["TCPROS"]])
    ports = [port, *(int(uri.rstrip("/").rpartition(":")[2]) for uri in (bridge.uri, bridge.master))]
    openings = [
        b"",
        b"POST / HTTP/1.1\r\ncontent-length: 99999999999\r\n\r\n",
        b"POST / HTTP/1.1\r\ncontent-length: -5\r\n\r\n",
        b"POST / HTTP/1.1\r\n\r\n",
        b"POST / HTTP/1.1\r\ncontent-length: 9\r\n\r\n<not xml>",
        b"GET / HTTP/1.1\r\n\r\n",
        b'POST / HTTP/1.1\r\ncontent-length: 80\r\n\r\n<!DOCTYPE a [<!ENTITY b "c">]>',
    ]
    for number in range(120):
        with socket.create_connection((host, ports[number % 3]), 60) as connection:
            connection.sendall(openings[number % len(openings)] + noise.randbytes(noise.randrange(300)))
    assert running.is_stepping()
    assert call(bridge.uri, "getPid", ME) == os.getpid()
    assert "/odom" in dict(call(bridge.master, "getPublishedTopics", ME, ""))


def test_the_master_survives_calls_with_wrong_arguments(bridge: Ros1Bridge) -> None:
    for method in (
        "registerPublisher",
        "getParam",
        "setParam",
        "subscribeParam",
        "lookupNode",
        "searchParam",
    ):
        for arguments in ((), (1,), (ME,), (ME, 5), (ME, "a", "b", "c", "d", "e"), ({}, [])):
            try:
                call(bridge.master, method, *arguments)
            except RpcFailed:
                continue
    assert call(bridge.master, "getPid", ME) == os.getpid()


def test_the_node_registers_again_after_the_master_restarts(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kbot.ros.bridges.ros1.bridge.CHECK_SECONDS", 0.1)
    monkeypatch.delenv("ROS_IP", raising=False)
    master = Master("127.0.0.1", 0, AllowedNodes("127.0.0.1", print))
    bridge = Ros1Bridge(running.link, master=master.uri)
    try:
        wait_until(lambda: "/odom" in dict(call(master.uri, "getPublishedTopics", ME, "")))
        port = int(master.uri.rstrip("/").rpartition(":")[2])
        master.close()
        wait_until(lambda: any("the master does not answer" in text for text in running.reported))
        master = Master("127.0.0.1", port, AllowedNodes("127.0.0.1", print))
        wait_until(lambda: "/odom" in dict(call(master.uri, "getPublishedTopics", ME, "")))
        assert call(master.uri, "getParam", ME, "/use_sim_time") is True
        assert running.is_stepping()
    finally:
        bridge.close()
        master.close()


def test_close_unregisters_everything(running: Running) -> None:
    master = Master("127.0.0.1", 0, AllowedNodes("127.0.0.1", print))
    bridge = Ros1Bridge(running.link, master=master.uri)
    wait_until(lambda: "/odom" in dict(call(master.uri, "getPublishedTopics", ME, "")))
    bridge.close()
    assert call(master.uri, "getSystemState", ME) == [[], [], []]
    with pytest.raises(RpcFailed, match="unknown node"):
        call(master.uri, "lookupNode", ME, "/kbot")
    master.close()
    started = time.monotonic()
    with pytest.raises(RpcFailed):
        call(bridge.uri, "getPid", ME)
    assert time.monotonic() - started < 60
