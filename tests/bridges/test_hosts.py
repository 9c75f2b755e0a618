"""Which host names and addresses belong to this machine."""

import socket

import pytest

from kbot.net import hosts
from kbot.net.hosts import (
    accepts_host,
    host_and_port,
    host_and_port_of_uri,
    is_loopback,
    is_served_at,
    is_this_machine,
    only_host,
)
from kbot.ros.bridges.ros1.allowed_nodes import AllowedNodes


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("localhost", ("localhost", None)),
        ("Robot.Example:11311", ("robot.example", 11311)),
        ("127.0.0.1:80", ("127.0.0.1", 80)),
        ("[::1]:80", ("::1", 80)),
        ("[::1]", ("::1", None)),
        ("", (None, None)),
        ("::1", (None, None)),
        ("[::1", (None, None)),
        ("127.0.0.1:", (None, None)),
        ("127.0.0.1:123456", (None, None)),
        ("me@127.0.0.1", (None, None)),
        ("127.0.0.1@evil.example", (None, None)),
        ("127.0.0.1 evil.example", (None, None)),
        ("127.0.0.1\n", (None, None)),
        ("127.0.0.1/", (None, None)),
    ],
)
def test_host_and_port(text: str, parts: tuple[str | None, int | None]) -> None:
    assert host_and_port(text) == parts


def test_host_and_port_of_uri() -> None:
    assert host_and_port_of_uri("http://Robot:4711/RPC2?a#b") == ("robot", 4711)
    assert host_and_port_of_uri("http://[::1]:4711") == ("::1", 4711)
    for uri in (
        "",
        "robot:4711",
        "http:///path",
        "http://a@robot/",
        "http://127.0.0.1\\@evil/",
        "http://[::1",
    ):
        assert host_and_port_of_uri(uri) == (None, None)


def own_address() -> str:
    """An address of this machine: its source address. Connecting a UDP socket sends nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return "127.0.0.2"  # the machine has no network
        return str(probe.getsockname()[0])


def test_names_and_addresses_of_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def resolved(name: str, *_: object, **__: object) -> list[tuple[int, int, int, str, tuple[str, int]]]:
        asked.append(name)
        return [(2, 1, 6, "Robot.example.org", ("127.0.1.1", 0))]

    address = own_address()
    monkeypatch.setattr(socket, "gethostname", lambda: "Robot")
    monkeypatch.setattr(socket, "getaddrinfo", resolved)
    monkeypatch.setattr(hosts, "_full_name", hosts._full_name.__wrapped__)
    names = ("localhost", "Localhost", "Robot", "robot", "robot.local", "Robot.Local", "Robot.example.org")
    for host in ("127.0.0.1", "127.1.2.3", "::1", address, *names):
        assert is_this_machine(host), host
        assert is_served_at(host, "127.0.0.1"), host
        assert not AllowedNodes("127.0.0.1", asked.append).refusal(host), host
    for other in (None, "", "0.0.0.0", "::", "224.0.0.1", "192.0.2.7", "2001:db8::7", "127.1", "0x7f000001"):
        assert not is_this_machine(other), other
    for other in ("robot.evil.example", "robot.local.evil.example", "other.local", "local"):
        assert not is_this_machine(other), other
    asked.clear()
    assert not is_this_machine("evil.example")
    # a foreign name is not resolved: its owner decides on the address, and it can take seconds
    assert asked == []


def test_the_served_name_is_case_insensitive() -> None:
    assert is_served_at("Ros.Lan", "ros.lan")
    assert is_served_at("ros.lan", "Ros.Lan")
    assert is_loopback("Localhost")


def test_a_request_needs_exactly_one_host_of_this_machine() -> None:
    assert accepts_host(only_host(["127.0.0.1:1"]), "127.0.0.1")
    assert accepts_host(only_host(["robot.lan:1"]), "Robot.lan")  # the name that the server was started with
    for headers in ([], ["evil.example"], ["127.0.0.1", "127.0.0.1"], [""], ["127.0.0.1.evil.example:1"]):
        assert not accepts_host(only_host(headers), "127.0.0.1")
