"""Which requests KBot's ROS 1 master and node accept, and which nodes they contact."""

import http.client
import socket
import threading
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import pytest

from kbot.messages.types import Twist
from kbot.ros.bridges.link import PeerLink, Topic
from kbot.ros.bridges.ros1 import subscriber
from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes
from kbot.ros.bridges.ros1.bridge import Ros1Bridge
from kbot.ros.bridges.ros1.master import Master
from kbot.ros.bridges.ros1.rpc import DEEPEST, LARGEST_BODY, RpcFailed, RpcServer, call, read_answer
from kbot.ros.bridges.ros1.subscriber import SubscribedTopic

from .conftest import Running, wait_until

ME = "/tester"
ELSEWHERE = "192.0.2.7"
"""An address that is reserved for documentation, so no machine has it."""
SET = xmlrpc.client.dumps(("/page", "/robot_description", "<stolen/>"), "setParam").encode()
GOOD = {"Host": "127.0.0.1:1", "Content-Type": "text/xml", "Content-Length": str(len(SET))}


@pytest.fixture
def notes() -> list[str]:
    """Messages for the user."""
    return []


@pytest.fixture
def master(notes: list[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Master]:
    """A master with a description to protect."""
    monkeypatch.setattr("kbot.ros.bridges.ros1.rpc.POLL_SECONDS", 0.01)  # so that `close` is fast
    master = Master("127.0.0.1", 0, AllowedNodes("127.0.0.1", notes.append))
    call(master.uri, "setParam", ME, "/robot_description", "<robot/>")
    try:
        yield master
    finally:
        master.close()


def port_of(uri: str) -> int:
    return int(uri.rstrip("/").rpartition(":")[2])


def request(
    port: int,
    headers: list[tuple[str, str]],
    body: bytes = SET,
    method: str = "POST",
    path: str = "/RPC2",
) -> tuple[int, str, str]:
    """Status, headers and body of the answer to a request with exactly these headers."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
    for name, value in headers:
        connection.putheader(name, value)
    connection.endheaders(body)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, str(answer.headers), text


def changed(**headers: str | None) -> list[tuple[str, str]]:
    """The headers of a good request with some changed (`content_type`), or without them (None)."""
    given = {name.replace("_", "-").title(): value for name, value in headers.items()}
    return [(name, value) for name, value in {**GOOD, **given}.items() if value is not None]


REFUSED = {
    "a form of a web page": (changed(content_type="text/plain", origin="http://127.0.0.1:1"), 403),
    "a page with DNS rebinding": (changed(host="evil.example:1", origin="http://evil.example:1"), 403),
    "a page with an opaque origin": (changed(origin="null"), 403),
    "an empty origin": (changed(origin=""), 403),
    "a page of this machine": (changed(origin="http://127.0.0.1:1"), 403),
    "a foreign host": (changed(host="evil.example"), 403),
    "a foreign address": (changed(host=ELSEWHERE), 403),
    "the unspecified address": (changed(host="0.0.0.0:1"), 403),
    "a host that begins like loopback": (changed(host="127.0.0.1.evil.example:1"), 403),
    "a host with a user": (changed(host="evil.example@127.0.0.1"), 403),
    "no host": (changed(host=None), 403),
    "two hosts": ([*changed(), ("Host", "evil.example")], 403),
    "plain text": (changed(content_type="text/plain"), 415),
    "a form": (changed(content_type="application/x-www-form-urlencoded"), 415),
    "a form with a file": (changed(content_type="multipart/form-data; boundary=text/xml"), 415),
    "no content type": (changed(content_type=None), 415),
    "a list of content types": (changed(content_type="text/plain, text/xml"), 415),
    "no length": (changed(content_length=None), 411),
    "a negative length": (changed(content_length="-5"), 411),
    "a huge length": (changed(content_length="99999999999"), 413),
    "a length that Python cannot read": (changed(content_length="9" * 5000), 413),
    "one byte too many": (changed(content_length=str(LARGEST_BODY + 1)), 413),
    "chunks": (changed(transfer_encoding="chunked"), 411),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_foreign_request_is_refused_and_has_no_effect(master: Master, name: str) -> None:
    headers, status = REFUSED[name]
    answered, answer_headers, text = request(port_of(master.uri), headers)
    assert (answered, text[:4]) == (status, f"{status}:")
    assert "Access-Control" not in answer_headers
    assert call(master.uri, "getParam", ME, "/robot_description") == "<robot/>"


@pytest.mark.parametrize("method", ["GET", "HEAD", "OPTIONS", "PUT", "DELETE", "BREW"])
def test_only_post_is_answered(master: Master, method: str) -> None:
    preflight = [
        ("Access-Control-Request-Method", "POST"),
        ("Access-Control-Request-Headers", "content-type"),
    ]
    status, headers, _ = request(
        port_of(master.uri), [*changed(origin="http://evil.example"), *preflight], method=method
    )
    assert status == 501
    assert "Access-Control" not in headers
    assert call(master.uri, "getParam", ME, "/robot_description") == "<robot/>"


def test_other_paths_are_refused(master: Master) -> None:
    assert request(port_of(master.uri), changed(), path="/other")[0] == 404
    assert call(master.uri, "getParam", ME, "/robot_description") == "<robot/>"


DEEP = DEEPEST // 3 + 1
BODIES = {
    "empty": b"",
    "not XML": b"\x00\xff garbage",
    "half a call": SET[:-20],
    "entities": b'<!DOCTYPE a [<!ENTITY b "c">]>' + SET.partition(b"?>")[2],
    "deeper than a parameter tree": SET.replace(
        b"<string>&lt;stolen/&gt;</string>",
        b"<array><data><value>" * DEEP + b"1" + b"</value></data></array>" * DEEP,
    ),
    "an unknown encoding": b'<?xml version="1.0" encoding="none"?>' + SET.partition(b"?>")[2],
    "bytes as text": b'<?xml version="1.0" encoding="rot13"?>' + SET.partition(b"?>")[2],
}


@pytest.mark.parametrize("name", BODIES)
def test_a_body_that_is_not_a_call_is_refused(master: Master, name: str) -> None:
    body = BODIES[name]
    status, _, text = request(port_of(master.uri), changed(content_length=str(len(body))), body)
    assert (status, text[:4]) == (400, "400:")
    assert call(master.uri, "getParam", ME, "/robot_description") == "<robot/>"


def test_a_client_with_a_large_body_receives_the_refusal(master: Master) -> None:
    body = b" " * (4 << 20) + SET
    headers = changed(content_type="text/plain", content_length=str(len(body)))
    assert request(port_of(master.uri), headers, body)[0] == 415


@pytest.mark.parametrize("kind", ["text/xml", "Text/XML", "text/xml; charset=utf-8", "application/xml"])
@pytest.mark.parametrize("path", ["/", "/RPC2"])
def test_xml_is_accepted(master: Master, kind: str, path: str) -> None:
    assert request(port_of(master.uri), changed(content_type=kind), path=path)[0] == 200
    assert call(master.uri, "getParam", ME, "/robot_description") == "<stolen/>"


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST:9", "127.0.0.1", "[::1]:11311", socket.gethostname()]
)
def test_the_host_headers_of_ros_clients_are_accepted(master: Master, host: str) -> None:
    assert request(port_of(master.uri), changed(host=host))[0] == 200


# nodes that may register

REGISTRATIONS: dict[str, tuple[Any, ...]] = {
    "registerPublisher": ("/cmd_vel", "geometry_msgs/Twist"),
    "registerSubscriber": ("/odom", "nav_msgs/Odometry"),
    "registerService": ("/s", f"rosrpc://{ELSEWHERE}:2"),
    "subscribeParam": (),
}


def register(uri: str, method: str, node: str) -> object:
    if method == "subscribeParam":
        return call(uri, method, "/other", node, "/")
    named = REGISTRATIONS[method]
    return call(uri, method, "/other", *named, node)


@pytest.mark.parametrize("method", REGISTRATIONS)
@pytest.mark.parametrize(
    "node", [f"http://{ELSEWHERE}:1/", "http://evil.example:1/", "http://a@127.0.0.1:1/", ""]
)
def test_a_node_on_another_machine_cannot_register(
    master: Master, notes: list[str], method: str, node: str
) -> None:
    for _ in range(2):
        with pytest.raises(RpcFailed, match="--bridge-host"):
            register(master.uri, method, node)
    assert call(master.uri, "getSystemState", ME) == [[], [], []]
    with pytest.raises(RpcFailed):
        call(master.uri, "lookupNode", ME, "/other")
    assert set(notes) == {notes[0]}
    assert "\n" not in notes[0]
    assert "--bridge-host" in notes[0]


@pytest.mark.parametrize("method", REGISTRATIONS)
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", socket.gethostname()])
def test_a_node_on_this_machine_can_register(
    master: Master, notes: list[str], method: str, host: str
) -> None:
    register(master.uri, method, f"http://{host}:1/")
    assert call(master.uri, "lookupNode", ME, "/other") == f"http://{host}:1/"
    assert notes == []


def test_a_node_on_another_machine_can_register_with_bridge_host(notes: list[str]) -> None:
    master = Master("127.0.0.1", 0, AllowedNodes("127.0.0.1", notes.append, other_machines=True))
    try:
        register(master.uri, "registerPublisher", f"http://{ELSEWHERE}:1/")
        assert call(master.uri, "getSystemState", ME)[0] == [["/cmd_vel", ["/other"]]]
    finally:
        master.close()
    assert notes == []


def test_a_publisher_on_another_machine_is_not_contacted(monkeypatch: pytest.MonkeyPatch) -> None:
    notes, contacted = list[str](), list[str]()

    def contact(uri: str, *_: object) -> object:
        contacted.append(uri)
        raise RpcFailed("no answer")

    monkeypatch.setattr(subscriber, "call", contact)
    link = PeerLink(notes.append)
    topic = Topic("/cmd_vel", Twist, is_input=True, is_latched=False)
    incoming = SubscribedTopic(link, topic, "/kbot", AllowedNodes("127.0.0.1", link.report))
    foreign = [f"http://{ELSEWHERE}:{port}/" for port in range(subscriber.MOST_PUBLISHERS)]
    own = "http://127.0.0.1:1/"
    incoming.update([*foreign, own])
    wait_until(lambda: contacted)
    assert incoming.peers == [own]  # refused publishers do not count for the limit
    incoming.close()
    assert set(contacted) == {own}
    assert [text.count("--bridge-host") for text in notes] == [1]


def test_a_publisher_cannot_redirect_kbot_to_another_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not only the node's address is checked, but also the address that it returns for a topic."""
    notes, connections = list[str](), list[str]()
    connect = socket.create_connection

    def recorded(address: tuple[str, int], *rest: float) -> socket.socket:
        connections.append(address[0])
        return connect(address, *rest)

    link = PeerLink(notes.append)
    topic = Topic("/cmd_vel", Twist, is_input=True, is_latched=False)
    incoming = SubscribedTopic(link, topic, "/kbot", AllowedNodes("127.0.0.1", link.report))
    node = RpcServer("127.0.0.1", 0, {"requestTopic": lambda *_: (1, "", ["TCPROS", ELSEWHERE, 22])})
    monkeypatch.setattr(socket, "create_connection", recorded)
    try:
        incoming.update([f"http://127.0.0.1:{node.port}/"])
        wait_until(lambda: any("--bridge-host" in text for text in notes))
    finally:
        incoming.close()
        node.close()
    assert set(connections) == {"127.0.0.1"}


def test_a_foreign_publisher_of_the_master_is_not_contacted(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ROS_IP does not replace --bridge-host."""
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    open_master = Master("127.0.0.1", 0, AllowedNodes("127.0.0.1", print, other_machines=True))
    register(open_master.uri, "registerPublisher", f"http://{ELSEWHERE}:1/")
    contacted = []
    monkeypatch.setattr(subscriber, "call", lambda uri, *_: contacted.append(uri))
    bridge = Ros1Bridge(running.link, master=open_master.uri)
    try:
        wait_until(lambda: any("--bridge-host" in text for text in running.reported))
        # the node's API refuses updates from web pages, too
        body = xmlrpc.client.dumps(("/m", "/cmd_vel", ["http://127.0.0.1:1/"]), "publisherUpdate").encode()
        headers = changed(host="evil.example", origin="http://evil.example", content_length=str(len(body)))
        assert request(port_of(bridge.uri), headers, body)[0] == 403
    finally:
        bridge.close()
        open_master.close()
    assert contacted == []


def test_a_web_page_cannot_use_tcpros(running: Running) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    bridge = Ros1Bridge(running.link, master=f"http://127.0.0.1:{port}/")
    try:
        wait_until(lambda: "/odom" in dict(call(bridge.master, "getPublishedTopics", ME, "")))
        _, host, door = call(bridge.uri, "requestTopic", ME, "/odom", [["TCPROS"]])
        with socket.create_connection((host, door), 60) as connection:
            connection.sendall(b"POST / HTTP/1.1\r\nHost: evil.example\r\nContent-Length: 4\r\n\r\nabcd")
            assert b"error=" in connection.recv(1000)
    finally:
        bridge.close()


# answers of other nodes


@contextmanager
def answering(answer: bytes) -> Iterator[str]:
    """The URI of a node that answers its first call with these bytes."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection, suppress(OSError):  # the caller may leave before the end
                request = b""
                while b"</methodCall>" not in request:
                    request += connection.recv(1 << 16)
                connection.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}/"
        thread.join()


ODD = {
    "nothing": b"",
    "garbage": b"garbage",
    "a struct with a name alone": b"<struct><member><name>a</name></member></struct>",
    "an end without a value": b"<nil/>",
    "an invalid number": b"<int>x</int>",
    "a number of 5000 digits": b"<int>" + b"9" * 5000 + b"</int>",
    "an invalid decimal": b"<bigdecimal>x</bigdecimal>",
    "an invalid fault": b"</value></param></params><fault>1</fault><params><param><value>1",
    "invalid base64": b"<base64>\xc3\xa4</base64>",
    "an unknown type": b"<robot/>",
    "too deep": b"<array><data><value>" * DEEP + b"1" + b"</value></data></array>" * DEEP,
}


@pytest.mark.parametrize("name", ODD)
def test_an_answer_that_is_not_xml_rpc_is_a_failed_call(name: str) -> None:
    value = (
        b"<methodResponse><params><param><value>" + ODD[name] + b"</value></param></params></methodResponse>"
    )
    body = ODD[name] if name in ("nothing", "garbage") else value
    head = b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n"
    with answering(head + body) as uri, pytest.raises(RpcFailed):
        call(uri, "getPid", ME)


def test_an_answer_that_is_too_large_is_a_failed_call() -> None:
    body = b"\r\n\r\n" + b" " * (LARGEST_BODY + 1)
    for status, reason in ((b"200 OK", "more than"), (b"404 Not Found", "404")):
        with answering(b"HTTP/1.0 " + status + body) as uri, pytest.raises(RpcFailed, match=reason):
            call(uri, "getPid", ME)


def test_read_answer_raises_faults() -> None:
    body = xmlrpc.client.dumps(xmlrpc.client.Fault(1, "no"), methodresponse=True).encode()
    with pytest.raises(xmlrpc.client.Fault, match="no"):
        read_answer(body)
