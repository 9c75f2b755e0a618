"""The Foxglove protocol with a raw client: what is advertised, said, latched, heard and refused."""

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
    found = FoxgloveBridge(running.link, port=0)
    try:
        yield found
    finally:
        found.close()


class Client:
    """Says hello, and keeps what it was told."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.info = self.hear("serverInfo")
        self.channels = {c["topic"]: c for c in self.hear("advertise")["channels"]}

    def hear(self, operation: str) -> dict:
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

    def say(self, **request: object) -> None:
        self.socket.send(json.dumps(request))

    def subscribe(self, number: int, topic: str) -> None:
        self.say(op="subscribe", subscriptions=[{"id": number, "channelId": self.channels[topic]["id"]}])


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


def test_what_is_latched_comes_to_each_that_comes_late(running: Running, bridge: FoxgloveBridge) -> None:
    assert running.is_stepping()
    for _ in range(2):
        with client(bridge) as c:
            c.subscribe(1, "/robot_description")
            assert decode_cdr(c.message(1)[1], msg.String).data == "<robot/>"


def test_no_more_comes_after_unsubscribing(running: Running, bridge: FoxgloveBridge) -> None:
    with client(bridge) as c:
        c.subscribe(1, "/odom")
        c.message(1)
        c.say(op="unsubscribe", subscriptionIds=[1])
        c.subscribe(2, "/joint_states")
        c.message(2)
        end = time.monotonic() + 0.3
        while time.monotonic() < end:
            data = c.socket.recv(60)
            assert not (isinstance(data, bytes) and data[:5] == b"\x01\x01\0\0\0")


@pytest.mark.parametrize("encoding", ["cdr", "json"])
@pytest.mark.parametrize("stamped", [False, True])
def test_a_client_drives_it(running: Running, bridge: FoxgloveBridge, encoding: str, stamped: bool) -> None:
    twist = msg.Twist(msg.Vector3(0.3))
    name = "geometry_msgs/msg/TwistStamped" if stamped else "geometry_msgs/Twist"
    if encoding == "cdr":
        data = encode_cdr(msg.TwistStamped(msg.Header(), twist) if stamped else twist)
    else:
        plain = {"linear": {"x": 0.3}}
        data = json.dumps({"twist": plain} if stamped else plain).encode()
    with client(bridge) as c:
        c.say(
            op="advertise",
            channels=[{"id": 3, "topic": "/cmd_vel", "encoding": encoding, "schemaName": name}],
        )
        c.socket.send(struct.pack("<BI", 1, 3) + data)
        wait_until(lambda: running.simulation.robots.first.twist.x > 0.1)
        wait_until(lambda: running.simulation.robots.first.twist.x == 0.0)


def test_parameters(bridge: FoxgloveBridge) -> None:
    with client(bridge) as c:
        c.say(op="getParameters", parameterNames=["/use_sim_time"], id="q")
        assert c.hear("parameterValues") == {
            "op": "parameterValues",
            "parameters": [{"name": "/use_sim_time", "value": True}],
            "id": "q",
        }


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ('{"op": "fly"}', "no operation 'fly'"),
        ("[]", "object with an 'op'"),
        ("{", "no JSON"),
        ("[" * 100_000, "no JSON"),
        ('{"op": "subscribe"}', "KeyError 'subscriptions'"),
        ('{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}', "no channel 99"),
        ('{"op": "subscribe", "subscriptions": 5}', "subscribe: TypeError"),
        (
            '{"op": "advertise", "channels": [{"id": 1, "topic": "/cmd_vle", "encoding": "cdr", '
            '"schemaName": "geometry_msgs/Twist"}]}',
            "nobody hears /cmd_vle here: did you mean",
        ),
        (
            '{"op": "advertise", "channels": [{"id": 1, "topic": "/cmd_vel", "encoding": "xml", '
            '"schemaName": "geometry_msgs/Twist"}]}',
            "cannot be heard as",
        ),
        (b"", "no message"),
        (b"\x01\x09\0\0\0abc", "channel 9 was not advertised"),
        (b"\x07aaaaaaa", "no message"),
    ],
)
def test_what_cannot_be_done_is_told(
    running: Running, bridge: FoxgloveBridge, request_: str | bytes, said: str
) -> None:
    with client(bridge) as c:
        c.socket.send(request_)
        assert said in c.hear("status")["message"]
        c.subscribe(1, "/odom")
        c.message(1)


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "https://localhost.evil.example"])
def test_strangers_pages_stay_out(bridge: FoxgloveBridge, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"), connect(bridge.address, origin=Origin(origin)):
        pass


@pytest.mark.parametrize(
    "origin", ["https://app.foxglove.dev", "http://localhost:8080", "http://127.0.0.1:5173"]
)
def test_foxglove_and_pages_of_this_machine_come_in(bridge: FoxgloveBridge, origin: str) -> None:
    with connect(
        bridge.address, origin=Origin(origin), subprotocols=[Subprotocol(SUBPROTOCOLS[0])]
    ) as connection:
        assert json.loads(connection.recv(60))["op"] == "serverInfo"


def test_a_name_that_was_bent_to_this_machine_stays_out(bridge: FoxgloveBridge) -> None:
    """As by DNS rebinding."""
    raw = socket.create_connection(("127.0.0.1", int(bridge.address.rpartition(":")[2])))
    with raw, pytest.raises(InvalidStatus, match="403"), connect("ws://rebound.example:80", sock=raw):
        pass


def test_a_client_that_never_reads_stalls_nobody(running: Running, bridge: FoxgloveBridge) -> None:
    topics = ["/odom", "/tf", "/joint_states", "/clock", "/tf_static"]
    with client(bridge) as c:
        wanted = [{"id": n, "channelId": c.channels[topic]["id"]} for n, topic in enumerate(topics)]
    protocols = [Subprotocol(SUBPROTOCOLS[1])]
    with connect(bridge.address, subprotocols=protocols, max_queue=1, close_timeout=0.1) as deaf:
        deaf.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        with client(bridge) as c:
            c.subscribe(1, "/odom")
            for _ in range(50):
                c.message(1)
        assert running.is_stepping()


def test_noise_and_a_flood_end_nothing(running: Running, bridge: FoxgloveBridge) -> None:
    noise = random.Random(2)
    for _ in range(20):
        with contextlib.suppress(ConnectionClosed), client(bridge) as c:
            for _ in range(20):
                data = noise.randbytes(noise.randrange(200))
                c.socket.send(data if noise.random() < 0.5 else data.decode("latin-1"))
    with client(bridge) as c:
        c.say(
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


def test_a_port_that_is_taken_is_passed_over_and_another_s_address_is_refused(running: Running) -> None:
    first = FoxgloveBridge(running.link, port=0)
    port = int(first.address.rpartition(":")[2])
    second = FoxgloveBridge(running.link, port=port)
    assert int(second.address.rpartition(":")[2]) > port
    first.close()
    second.close()
    with pytest.raises(KbotError, match=r"Foxglove cannot be served at 192\.0\.2\.1"):
        FoxgloveBridge(running.link, host="192.0.2.1")
