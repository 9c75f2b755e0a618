"""An internal error of KBot ends neither the server nor its recording."""

import logging
import time
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from kbot.workbench.session.session import Session

from .conftest import until
from .test_server import get, receive, send, socket_address

FAILED = "KBot could not process this: ZeroDivisionError: a bug; please report it"


def broken(*_: Any) -> Any:
    raise ZeroDivisionError("a bug")


def refusal(connection: Any, text: str) -> str:
    """The next reason of a refusal that contains this text."""
    end = time.monotonic() + 60
    while text not in (reason := str(receive(connection, "refused")["reason"])):
        assert time.monotonic() < end, f"no refusal with {text!r} within 60 s"
    return reason


def test_a_failing_message_is_answered(driving: tuple[str, Session], monkeypatch: Any) -> None:
    address, session = driving
    with connect(socket_address(address)) as page:
        monkeypatch.setattr(session, "handle", broken)
        send(page, type="reset")
        assert refusal(page, "could not process") == FAILED
        monkeypatch.undo()
        send(page, type="set_speed", factor=2.0)
        until(lambda: session.speed == 2.0)


def test_a_failing_run_is_paused(driving: tuple[str, Session], monkeypatch: Any) -> None:
    address, session = driving
    with connect(socket_address(address)) as page:
        monkeypatch.setattr(session._motion, "advance", broken)
        assert refusal(page, "could not process") == FAILED
        until(lambda: session.paused)
        monkeypatch.undo()
        before = session._motion.clock.nanoseconds
        send(page, type="pause", paused=False)
        until(lambda: session._motion.clock.nanoseconds > before)


def test_a_failing_reading_keeps_the_robot(
    driving: tuple[str, Session], xacro: Path, monkeypatch: Any
) -> None:
    address, session = driving
    with connect(socket_address(address)) as page:
        receive(page, "state")
        monkeypatch.setattr(session, "read", broken)
        xacro.write_text(xacro.read_text() + "<!-- changed -->\n")
        assert refusal(page, "could not process") == FAILED
    assert get(address, "/")[0] == 200


def test_files_are_still_watched_after_an_error(
    driving: tuple[str, Session], xacro: Path, monkeypatch: Any, caplog: pytest.LogCaptureFixture
) -> None:
    address, _ = driving
    with connect(socket_address(address)) as page, caplog.at_level(logging.ERROR):
        receive(page, "state")
        monkeypatch.setattr("kbot.workbench.serving.file_watcher._signature", broken)
        until(lambda: "watching the files failed" in caplog.text)
        assert "internal error (ZeroDivisionError)" in caplog.text
        monkeypatch.undo()
        xacro.write_text(xacro.read_text().replace('"base_len" default="0.16"', '"base_len" default="0.2"'))
        until(lambda: "'value': 0.2" in str(receive(page, "parameters")))


def test_a_failing_plot_is_answered(driving: tuple[str, Session], monkeypatch: Any) -> None:
    address, _ = driving
    with connect(socket_address(address)) as page:
        monkeypatch.setattr("kbot.workbench.serving.past.Past.series", broken)
        send(page, type="ask_series", number=1, fields=["state twist.0"], start=0.0, end=1.0)
        assert refusal(page, "could not process") == FAILED
        monkeypatch.undo()
        send(page, type="ask_series", number=2, fields=["state twist.0"], start=0.0, end=1.0)
        assert receive(page, "series")["number"] == 2


@pytest.mark.parametrize(
    ("path", "part"),
    [("/export/robot.glb", "kbot.workbench.serving.page_files.glb"), ("/mesh/1", "MeshStore.packed")],
)
def test_a_failing_request_is_answered(
    driving: tuple[str, Session], path: str, part: str, monkeypatch: Any, caplog: pytest.LogCaptureFixture
) -> None:
    address, _ = driving
    monkeypatch.setattr(part.replace("MeshStore", "kbot.workbench.meshes.store.MeshStore"), broken)
    status, _, body = get(address, path)
    assert (status, body.decode()) == (500, f"500: {FAILED}\n")
    (fault,) = caplog.messages
    assert fault.startswith(f"GET /{path.split('/')[1]} failed: internal error (ZeroDivisionError)")
    monkeypatch.undo()
    assert get(address, "/")[0] == 200


@pytest.mark.parametrize(("target", "name"), [("robot", "robot"), ("?robot", ""), ("//robot/x", "robot")])
def test_a_failing_request_with_an_unusual_target_is_answered(
    driving: tuple[str, Session], target: str, name: str, monkeypatch: Any, caplog: pytest.LogCaptureFixture
) -> None:
    address, _ = driving
    monkeypatch.setattr("kbot.workbench.serving.page_files.PageFiles._found", broken)
    status, _, body = get(address, target)
    assert (status, body.decode()) == (500, f"500: {FAILED}\n")
    assert caplog.messages[0].startswith(f"GET /{name} failed: internal error (ZeroDivisionError)")
