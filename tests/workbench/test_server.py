"""The server as a client program sees it: files, refusals, the socket."""

import http.client
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from kbot.workbench.serve import open_session, serving
from kbot.workbench.session.session import Session

from .conftest import until


@pytest.fixture
def page(viewing: str) -> Iterator[ClientConnection]:
    with connect(socket_address(viewing)) as connection:
        yield connection


def socket_address(address: str) -> str:
    return address.replace("http:", "ws:").rstrip("/") + "/ws"


def get(address: str, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=60)
    connection.request("GET", path, headers={name.capitalize(): value for name, value in headers.items()})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, {k.lower(): v for k, v in answer.getheaders()}, body


def receive(connection: ClientConnection, kind: str) -> dict[str, Any]:
    """The next message of this kind."""
    end = time.monotonic() + 60
    while (message := json.loads(connection.recv(timeout=60)))["type"] != kind:
        assert time.monotonic() < end, f"no {kind} within 60 s"
    return dict(message)


def send(connection: ClientConnection, **message: Any) -> None:
    connection.send(json.dumps(message))


def test_the_page_is_served_with_its_policy(viewing: str) -> None:
    status, headers, body = get(viewing, "/")
    assert status == 200
    assert headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    assert b"<script" in body
    script = body.decode().split('src="./')[1].split('"')[0]
    status, headers, _ = get(viewing, f"/{script}")
    assert status == 200
    assert headers["content-type"].startswith("text/javascript")


@pytest.mark.parametrize(
    "path",
    [
        "/nothing",
        "/assets/",
        "/../pyproject.toml",
        "/%2e%2e/x",
        "/mesh/",
        "/mesh/../../etc/passwd",
        "/index.html/x",
    ],
)
def test_unknown_paths_are_404(viewing: str, path: str) -> None:
    status, headers, _ = get(viewing, path)
    assert status == 404
    assert "content-security-policy" in headers


def test_a_foreign_host_or_origin_is_refused(viewing: str) -> None:
    assert get(viewing, "/", host="evil.example")[0] == 403
    assert get(viewing, "/", origin="http://evil.example")[0] == 403
    with (
        pytest.raises(InvalidStatus) as caught,
        connect(socket_address(viewing), origin="http://evil.example"),
    ):
        pass
    assert caught.value.response.status_code == 403


def test_a_page_that_does_not_answer_is_disconnected(xacro: Path) -> None:
    """Much earlier than the library's 10 s."""
    session = open_session(str(xacro), simulate=False)
    with serving(session) as address:
        port = urlsplit(address).port
        silent = socket.create_connection(("127.0.0.1", port), timeout=60)
        head = (
            f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        silent.sendall(head.encode())
        assert silent.recv(12) == b"HTTP/1.1 101"
        ends: list[str] = []

        def listen() -> None:
            try:
                while silent.recv(1 << 16):
                    pass
                ends.append("closed")
            except OSError as error:
                ends.append(repr(error))

        listening = threading.Thread(target=listen)
        listening.start()
    listening.join()
    silent.close()
    assert ends == ["closed"]


def test_other_machines_need_the_token_for_the_socket(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=False)
    with serving(session, host="0.0.0.0") as address:
        port = urlsplit(address).port
        token = urlsplit(address).query
        assert token.startswith("token=")
        with pytest.raises(InvalidStatus), connect(f"ws://127.0.0.1:{port}/ws"):
            pass
        with connect(f"ws://127.0.0.1:{port}/ws?{token}") as connection:
            assert receive(connection, "about")["mode"] == "view"


def test_a_new_page_receives_the_complete_state(page: ClientConnection) -> None:
    kinds = [json.loads(page.recv(timeout=60))["type"] for _ in range(5)]
    assert kinds == ["about", "scene", "findings", "parameters", "state"]


def test_bad_messages_are_answered_and_ignored(page: ClientConnection, viewing: str) -> None:
    for text in (
        "{",
        '{"type": "fly"}',
        '{"type": "set_joint", "name": "left_wheel_joint", "position": 1e99}',
    ):
        page.send(text)
        assert receive(page, "refused")["reason"]
    page.send(b"\x00\x01")
    assert "binary" in receive(page, "refused")["reason"]
    send(page, type="drive", linear=0.1, angular=0.0)
    assert "kbot sim" in receive(page, "refused")["reason"]
    send(page, type="open_source", file="/etc/passwd")
    assert "not part of this description" in receive(page, "refused")["reason"]
    with connect(socket_address(viewing)) as other:
        assert receive(other, "state")["positions"] == [0.0, 0.0]


def test_a_too_long_message_ends_the_connection(page: ClientConnection, viewing: str) -> None:
    page.send("x" * (7 * 1024 * 1024 + 1))
    with pytest.raises(ConnectionClosed):
        receive(page, "nothing of the kind")
    assert get(viewing, "/")[0] == 200


def test_a_joint_position_is_sent_to_all_pages(page: ClientConnection, viewing: str) -> None:
    with connect(socket_address(viewing)) as other:
        receive(other, "state")
        send(page, type="set_joint", name="left_wheel_joint", position=0.75)
        for connection in (page, other):
            until(lambda connection=connection: receive(connection, "state")["positions"][0] == 0.75)


def test_the_source_is_sent_with_its_owners(page: ClientConnection, xacro: Path) -> None:
    send(page, type="open_source", file=str(xacro))
    source = receive(page, "source")
    assert source["text"] == xacro.read_text()
    lines = source["text"].splitlines()
    assert source["owners"][lines.index('  <link name="base_link">')] == ["base_link"]


def test_a_silent_page_stops_the_robot(driving: tuple[str, Session]) -> None:
    with connect(socket_address(driving[0])) as connection:
        send(connection, type="drive", linear=0.2, angular=0.0)
        until(lambda: receive(connection, "state")["command"] == [0.2, 0.0])
        until(lambda: receive(connection, "state")["command"] == [0.0, 0.0])


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_only_get_and_head_are_answered(viewing: str, method: str) -> None:
    connection = http.client.HTTPConnection(urlsplit(viewing).netloc, timeout=60)
    connection.request(method, "/")
    answer = connection.getresponse()
    assert (answer.status, answer.headers["Allow"]) == (405, "GET, HEAD")
    connection.close()


def test_too_many_pages_are_refused(viewing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kbot.workbench.serving.server.MAX_PAGES", 1)
    with connect(socket_address(viewing)) as first:
        receive(first, "about")
        with connect(socket_address(viewing)) as second, pytest.raises(ConnectionClosed) as caught:
            second.recv(timeout=60)
    assert caught.value.rcvd is not None
    assert caught.value.rcvd.code == 1013


def test_garbage_on_the_port_is_harmless(viewing: str) -> None:
    parts = urlsplit(viewing)
    for rubbish in (
        b"\x00" * 64,
        b"GET\r\n\r\n",
        b"POST / HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
    ):
        with socket.create_connection((parts.hostname, parts.port), timeout=60) as raw:
            raw.sendall(rubbish)
            raw.shutdown(socket.SHUT_WR)
            while raw.recv(4096):
                pass
    assert get(viewing, "/")[0] == 200


def test_a_malformed_address_is_refused(viewing: str) -> None:
    assert get(viewing, "//[")[0] == 400


@pytest.mark.parametrize("path", ["/", "/export/robot.glb", "/nowhere"])
def test_head_answers_without_a_body(viewing: str, path: str) -> None:
    parts = urlsplit(viewing)
    with socket.create_connection((parts.hostname, parts.port), timeout=60) as raw:
        raw.sendall(f"HEAD {path} HTTP/1.1\r\nHost: {parts.netloc}\r\n\r\n".encode())
        answer = b""
        while piece := raw.recv(4096):
            answer += piece
    head, body = answer.split(b"\r\n\r\n", 1)
    status, _, whole = get(viewing, path)
    assert head.startswith(f"HTTP/1.1 {status} ".encode())
    assert body == b""
    assert (f"Content-Length: {len(whole)}".encode() in head) == (not path.startswith("/export/"))


@pytest.mark.parametrize("slow", ["taking a reading", "opening a file"])
def test_requests_are_answered_while_the_simulation_is_in_use(
    slow: str, xacro: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A large robot takes seconds to simulate, and to annotate in the editor."""
    session = open_session(str(xacro), simulate=True)
    may_end, has_begun = threading.Event(), threading.Event()

    def waiting(work: Callable[..., Any]) -> Callable[..., Any]:
        def work_later(*arguments: Any) -> Any:
            has_begun.set()
            assert may_end.wait(60.0)
            return work(*arguments)

        return work_later

    monkeypatch.setattr(session, "adopt", waiting(session.adopt))
    monkeypatch.setattr(session.shown, "open", waiting(session.shown.open))
    with serving(session) as address, connect(socket_address(address)) as page:
        receive(page, "scene")
        if slow == "taking a reading":
            xacro.write_text(xacro.read_text() + "\n")
        else:
            send(page, type="open_source", file=str(xacro))
        assert has_begun.wait(60.0)
        assert get(address, "/nothing")[0] == 404
        with connect(socket_address(address)) as other:
            receive(other, "scene")
        may_end.set()
        receive(page, "findings" if slow == "taking a reading" else "source")
