"""What web pages in a real browser can do with the bridges: foreign origins, and DNS rebinding."""

import http.server
import threading
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from kbot.ros.bridges.foxglove.bridge import FoxgloveBridge
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.ros1.bridge import Ros1Bridge
from kbot.ros.bridges.ros1.rpc import call
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge

from .conftest import wait_until

ME = "/tester"
FOREIGN_HOST = "evil.example"
DESCRIPTION = "<robot name='secret'/>"


class _Blank(http.server.BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!DOCTYPE html><title>foreign</title>")

    def log_message(self, format: str, *args: object) -> None:
        """Do not log requests."""


@contextmanager
def served() -> Iterator[int]:
    """The port of a server with a blank page."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), _Blank)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield server.server_port
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    found = browser.new_page()
    yield found
    found.close()


@contextmanager
def node(port: int, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ros1Bridge]:
    """A node with its own master at a port, and a description to protect."""
    for name in ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME"):
        monkeypatch.delenv(name, raising=False)
    link = PeerLink(print)
    link.parameters = {"/robot_description": DESCRIPTION}
    bridge = Ros1Bridge(link, master=f"http://127.0.0.1:{port}/")
    try:
        wait_until(lambda: call(bridge.master, "hasParam", ME, "/robot_description"))
        yield bridge
    finally:
        bridge.close()


def port_of(uri: str) -> int:
    return int(uri.rstrip("/").rpartition(":")[2])


FETCH = """async ([url, mode, type, body]) => {
  try {
    const options = { method: "POST", mode, headers: { "Content-Type": type }, body };
    const answer = await fetch(url, options);
    return { status: answer.status, text: await answer.text() };
  } catch (error) {
    return { status: -1, text: String(error) };
  }
}"""
"""Send a request; the status is 0 if the answer may not be read, and -1 if there is none."""
SET = xmlrpc.client.dumps(("/page", "/robot_description", "<stolen/>"), "setParam")
GET = xmlrpc.client.dumps(("/page", "/robot_description"), "getParam")
REGISTER = xmlrpc.client.dumps(
    ("/page", "/cmd_vel", "geometry_msgs/Twist", "http://192.0.2.7:1/"), "registerPublisher"
)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", FOREIGN_HOST])
def test_a_page_of_another_port_has_no_effect(page: Any, host: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with served() as port:
        free = port
    with served() as port, node(free, monkeypatch) as bridge:
        page.goto(f"http://127.0.0.1:{port}/")
        for uri in (bridge.master, bridge.uri):
            url = f"http://{host}:{port_of(uri)}/RPC2"
            for body in (SET, REGISTER, GET):
                answer = page.evaluate(FETCH, [url, "no-cors", "text/plain", body])
                assert answer == {
                    "status": 0,
                    "text": "",
                }  # the request was sent, but the page cannot read the answer
                # XML needs a preflight, which is refused
                assert page.evaluate(FETCH, [url, "cors", "text/xml", body])["status"] == -1
        assert_unchanged(bridge)


def test_a_page_with_dns_rebinding_has_no_effect(page: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A foreign page is loaded from a port that KBot serves later. To the browser, both are one site."""
    with served() as port:
        page.goto(f"http://{FOREIGN_HOST}:{port}/")
    with node(port, monkeypatch) as bridge:
        for kind in ("text/plain", "text/xml", "application/xml"):
            for body in (SET, REGISTER, GET):
                answer = page.evaluate(FETCH, ["/RPC2", "same-origin", kind, body])
                assert answer["status"] == 403
                assert "secret" not in answer["text"]
        assert page.evaluate("fetch('/RPC2').then((answer) => answer.status)") == 501
        assert_unchanged(bridge)


def assert_unchanged(bridge: Ros1Bridge) -> None:
    assert call(bridge.master, "getParam", ME, "/robot_description") == DESCRIPTION
    assert call(bridge.master, "getSystemState", ME)[0] == []


OPEN = """([url, protocols]) => new Promise((done) => {
  const socket = new WebSocket(url, protocols);
  socket.onopen = () => done("open");
  socket.onerror = () => done("refused");
})"""


@pytest.mark.parametrize("kind", [FoxgloveBridge, RosbridgeBridge])
def test_a_foreign_page_cannot_open_a_websocket(page: Any, kind: type) -> None:
    server = kind(PeerLink(print), port=0)
    protocols = ["foxglove.sdk.v1"] if kind is FoxgloveBridge else []

    def opened(host: str) -> str:
        return str(page.evaluate(OPEN, [f"ws://{host}:{port_of(server.address)}", protocols]))

    try:
        with served() as port:
            page.goto(f"http://127.0.0.1:{port}/")  # a tool that is served on this machine may connect
            assert (opened("127.0.0.1"), opened(FOREIGN_HOST)) == ("open", "refused")
            page.goto(f"http://{FOREIGN_HOST}:{port}/")
            assert (opened("127.0.0.1"), opened(FOREIGN_HOST)) == ("refused", "refused")
    finally:
        server.close()
