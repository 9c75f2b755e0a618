"""Bytes that are not a WebSocket handshake are refused, and the server continues."""

import socket
from collections.abc import Iterator

import pytest
from websockets.sync.client import connect

from kbot.ros.bridges.foxglove.bridge import SUBPROTOCOLS, FoxgloveBridge
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge
from kbot.workbench.serve import open_session, serving

UPGRADE = "Upgrade: websocket\r\nConnection: Upgrade\r\n"
KEY = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
HEAD = "GET /ws HTTP/1.1\r\n"
HOST = "Host: 127.0.0.1:{port}\r\n"

GARBAGE = {
    "nothing": "",
    "zeros": "\0" * 100,
    "TLS": "\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03" + "\xaa" * 500,
    "HTTP/2": "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "no headers": HEAD + "\r\n",
    "a word": "GET\r\n\r\n",
    "another method": f"POST /ws HTTP/1.1\r\n{HOST}Content-Length: 99999999999999999999\r\n\r\n",
    "a length that is not a number": f"{HEAD}{HOST}Content-Length: abc\r\n\r\n",
    "a broken chunk": f"{HEAD}{HOST}Transfer-Encoding: chunked\r\n\r\nzz\r\n",
    "a long path": "GET /" + "a" * 100_000,
    "many headers": HEAD + HOST + "A: b\r\n" * 1000 + "\r\n",
    "no key": f"{HEAD}{HOST}{UPGRADE}\r\n",
    "a bad key": f"{HEAD}{HOST}{UPGRADE}Sec-WebSocket-Key: @@@\r\nSec-WebSocket-Version: 13\r\n\r\n",
    "two hosts": f"{HEAD}{HOST}Host: x\r\n{UPGRADE}{KEY}\r\n",
    "half an IPv6 host": f"{HEAD}Host: [::1\r\n{UPGRADE}{KEY}\r\n",
    "a host that is not text": f"{HEAD}Host: \xe9\r\n{UPGRADE}{KEY}\r\n",
    "half an IPv6 origin": f"{HEAD}{HOST}Origin: http://[\r\n{UPGRADE}{KEY}\r\n",
    "two origins": f"{HEAD}{HOST}Origin: a\r\nOrigin: b\r\n{UPGRADE}{KEY}\r\n",
    "bad lists": f"{HEAD}{HOST}{UPGRADE}{KEY}Sec-WebSocket-Protocol: @@,;\r\n"
    "Sec-WebSocket-Extensions: ;;;==\r\n\r\n",
}


@pytest.fixture(scope="module", params=["the page", "foxglove", "rosbridge"])
def address(request: pytest.FixtureRequest) -> Iterator[str]:
    if request.param == "the page":
        with serving(open_session("kbot", simulate=False)) as url:
            yield url.replace("http:", "ws:") + "ws"
        return
    kind = {"foxglove": FoxgloveBridge, "rosbridge": RosbridgeBridge}[request.param]
    bridge = kind(PeerLink(print), port=0)
    yield bridge.address
    bridge.close()


@pytest.mark.parametrize("garbage", GARBAGE)
def test_an_invalid_handshake_is_refused_without_a_traceback(
    address: str, garbage: str, caplog: pytest.LogCaptureFixture
) -> None:
    port = int(address.removesuffix("/ws").rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port), 60) as connection:
        connection.sendall(GARBAGE[garbage].replace("{port}", str(port)).encode("latin-1"))
        connection.shutdown(socket.SHUT_WR)
        answer = b""
        try:
            while part := connection.recv(4096):
                answer += part
        except ConnectionResetError:  # the server did not read all of it
            pass
    assert not answer or answer.split()[1][:1] == b"4", answer
    with connect(address, subprotocols=[SUBPROTOCOLS[0]]) as good:
        assert good.protocol.state.name == "OPEN"
    # the page's server logs one line per refusal; nothing is logged with a traceback
    assert all(record.getMessage().startswith("refused /") for record in caplog.records)
    assert not any(record.exc_info for record in caplog.records)
