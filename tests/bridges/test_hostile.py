"""Faulty and hostile peers: the simulation continues, and other peers are served."""

import contextlib
import json
import os
import random
import socket
import struct
from collections.abc import Iterator

import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from kbot.messages import services as srv
from kbot.messages.types import Twist
from kbot.ros.bridges.foxglove.bridge import SUBPROTOCOLS, FoxgloveBridge
from kbot.ros.bridges.link import MOST_CALLS
from kbot.ros.bridges.ros1.bridge import Ros1Bridge
from kbot.ros.bridges.ros1.rpc import call
from kbot.ros.bridges.ros1.tcpros import encode_header, read_block, read_exactly, read_header
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge
from kbot.ros.bridges.websocket.topic_server import TopicServer
from kbot.text import KbotError

from .conftest import Running, wait_until

PROTOCOLS = [Subprotocol(SUBPROTOCOLS[0])]
CLOSE_SECONDS = 0.5
"""How long a client waits for the server to confirm the end of the connection. A server that still waits for
the rest of a frame does not confirm it."""


@pytest.fixture(params=[FoxgloveBridge, RosbridgeBridge])
def server(running: Running, request: pytest.FixtureRequest) -> Iterator[TopicServer]:
    server = request.param(running.link, port=0)
    try:
        yield server
    finally:
        server.close()


def still_serves(server: TopicServer) -> bool:
    """Whether a correct client gets an answer."""
    with connect(server.address, subprotocols=PROTOCOLS) as connection:
        return is_served(connection)


def is_served(connection: ClientConnection) -> bool:
    """Whether a client gets an answer after those to its earlier messages."""
    connection.send('{"op": "no such"}')
    while True:
        answer = connection.recv(60)
        if isinstance(answer, str) and "no operation" in answer:
            return True


def test_a_thousand_aborted_connections_have_no_effect(running: Running, server: TopicServer) -> None:
    host, port = "127.0.0.1", int(server.address.rpartition(":")[2])
    handshake = (
        f"GET / HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
    ).encode()
    for number in range(1000):
        with socket.create_connection((host, port), 60) as connection:
            connection.sendall(handshake[: (number % 4) * len(handshake) // 3])
    assert running.is_stepping()
    assert still_serves(server)


def test_invalid_frames_have_no_effect(running: Running, server: TopicServer) -> None:
    """After a valid handshake: wrong opcodes, huge lengths, no mask, random bytes."""
    noise = random.Random(3)
    frames = [
        b"\xff\xff" + b"\xff" * 8,
        b"\x82\xff" + struct.pack(">Q", 1 << 62) + b"abcd",
        b"\x81\x05hello",
        b"\x01\x80\0\0\0\0\x00\x80\0\0\0\0" * 50,
        b"\x88\x81\0\0\0\0x",
        b"\x81\x82\0\0\0\0\xff\xfe",
    ]
    for number in range(60):
        raw = socket.create_connection(("127.0.0.1", int(server.address.rpartition(":")[2])), 60)
        frame = frames[number] if number < len(frames) else noise.randbytes(noise.randrange(400))
        with (
            raw,
            contextlib.suppress(WebSocketException, OSError, EOFError),
            connect(server.address, sock=raw, subprotocols=PROTOCOLS, close_timeout=CLOSE_SECONDS),
        ):
            raw.sendall(frame)
    assert running.is_stepping()
    assert still_serves(server)


def test_an_unforeseen_error_is_reported_to_the_client(
    running: Running, server: TopicServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Only that message fails, on the bridges' thread and on the simulation's."""

    def fail(*_: object) -> None:
        raise ZeroDivisionError("a bug")

    name = type(server).__name__.removesuffix("Bridge")
    with connect(server.address, subprotocols=PROTOCOLS) as connection:
        with monkeypatch.context() as patch:
            patch.setattr("kbot.ros.bridges.websocket.topic_server.JsonSession.receive", fail)
            connection.send("{}")
            while "KBot could not process this: ZeroDivisionError" not in str(connection.recv(60)):
                pass
        with monkeypatch.context() as patch:
            patch.setattr(running.simulation.bus, "publish", fail)
            reasons: list[str] = []
            running.link.send("/cmd_vel", Twist(), reasons.append)
            wait_until(lambda: reasons)
        assert "KBot could not process this: ZeroDivisionError" in reasons[0]
    assert f"{name}: a message failed: internal error".lower() in caplog.text.lower()
    assert not any(record.exc_info for record in caplog.records)
    assert running.is_stepping()
    assert still_serves(server)


@pytest.mark.parametrize("number", ["1e999", "1" + "0" * 400, '"x"', "[1]"])
def test_an_invalid_number_is_refused(running: Running, number: str) -> None:
    bridge = RosbridgeBridge(running.link, port=0)
    try:
        with connect(bridge.address) as connection:
            connection.send(f'{{"op": "subscribe", "topic": "/clock", "throttle_rate": {number}}}')
            status = json.loads(connection.recv(60))
        assert (status["op"], status["level"]) == ("status", "error")
        assert status["msg"].startswith("subscribe: ")
    finally:
        bridge.close()


def test_random_service_calls_have_no_effect(running: Running) -> None:
    noise = random.Random(4)
    bridge = FoxgloveBridge(running.link, port=0)
    try:
        with connect(bridge.address, subprotocols=PROTOCOLS) as connection:
            for number in range(300):
                head = struct.pack("<BIII", 2, number % 25, number, (3, 4, 0, 1 << 31)[number % 4])
                body = (b"cdr", b"json", b"", b"x")[number % 4] + noise.randbytes(noise.randrange(80))
                connection.send((head + body)[: noise.randrange(1, 120)])
            assert is_served(connection)  # the calls were read
        assert running.is_stepping()
        assert still_serves(bridge)
    finally:
        bridge.close()


def test_calls_above_the_limit_are_refused(running: Running) -> None:
    """The waiting calls are answered afterwards."""
    running.stop()
    called = "/gazebo/get_model_state", srv.GetModelStateRequest(running.simulation.robot.name)
    waiting = [running.link.call(*called) for _ in range(MOST_CALLS)]
    with pytest.raises(KbotError, match="calls are already waiting"):
        running.link.call(*called)
    while running.simulation.run_errands():
        pass
    assert all(future.result(0).success for future in waiting)
    later = running.link.call(*called)
    running.link.end()
    with pytest.raises(KbotError, match="the simulation has ended"):
        later.result(0)


def test_callers_over_tcpros_that_disconnect_have_no_effect(running: Running) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    bridge = Ros1Bridge(running.link, master=f"http://127.0.0.1:{port}/")
    try:
        service = "/gazebo/get_model_state"
        wait_until(lambda: service in str(call(bridge.master, "getSystemState", "/test")))
        uri = call(bridge.master, "lookupService", "/test", service)
        host, _, door = uri.removeprefix("rosrpc://").rpartition(":")
        header = encode_header({"callerid": "/t", "service": service, "md5sum": "*", "persistent": "1"})
        for number in range(200):
            with socket.create_connection((host, int(door)), 60) as connection:
                connection.sendall(
                    header + (b"", b"\0\0\0\0", b"\xff\xff\xff\x7f", os.urandom(40))[number % 4]
                )
        assert running.is_stepping()
        with socket.create_connection((host, int(door)), 60) as connection:
            connection.sendall(header)
            read_header(connection)
            connection.sendall(struct.pack("<III", 8, 0, 0))
            assert read_exactly(connection, 1) == b"\1"
            assert len(read_block(connection)) > 8
    finally:
        bridge.close()


def test_a_rosbridge_client_that_never_reads_does_not_delay_others(running: Running) -> None:
    bridge = RosbridgeBridge(running.link, port=0)
    try:
        with connect(bridge.address, max_queue=1, close_timeout=0.1) as idle:
            for topic in ("/odom", "/tf", "/joint_states", "/clock", "/gazebo/link_states"):
                idle.send(json.dumps({"op": "subscribe", "topic": topic}))
            with connect(bridge.address) as other:
                other.send(json.dumps({"op": "subscribe", "topic": "/odom"}))
                for _ in range(50):
                    other.recv(60)
            assert running.is_stepping()
    finally:
        bridge.close()
