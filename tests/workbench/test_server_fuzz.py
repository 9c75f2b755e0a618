"""Arbitrary data for the server: it answers and continues without a traceback."""

import http.client
import json
import time
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from kbot.workbench.protocol import Bounds, FromPage, Length
from kbot.workbench.protocol.messages import Bytes
from kbot.workbench.serve import open_session, serving
from kbot.workbench.session.session import Session

SAME_EACH_TIME = settings(
    max_examples=200,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

ODD_TEXTS = ["", " ", "\x00", "\ud800", "\U0010ffff", "..", "../../etc/passwd", "file:///etc/passwd", "%s%n"]
ODD_TEXTS += ["a" * 255, "left_wheel_joint", "base_link", "kbot", "/cmd_vel", "/goal_pose", "/odom", "box"]
ODD_TEXTS += ["empty", "/initialpose", "/clicked_point", "geometry_msgs/msg/Twist", "${1/0}", "</script>"]
TEXTS = st.sampled_from(ODD_TEXTS) | st.text(st.characters(), max_size=20)
NUMBERS = st.floats() | st.integers() | st.sampled_from([0, -0.0, 1, 1e308, 10**400, 5e-324])
ANYTHING = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=8,
)
KINDS = {typing.get_args(typing.get_type_hints(cls)["type"])[0]: cls for cls in typing.get_args(FromPage)}
FIELDS_OF_MESSAGES = st.sampled_from(
    [
        "linear",
        "angular",
        "x",
        "y",
        "z",
        "w",
        "header",
        "stamp",
        "sec",
        "nanosec",
        "frame_id",
        "pose",
        "point",
    ]
)


def meant(hint: Any) -> st.SearchStrategy[Any]:
    """Valid values, including the limits of their range."""
    bound = None
    if typing.get_origin(hint) is Annotated:
        hint, bound = typing.get_args(hint)
    if typing.get_origin(hint) is Literal:
        return st.sampled_from(typing.get_args(hint))
    if hint is float:
        assert isinstance(bound, Bounds)
        return st.sampled_from([bound.low, bound.high]) | st.floats(bound.low, bound.high)
    if hint is bool:
        return st.booleans()
    if hint is str:
        assert isinstance(bound, Length | Bytes)
        return TEXTS
    if typing.get_origin(hint) is tuple:
        return st.lists(TEXTS | st.sampled_from(["state twist.0", "/odom pose.pose.position.x"]), max_size=13)
    return st.recursive(
        st.dictionaries(FIELDS_OF_MESSAGES, ANYTHING, max_size=3),
        lambda inner: st.dictionaries(FIELDS_OF_MESSAGES, inner | NUMBERS, max_size=3),
        max_leaves=6,
    )


@st.composite
def messages(draw: st.DrawFn) -> str:
    """A message of any type with valid values in most fields, and anything in the others."""
    kind = draw(st.sampled_from(sorted(KINDS)))
    hints = typing.get_type_hints(KINDS[kind], include_extras=True)
    del hints["type"]
    odd = draw(st.sampled_from(["", *sorted(hints)]))
    fields = {name: draw(ANYTHING if name == odd else meant(hint)) for name, hint in hints.items()}
    return json.dumps({"type": kind, **fields})


@pytest.fixture
def served(
    request: pytest.FixtureRequest, xacro: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[str, Session]]:
    monkeypatch.chdir(tmp_path)  # the folder of recordings
    session = open_session(str(xacro), simulate=getattr(request, "param", "view") == "sim")
    with serving(session) as address:
        yield address, session


@pytest.fixture
def send(served: tuple[str, Session]) -> Iterator[Callable[[str | bytes], None]]:
    """Send something, and return after the same page has received an answer to its next message."""
    with connect(served[0].replace("http:", "ws:") + "ws", max_size=None) as connection:
        count = 0

        def send_one(data: str | bytes) -> None:
            nonlocal count
            count += 1
            connection.send(data)
            connection.send(json.dumps({"type": f"canary{count}."}))
            deadline = time.monotonic() + 60
            while f"canary{count}." not in (received := str(connection.recv(timeout=60))):
                assert time.monotonic() < deadline, "the server sends other messages, but no answer"
                # once a page has answered a beat, it receives nothing more until it answers the next ones
                if received == '{"type":"beat"}':
                    connection.send('{"type":"heard"}')

        yield send_one


def tracebacks(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return what was logged as an internal error or with a traceback."""
    return [
        f"{record.getMessage()}: {record.exc_info}"
        for record in caplog.records
        if record.exc_info or "internal error" in record.getMessage()
    ]


@pytest.mark.filterwarnings("ignore:The recursion limit")  # reading a description raises it
@pytest.mark.parametrize("served", ["view", "sim"], indirect=True)
def test_any_message_is_answered_and_the_server_continues(
    send: Callable[[str | bytes], None], caplog: pytest.LogCaptureFixture
) -> None:
    @SAME_EACH_TIME
    @given(messages())
    def check(text: str) -> None:
        send(text)
        assert not tracebacks(caplog)

    check()


def test_anything_else_is_answered_and_logged(
    send: Callable[[str | bytes], None], caplog: pytest.LogCaptureFixture
) -> None:
    @SAME_EACH_TIME
    @given(ANYTHING.map(json.dumps) | st.binary(max_size=200) | st.text(max_size=200))
    def check(data: str | bytes) -> None:
        send(data)
        assert not tracebacks(caplog)

    check()
    assert any("message" in record.getMessage() for record in caplog.records)


@pytest.mark.parametrize(
    "frame", [b"\x81\x82\x00\x00\x00\x00\xff\xfe", b"\xff" * 40, b"\x81\xff" + b"\x7f" * 8 + b"\x00" * 4]
)
def test_a_broken_frame_ends_only_its_connection(
    served: tuple[str, Session], frame: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    address = served[0].replace("http:", "ws:") + "ws"
    with connect(address) as other, connect(address) as connection:
        connection.socket.sendall(frame)  # neither masked UTF-8 text nor an accepted length
        with pytest.raises(ConnectionClosed):
            drain(connection)
        other.send('{"type": "canary"}')
        while "canary" not in str(other.recv(timeout=60)):
            pass
    assert not tracebacks(caplog)


def drain(connection: ClientConnection) -> None:
    while True:
        connection.recv(timeout=60)


PIECES = ["..", ".", "", "%2e%2e", "%2E%2e%2f", "%252e%252e", "..%5c", "..\\", "%00", "%c0%ae%c0%ae", "~"]
PIECES += ["mesh", "assets", "export", "ws", "index.html", "etc", "passwd", "robot.glb", "urdf", "kbot.xacro"]
PIECES += ["%zz", "%", "?", "#", ";", "\xff", "[", "//", "http:", "a" * 3000]
PATHS = st.lists(
    st.sampled_from(PIECES) | st.text(st.characters(min_codepoint=33, max_codepoint=255), max_size=8)
)
ORIGINS = st.sampled_from(
    [
        "",
        "null",
        "http://evil.example",
        "http://[",
        "https://127.0.0.1",
        "\xff\xfe",
        "http://127.0.0.1:1@evil",
    ]
)


def test_no_path_leads_outside(served: tuple[str, Session], caplog: pytest.LogCaptureFixture) -> None:
    @SAME_EACH_TIME
    @given(PATHS.map("/".join))
    def check(path: str) -> None:
        status, body = ask(served[0], f"/{path}")
        assert status in (200, 400, 404, 414, 426), status
        if status == 200:
            assert body.startswith((b"<!doctype html>", b"glTF")) or b"<script" in body, path
        assert b"root:" not in body
        assert b"<xacro:" not in body
        assert b"Traceback" not in body
        assert not tracebacks(caplog)

    check()
    assert ask(served[0], "/")[0] == 200


@pytest.mark.parametrize("header", ["Host", "Origin"])
def test_foreign_headers_are_refused(
    served: tuple[str, Session], caplog: pytest.LogCaptureFixture, header: str
) -> None:
    @SAME_EACH_TIME
    @given(ORIGINS | st.text(st.characters(min_codepoint=33, max_codepoint=255), max_size=60))
    def check(value: str) -> None:
        status, _ = ask(served[0], "/", (header, value))
        assert status in (400, 403)
        assert not tracebacks(caplog)

    check()
    assert any(record.getMessage().startswith("refused /") for record in caplog.records)
    assert ask(served[0], "/")[0] == 200


def ask(address: str, path: str, *headers: tuple[str, str]) -> tuple[int, bytes]:
    """Return status and body of the answer to a raw request line; 400 if the connection is closed."""
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.netloc, timeout=60)
    try:
        sent = [("Host", parts.netloc)] if not any(name == "Host" for name, _ in headers) else []
        lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in (*sent, *headers))]
        connection.connect()
        connection.sock.sendall("\r\n".join((*lines, "", "")).encode("latin-1"))
        answer = http.client.HTTPResponse(connection.sock)
        answer.begin()
        return answer.status, answer.read()
    except (http.client.HTTPException, ConnectionError):
        return 400, b""
    finally:
        connection.close()
