"""Which clients the server accepts."""

import socket

import pytest

from kbot.net.hosts import is_loopback
from kbot.workbench.serving.access import Access, bracketed, security_headers

LOCAL = Access("127.0.0.1", 8300, None)
SHARED = Access("0.0.0.0", 8300, "secret")


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8300", "localhost:8300", "[::1]:8300", f"{socket.gethostname()}:8300"]
)
def test_names_of_this_machine_are_accepted(host: str) -> None:
    assert LOCAL.refuses("/", host, (), secret=False) is None
    assert LOCAL.refuses("/ws", host, [f"http://{host}"], secret=True) is None


def test_the_default_http_port_can_be_omitted() -> None:
    assert Access("127.0.0.1", 80, None).refuses("/", "localhost", (), secret=False) is None
    assert Access("127.0.0.1", 80, None).refuses("/", "localhost:8300", (), secret=False) is not None


@pytest.mark.parametrize(
    "host",
    [None, "", "evil.example", "evil.example:8300", "127.0.0.1", "127.0.0.1:80", "a@127.0.0.1:8300", "[::1"],
)
def test_a_foreign_host_is_refused(host: str | None) -> None:
    assert LOCAL.refuses("/", host, (), secret=False) is not None


@pytest.mark.parametrize(
    "origin", ["null", "http://evil.example", "https://127.0.0.1:8300", "http://127.0.0.1:1"]
)
def test_a_foreign_origin_is_refused(origin: str) -> None:
    assert LOCAL.refuses("/ws", "127.0.0.1:8300", [origin], secret=True) is not None
    assert SHARED.refuses("/ws?token=secret", "10.0.0.2:8300", [origin], secret=True) is not None


def test_every_origin_is_checked() -> None:
    own, foreign = "http://127.0.0.1:8300", "http://evil.example"
    for origins in ([own, foreign], [foreign, own]):
        assert LOCAL.refuses("/ws", "127.0.0.1:8300", origins, secret=True) is not None


def test_other_machines_need_the_token() -> None:
    assert SHARED.refuses("/ws?token=secret", "10.0.0.2:8300", ["http://10.0.0.2:8300"], secret=True) is None
    for path in ("/ws", "/ws?token=", "/ws?token=Secret", "/ws?x=secret"):
        assert SHARED.refuses(path, "10.0.0.2:8300", (), secret=True) is not None
    assert SHARED.refuses("/", "10.0.0.2:8300", (), secret=False) is None


def test_loopback_addresses_are_recognized() -> None:
    assert is_loopback("127.0.0.1")
    assert is_loopback("127.9.9.9")
    assert is_loopback("::1")
    assert is_loopback("localhost")
    assert not is_loopback("0.0.0.0")
    assert not is_loopback("192.168.1.4")
    assert bracketed("::1") == "[::1]"


def test_the_page_loads_only_from_its_own_server() -> None:
    policy = security_headers("127.0.0.1:8300")["Content-Security-Policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["script-src"] == "'self'"
    assert rules["connect-src"] == "'self' ws://127.0.0.1:8300"
    assert "unsafe" not in policy
    assert "*" not in policy
