"""Log messages of the `websockets` library are one line, without tracebacks."""

import logging
from pathlib import Path

import pytest
from websockets.exceptions import InvalidMessage, InvalidStatus
from websockets.sync.client import connect

from kbot.net.socket_log import socket_logger
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge
from kbot.text.complaints import Complaints


@pytest.fixture(autouse=True)
def crash_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("kbot.text.crash.state_folder", lambda: tmp_path)
    return tmp_path / "crashes"


def test_only_errors_of_kbot_write_a_crash_file(caplog: pytest.LogCaptureFixture, crash_folder: Path) -> None:
    logger = socket_logger(Complaints(logging.getLogger("complaints")))
    for text, error in (
        ("opening handshake failed", InvalidMessage("a bad request")),
        ("opening handshake failed", ConnectionResetError("reset")),
        ("keepalive ping failed", ConnectionResetError("reset")),
        ("connection handler failed", InvalidMessage("a bad message")),
        ("opening handshake failed", ZeroDivisionError("a bug")),
    ):
        try:
            raise error
        except Exception:
            logger.error(text, exc_info=True)
    reset, bad, fault = caplog.messages
    assert (reset, bad) == ("keepalive ping failed", "connection handler failed")
    assert fault.startswith("a connection failed: internal error (ZeroDivisionError)")
    (file,) = crash_folder.iterdir()
    assert "ZeroDivisionError: a bug" in file.read_text()


def test_an_error_in_a_handshake_writes_a_crash_file(
    caplog: pytest.LogCaptureFixture, crash_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> bool:
        raise ZeroDivisionError("a bug")

    complaints = Complaints(logging.getLogger("complaints"))
    monkeypatch.setattr("kbot.ros.bridges.websocket.server.FAULTS", complaints)
    monkeypatch.setattr("kbot.ros.bridges.websocket.server.accepts_host", broken)
    bridge = RosbridgeBridge(PeerLink(print), port=0)
    try:
        with pytest.raises(InvalidStatus) as caught:
            connect(bridge.address)
    finally:
        bridge.close()
    assert caught.value.response.status_code == 500
    assert caplog.messages[0].startswith("a connection failed: internal error (ZeroDivisionError)")
    (file,) = crash_folder.iterdir()
    assert "ZeroDivisionError: a bug" in file.read_text()
