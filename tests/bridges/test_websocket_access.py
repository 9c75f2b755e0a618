"""Which web pages and hosts can connect to the bridges over WebSocket."""

import http.client
import socket
from collections.abc import Callable, Iterator
from functools import partial
from urllib.parse import urlsplit

import pytest

from kbot.ros.bridges.foxglove.bridge import FoxgloveBridge
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge
from kbot.ros.bridges.websocket.topic_server import TopicServer
from kbot.ros.graph.server import GraphServer

ELSEWHERE = "192.0.2.7"
"""An address that is reserved for documentation, so no machine has it."""
HANDSHAKE = [
    ("Upgrade", "websocket"),
    ("Connection", "Upgrade"),
    ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ("Sec-WebSocket-Version", "13"),
    ("Sec-WebSocket-Protocol", "foxglove.sdk.v1"),
]
SERVERS: dict[str, Callable[[PeerLink], TopicServer]] = {
    "foxglove": partial(FoxgloveBridge, port=0),
    "rosbridge": partial(RosbridgeBridge, port=0),
    "graph": GraphServer,
}


@pytest.fixture(params=SERVERS)
def server(request: pytest.FixtureRequest) -> Iterator[TopicServer]:
    server = SERVERS[request.param](PeerLink(print))
    try:
        yield server
    finally:
        server.close()


def status(server: TopicServer, hosts: list[str], origins: list[str]) -> int:
    """The status of the answer to a handshake with these Host and Origin headers: 101 if it is accepted."""
    address = urlsplit(server.address)
    connection = http.client.HTTPConnection("127.0.0.1", address.port or 0, timeout=60)
    connection.putrequest("GET", address.path or "/", skip_host=True, skip_accept_encoding=True)
    for name, values in (("Host", hosts), ("Origin", origins)):
        for value in values:
            connection.putheader(name, value)
    for name, value in HANDSHAKE:
        connection.putheader(name, value)
    connection.endheaders()
    found = connection.getresponse().status
    connection.close()
    return found


@pytest.mark.parametrize("host", ["127.0.0.1:1", "localhost", "[::1]:1", socket.gethostname()])
@pytest.mark.parametrize("origins", [[], ["http://localhost:1"], ["http://127.0.0.1:1"], ["http://[::1]"]])
def test_this_machine_is_accepted(server: TopicServer, host: str, origins: list[str]) -> None:
    assert status(server, [host], origins) == 101


@pytest.mark.parametrize(
    "hosts",
    [[], ["evil.example:1"], [ELSEWHERE], ["127.0.0.1", "127.0.0.1"], ["evil.example@127.0.0.1"], ["[::1"]],
)
def test_a_foreign_host_is_refused(server: TopicServer, hosts: list[str]) -> None:
    assert status(server, hosts, []) == 403


@pytest.mark.parametrize(
    "origins",
    [
        ["null"],
        [""],
        ["http://evil.example"],
        ["http://localhost.evil.example"],
        ["http://localhost@evil.example"],
        ["http://[::1"],
        ["http://localhost", "http://evil.example"],
        [f"http://{socket.gethostname()}.evil.example"],
    ],
)
def test_a_foreign_page_is_refused(server: TopicServer, origins: list[str]) -> None:
    assert status(server, ["127.0.0.1"], origins) == 403


@pytest.mark.parametrize("kind", [FoxgloveBridge, RosbridgeBridge])
def test_other_machines_connect_by_address_or_served_name(kind: type[TopicServer]) -> None:
    """Behind address translation, Host has an address that is not one of this machine."""
    server = kind(PeerLink(print), host="0.0.0.0", port=0)
    try:
        assert status(server, [f"{ELSEWHERE}:8765"], []) == 101
        assert status(server, ["localhost:8765"], []) == 101
        assert status(server, ["evil.example:8765"], []) == 403
        assert status(server, [f"{ELSEWHERE}:8765"], ["http://evil.example"]) == 403
    finally:
        server.close()
