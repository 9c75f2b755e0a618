"""The Foxglove bridge, with a raw WebSocket client."""

import contextlib
import json
import random
import socket
import struct
import time
from collections.abc import Iterator

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from kbot.messages import types as msg
from kbot.record.encodings.serialization import decode_cdr, encode_cdr
from kbot.ros.bridges.foxglove.bridge import SUBPROTOCOLS, FoxgloveBridge
from kbot.text import KbotError

from .conftest import Running, wait_until


@pytest.fixture
def bridge(running: Running) -> Iterator[FoxgloveBridge]:
    bridge = FoxgloveBridge(running.link, port=0)
    try:
        yield bridge
    finally:
        bridge.close()


class Client:
    """Receives the server's information and channels when it connects."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.info = self.receive("serverInfo")
        self.channels = {c["topic"]: c for c in self.receive("advertise")["channels"]}

    def receive(self, operation: str) -> dict:
        while True:
            data = self.socket.recv(60)
            if isinstance(data, str) and json.loads(data)["op"] == operation:
                return json.loads(data)

    def message(self, subscription: int) -> tuple[int, bytes]:
        while True:
            data = self.socket.recv(60)
            if isinstance(data, bytes) and data[0] == 1:
                number, at = struct.unpack_from("<IQ", data, 1)
                if number == subscription:
                    return at, data[13:]

    def send(self, **request: object) -> None:
        self.socket.send(json.dumps(request))

    def subscribe(self, number: int, topic: str) -> None:
        self.send(op="subscribe", subscriptions=[{"id": number, "channelId": self.channels[topic]["id"]}])


@contextlib.contextmanager
def client(bridge: FoxgloveBridge, subprotocol: str = SUBPROTOCOLS[0]) -> Iterator[Client]:
    with connect(bridge.address, subprotocols=[Subprotocol(subprotocol)], max_queue=None) as socket:
        yield Client(socket)


@pytest.mark.parametrize("subprotocol", SUBPROTOCOLS)
def test_channels_and_messages_on_both_subprotocols(
    running: Running, bridge: FoxgloveBridge, subprotocol: str
) -> None:
    with client(bridge, subprotocol) as c:
        assert c.socket.subprotocol == subprotocol
        capabilities = {"clientPublish", "parameters", "parametersSubscribe", "services", "time"}
        assert capabilities == set(c.info["capabilities"])
        channel = c.channels["/odom"]
        assert (channel["encoding"], channel["schemaName"]) == ("cdr", "nav_msgs/msg/Odometry")
        assert (channel["schemaEncoding"], "string child_frame_id" in channel["schema"]) == ("ros2msg", True)
        c.subscribe(7, "/odom")
        at, data = c.message(7)
        assert decode_cdr(data, msg.Odometry).header.stamp.nanoseconds == at


def test_late_subscribers_receive_latched_messages(running: Running, bridge: FoxgloveBridge) -> None:
    assert running.is_stepping()
    for _ in range(2):
        with client(bridge) as c:
            c.subscribe(1, "/robot_description")
            assert decode_cdr(c.message(1)[1], msg.String).data == "<robot/>"


def test_unsubscribe_ends_the_messages(running: Running, bridge: FoxgloveBridge) -> None:
    with client(bridge) as c:
        c.subscribe(1, "/odom")
        c.message(1)
        c.send(op="unsubscribe", subscriptionIds=[1])
        c.subscribe(2, "/joint_states")
        c.message(2)
        end = time.monotonic() + 0.3
        while time.monotonic() < end:
            data = c.socket.recv(60)
            assert not (isinstance(data, bytes) and data[:5] == b"\x01\x01\0\0\0")


@pytest.mark.parametrize("encoding", ["cdr", "json"])
@pytest.mark.parametrize("stamped", [False, True])
def test_a_client_drives_the_robot(
    running: Running, bridge: FoxgloveBridge, encoding: str, stamped: bool
) -> None:
    twist = msg.Twist(msg.Vector3(0.3))
    name = "geometry_msgs/msg/TwistStamped" if stamped else "geometry_msgs/Twist"
    if encoding == "cdr":
        data = encode_cdr(msg.TwistStamped(msg.Header(), twist) if stamped else twist)
    else:
        plain = {"linear": {"x": 0.3}}
        data = json.dumps({"twist": plain} if stamped else plain).encode()
    with client(bridge) as c:
        c.send(
            op="advertise",
            channels=[{"id": 3, "topic": "/cmd_vel", "encoding": encoding, "schemaName": name}],
        )
        c.socket.send(struct.pack("<BI", 1, 3) + data)
        wait_until(lambda: running.simulation.robots.first.twist.x > 0.1)
        wait_until(lambda: running.simulation.robots.first.twist.x == 0.0)


def test_parameters(bridge: FoxgloveBridge) -> None:
    with client(bridge) as c:
        c.send(op="getParameters", parameterNames=["/use_sim_time"], id="q")
        assert c.receive("parameterValues") == {
            "op": "parameterValues",
            "parameters": [{"name": "/use_sim_time", "value": True}],
            "id": "q",
        }


@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ('{"op": "fly"}', "no operation 'fly'"),
        ("[]", "object with an 'op'"),
        ("{", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"op": "subscribe"}', "KeyError 'subscriptions'"),
        ('{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}', "no channel with the ID 99"),
        ('{"op": "subscribe", "subscriptions": 5}', "subscribe: TypeError"),
        (
            '{"op": "advertise", "channels": [{"id": 1, "topic": "/cmd_vle", "encoding": "cdr", '
            '"schemaName": "geometry_msgs/Twist"}]}',
            "KBot does not subscribe to /cmd_vle: did you mean",
        ),
        (
            '{"op": "advertise", "channels": [{"id": 1, "topic": "/cmd_vel", "encoding": "xml", '
            '"schemaName": "geometry_msgs/Twist"}]}',
            "KBot does not accept geometry_msgs/Twist in xml on /cmd_vel",
        ),
        (b"", "unknown binary message"),
        (b"\x01\x09\0\0\0abc", "channel 9 has not been advertised"),
        (b"\x07aaaaaaa", "unknown binary message"),
    ],
)
def test_errors_are_reported_to_the_client(
    running: Running, bridge: FoxgloveBridge, request_: str | bytes, error: str
) -> None:
    with client(bridge) as c:
        c.socket.send(request_)
        assert error in c.receive("status")["message"]
        c.subscribe(1, "/odom")
        c.message(1)


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "https://localhost.evil.example"])
def test_foreign_web_pages_are_refused(bridge: FoxgloveBridge, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"), connect(bridge.address, origin=Origin(origin)):
        pass


@pytest.mark.parametrize(
    "origin", ["https://app.foxglove.dev", "http://localhost:8080", "http://127.0.0.1:5173"]
)
def test_foxglove_and_local_web_pages_are_accepted(bridge: FoxgloveBridge, origin: str) -> None:
    with connect(
        bridge.address, origin=Origin(origin), subprotocols=[Subprotocol(SUBPROTOCOLS[0])]
    ) as connection:
        assert json.loads(connection.recv(60))["op"] == "serverInfo"


def test_foreign_host_names_are_refused(bridge: FoxgloveBridge) -> None:
    """DNS rebinding lets such a name resolve to this machine."""
    raw = socket.create_connection(("127.0.0.1", int(bridge.address.rpartition(":")[2])))
    with raw, pytest.raises(InvalidStatus, match="403"), connect("ws://rebound.example:80", sock=raw):
        pass


def test_a_client_that_never_reads_does_not_delay_others(running: Running, bridge: FoxgloveBridge) -> None:
    topics = ["/odom", "/tf", "/joint_states", "/clock", "/tf_static"]
    with client(bridge) as c:
        wanted = [{"id": n, "channelId": c.channels[topic]["id"]} for n, topic in enumerate(topics)]
    protocols = [Subprotocol(SUBPROTOCOLS[1])]
    with connect(bridge.address, subprotocols=protocols, max_queue=1, close_timeout=0.1) as idle:
        idle.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        with client(bridge) as c:
            c.subscribe(1, "/odom")
            for _ in range(50):
                c.message(1)
        assert running.is_stepping()


def test_invalid_and_too_many_messages_do_not_stop_the_server(
    running: Running, bridge: FoxgloveBridge
) -> None:
    noise = random.Random(2)
    for _ in range(20):
        with contextlib.suppress(ConnectionClosed), client(bridge) as c:
            for _ in range(20):
                data = noise.randbytes(noise.randrange(200))
                c.socket.send(data if noise.random() < 0.5 else data.decode("latin-1"))
    with client(bridge) as c:
        c.send(
            op="advertise",
            channels=[
                {"id": 3, "topic": "/cmd_vel", "encoding": "json", "schemaName": "geometry_msgs/Twist"}
            ],
        )
        for _ in range(2000):
            c.socket.send(struct.pack("<BI", 1, 3) + b'{"linear": {"x": 0.1}}')
        assert running.is_stepping()
    with client(bridge) as c:
        c.subscribe(1, "/odom")
        c.message(1)


def test_the_next_free_port_is_used_and_a_foreign_address_is_refused(running: Running) -> None:
    first = FoxgloveBridge(running.link, port=0)
    port = int(first.address.rpartition(":")[2])
    second = FoxgloveBridge(running.link, port=port)
    assert int(second.address.rpartition(":")[2]) > port
    first.close()
    second.close()
    with pytest.raises(KbotError, match=r"Foxglove cannot be served at 192\.0\.2\.1"):
        FoxgloveBridge(running.link, host="192.0.2.1")
