import threading
import urllib.request

import pytest

from kbot.text import KbotError
from kbot.workbench import address
from kbot.workbench.address import FIRST_PORT, bound

HERE = "127.0.0.1"


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The addresses that browsers were opened with."""
    urls: list[str] = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(address, "_open", urls.append)
    return urls


def test_a_port_in_use_is_an_error_and_opens_no_browser(opened: list[str]) -> None:
    with bound(HERE, 0) as first:
        port = first.access.port
        with pytest.raises(KbotError, match=f"port {port} is in use"), bound(HERE, port, open_browser=True):
            pass
    assert opened == []


def test_without_a_port_the_next_free_port_is_used() -> None:
    with bound(HERE, None) as first, bound(HERE, None) as second:
        ports = first.access.port, second.access.port
    assert FIRST_PORT <= ports[0] < ports[1]


@pytest.mark.parametrize(
    ("host", "expected"), [("192.0.2.1", r"192\.0\.2\.1"), ("no.such.host.invalid", "unknown address")]
)
def test_an_address_of_another_machine_is_refused(host: str, expected: str) -> None:
    with pytest.raises(KbotError, match=expected), bound(host, 0):
        pass


@pytest.mark.parametrize("host", [HERE, "0.0.0.0"])
def test_a_browser_is_opened_at_the_address_with_its_token(opened: list[str], host: str) -> None:
    with bound(host, 0, open_browser=True) as where:
        for thread in set(threading.enumerate()) - {threading.current_thread()}:
            thread.join(1.0)
    assert opened == [where.url]
    assert ("?token=" in where.url) == (host != HERE)


def test_a_client_that_connects_before_serving_waits() -> None:
    answers: list[bytes] = []
    with bound(HERE, 0) as where:
        asking = threading.Thread(target=lambda: answers.append(urllib.request.urlopen(where.url).read()))
        asking.start()
        connection, _ = where.listening.accept()
        with connection:
            connection.recv(1 << 16)
            connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\nConnection: close\r\n\r\nhi")
        asking.join()
    assert answers == [b"hi"]
