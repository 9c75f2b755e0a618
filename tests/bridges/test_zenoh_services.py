"""Services over Zenoh, called with the bare library: attachments, and faulty peers."""

import os
import random
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
import zenoh

from kbot.messages import services as srv
from kbot.record.encodings.serialization import encode_cdr
from kbot.ros.bridges.service import Service
from kbot.ros.bridges.zenoh.bridge import ZenohBridge
from kbot.ros.bridges.zenoh.queryables import LARGEST_REQUEST, MOST_QUERIES, ServiceServer
from kbot.ros.service_types import service_hash, service_type
from kbot.text import KbotError

from .conftest import Running, wait_until
from .test_zenoh import free_port

GID = b"\x10" + bytes(range(16))
"""The GID of a caller in an attachment of rmw_zenoh: its length and its bytes."""


def key_of(name: str, kind: str) -> str:
    package, _, short = kind.partition("/")
    return f"0/{name.lstrip('/')}/{package}::srv::dds_::{short}_/{service_hash(f'{package}/srv/{short}')}"


UNPAUSE = key_of("/gazebo/unpause_physics", "std_srvs/Empty")
DELETE = key_of("/gazebo/delete_model", "gazebo_msgs/DeleteModel")
NOTHING = b"\0\1\0\0\0"
"""CDR of an empty request or response."""


@pytest.fixture
def port(running: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The port of a bridge."""
    port = free_port()
    monkeypatch.setattr("kbot.ros.bridges.zenoh.bridge.ROUTER_PORT", port)
    bridge = ZenohBridge(running.link)
    try:
        yield port
    finally:
        bridge.close()


def opened(port: int) -> zenoh.Session:
    """A client, after the bridge has answered its first call."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{port}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    session = zenoh.open(config)
    wait_until(lambda: call(session, UNPAUSE))
    return session


@pytest.fixture
def session(port: int) -> Iterator[zenoh.Session]:
    found = opened(port)
    try:
        yield found
    finally:
        found.close()


def call(session: zenoh.Session, key: str, payload: bytes = NOTHING, **options: object) -> list[zenoh.Reply]:
    """All replies to a call in the form of rmw_zenoh."""
    target = zenoh.QueryTarget.ALL_COMPLETE
    return list(session.get(key, target=target, payload=payload, timeout=20.0, **options))


def serves(session: zenoh.Session) -> bool:
    return any(reply.ok is not None for reply in call(session, UNPAUSE))


def test_a_response_has_the_number_and_the_gid_of_its_request(session: zenoh.Session) -> None:
    before = time.time_ns()
    sent = struct.pack("<qq", 7, before) + GID
    (reply,) = call(session, UNPAUSE, attachment=sent)
    found = reply.ok.attachment.to_bytes()
    assert len(found) == 33
    number, stamp = struct.unpack("<qq", found[:16])
    assert (number, found[16:]) == (7, GID)
    assert before <= stamp <= time.time_ns()
    assert reply.ok.payload.to_bytes() == NOTHING
    assert str(reply.ok.key_expr) == UNPAUSE


def test_a_call_with_another_or_no_attachment_is_answered(session: zenoh.Session) -> None:
    (reply,) = call(session, UNPAUSE)
    assert reply.ok.attachment is None
    (reply,) = call(session, UNPAUSE, attachment=b"\x0fsequence_number")
    assert reply.ok.attachment.to_bytes() == b"\x0fsequence_number"


def test_a_call_of_another_type_or_domain_is_not_answered(session: zenoh.Session) -> None:
    assert call(session, UNPAUSE[:-1] + "x") == []
    assert call(session, "1" + UNPAUSE[1:]) == []


@pytest.mark.parametrize("payload", [b"", b"\0\1\0\0", b"\0\1\0\0\xff\xff\xff\xff", b"\0\1\0\0\4\0\0\0gh"])
def test_an_incomplete_request_is_refused(session: zenoh.Session, running: Running, payload: bytes) -> None:
    (reply,) = call(session, DELETE, payload)
    assert (
        f"{len(payload)} bytes are not a gazebo_msgs/msg/DeleteModel_Request" in reply.err.payload.to_string()
    )
    assert running.is_stepping()


def test_random_requests_to_every_service(session: zenoh.Session, running: Running) -> None:
    noise = random.Random(5)
    tokens = [str(reply.ok.key_expr).split("/") for reply in session.liveliness().get("@ros2_lv/**")]
    served = [f"0/{t[9].replace('%', '/').lstrip('/')}/{t[10]}/{t[11]}" for t in tokens if t[5] == "SS"]
    assert len(served) > len(running.link.services)
    for key in served:
        for _ in range(12):
            call(session, key, (b"\0\1\0\0", b"\0\0\0\0", b"")[noise.randrange(3)] + noise.randbytes(40))
    call(session, UNPAUSE)
    assert running.is_stepping()
    assert serves(session)


def test_a_request_that_is_too_large_is_refused(session: zenoh.Session, running: Running) -> None:
    (reply,) = call(session, DELETE, bytes(LARGEST_REQUEST + 1))
    assert "is too large" in reply.err.payload.to_string()
    assert running.is_stepping()


def key_of_token(session: zenoh.Session, name: str) -> str:
    """The key of a service, from its liveliness token."""
    tokens = [str(reply.ok.key_expr).split("/") for reply in session.liveliness().get("@ros2_lv/**")]
    token = next(token for token in tokens if token[5] == "SS" and token[9] == name.replace("/", "%"))
    return f"0{name}/{token[10]}/{token[11]}"


def names_of(*names: str) -> bytes:
    """A request in CDR with a list of names."""
    data = struct.pack("<I", len(names))
    for name in names:
        data += bytes(-len(data) % 4) + struct.pack("<I", len(name) + 1) + name.encode() + b"\0"
    return b"\0\1\0\0" + data


def test_parameters_that_cannot_be_encoded(session: zenoh.Session, running: Running) -> None:
    deep: list[object] = []
    for _ in range(5000):
        deep = [deep]
    running.link.set_parameters({"/deep": deep, "/odd": "\ud800", "/good": 1})
    get = key_of_token(session, "/kbot/get_parameters")
    (reply,) = call(session, get, names_of("odd"))
    assert "the rcl_interfaces/msg/GetParameters_Response cannot be encoded" in reply.err.payload.to_string()
    (reply,) = call(session, get, names_of("deep", "good"))
    assert reply.ok.payload.to_bytes()[8] == 0  # the type of the first: not set
    (reply,) = call(session, get, names_of(*["good"] * 1001))
    assert "1001 parameters in one call" in reply.err.payload.to_string()
    assert running.reported == []
    assert running.is_stepping()


def test_a_service_without_a_status_field_fails(session: zenoh.Session, running: Running) -> None:
    def refuse(simulation: object, request: object) -> object:
        raise KbotError("not today")

    offered = running.link.services
    kind = service_type("std_srvs/Empty")
    running.link.offer({**offered, "/refusing": Service("/refusing", kind, refuse)})
    key = key_of("/refusing", "std_srvs/Empty")
    wait_until(lambda: call(session, key))
    (reply,) = call(session, key)
    assert reply.err.payload.to_string() == "not today"
    running.link.offer(offered)
    wait_until(lambda: not call(session, key))
    assert not list(session.liveliness().get("@ros2_lv/*/*/*/*/SS/*/*/*/%refusing/**"))
    assert serves(session)


def test_calls_above_the_limit_are_not_answered(session: zenoh.Session, running: Running) -> None:
    """The other calls, and later ones, are answered."""
    running.stop()
    waiting = [start(session) for _ in range(MOST_QUERIES + 40)]
    wait_until(lambda: any("are already waiting" in text for text in running.reported))
    answered = [take(running, replies) for replies in waiting]
    assert MOST_QUERIES <= sum(answered) < len(waiting)
    assert take(running, start(session))


def start(session: zenoh.Session) -> zenoh.Handler:
    """Start a call without waiting for the reply."""
    return session.get(UNPAUSE, target=zenoh.QueryTarget.ALL_COMPLETE, payload=NOTHING, timeout=60.0)


def take(running: Running, replies: zenoh.Handler) -> bool:
    """Whether a reply comes before the call ends. Meanwhile, the simulation answers."""
    while True:
        running.simulation.run_errands()
        try:
            if replies.try_recv() is not None:
                return True
        except zenoh.ZError:  # the call has ended
            return False
        time.sleep(0.001)


GREEDY = """
import sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
session = zenoh.open(config)
every, payload, kept = zenoh.QueryTarget.ALL_COMPLETE, bytes.fromhex(sys.argv[3]), []
print("ready", flush=True)
while True:
    kept.append(session.get(sys.argv[2], target=every, payload=payload))
"""


@contextmanager
def greedy(session: zenoh.Session, running: Running, port: int) -> Iterator[None]:
    """A caller that calls for large responses without pause, and then stops reading."""
    running.link.set_parameters({"/large": "x" * 100_000})
    request, key = names_of(*["large"] * 100), key_of_token(session, "/kbot/get_parameters")
    assert call(session, key, request)[0].ok is not None
    caller = subprocess.Popen(
        (sys.executable, "-c", GREEDY, str(port), key, request.hex()), stdout=subprocess.PIPE, text=True
    )
    try:
        assert caller.stdout is not None
        assert caller.stdout.readline() == "ready\n"
        time.sleep(0.2)
        os.kill(caller.pid, signal.SIGSTOP)
        yield
    finally:
        caller.kill()
        caller.wait()
        assert caller.stdout is not None
        caller.stdout.close()


def test_a_caller_that_does_not_read_does_not_stop_the_simulation(
    session: zenoh.Session, running: Running, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Zenoh blocks a reply for 5 s before it drops the caller. Then, others are answered."""
    blocked: list[tuple[float, float]] = []  # simulated time before and after each reply that blocked
    send = ServiceServer._end

    def observed(self: ServiceServer, query: object, reply: Callable[[], None]) -> None:
        started, before = time.monotonic(), running.simulation.time
        send(self, query, reply)
        if time.monotonic() - started > 2.0:
            blocked.append((before, running.simulation.time))

    monkeypatch.setattr(ServiceServer, "_end", observed)
    with greedy(session, running, port):
        wait_until(lambda: blocked)
        before, after = blocked[0]
        assert after > before
        wait_until(lambda: serves(session))


def test_a_caller_that_does_not_read_does_not_block_close(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = free_port()
    monkeypatch.setattr("kbot.ros.bridges.zenoh.bridge.ROUTER_PORT", port)
    bridge = ZenohBridge(running.link)
    session = opened(port)
    try:
        with greedy(session, running, port):
            bridge.close()
    finally:
        session.close()
    assert running.is_stepping()


def test_an_empty_message_is_encoded_as_one_byte() -> None:
    """As in ROS 2."""
    assert encode_cdr(srv.EmptyRequest(), service_type("std_srvs/Empty").request_name) == NOTHING
