"""Checks of unsaved texts: on a thread that does not delay the end, and of texts with a limited size."""

import asyncio
import json
import re
import threading
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

from kbot.workbench.protocol import CheckTexts, OpenSource, SourceText, TextsChecked
from kbot.workbench.serve import open_session, serving
from kbot.workbench.serving.daemon_thread import on_daemon_thread
from kbot.workbench.session.session import Session
from kbot.worker import READING, WorkerLimits

ROBOT = '<robot name="r"><link name="base"/></robot>'
LARGEST = 500_000
"""Bytes of the largest text, by docs/reference/limits.md."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "robot.urdf").write_text(ROBOT)
    return tmp_path / "robot.urdf"


@pytest.fixture
def session(file: Path) -> Session:
    return open_session(str(file), simulate=False)


@pytest.fixture
def page(session: Session) -> Iterator[ClientConnection]:
    with serving(session) as url, connected(url) as connection:
        yield connection


def connected(url: str) -> ClientConnection:
    return connect(url.replace("http:", "ws:") + "ws", max_size=None)


def answer(page: ClientConnection, *kinds: str) -> Any:
    """Return the next message of one of these types."""
    while True:
        data = page.recv(60)
        if isinstance(data, str) and (message := json.loads(data))["type"] in kinds:
            return message


def checked(page: ClientConnection, files: list[str], texts: list[str]) -> Any:
    page.send(json.dumps({"type": "check_texts", "number": 1, "files": files, "texts": texts}))
    return answer(page, "texts_checked", "refused")


def commented(text: str, size: int) -> str:
    """Return the robot with a comment, in `size` bytes of UTF-8."""
    room = size - len(f"{ROBOT}<!---->".encode())
    count, rest = divmod(room, len(text.encode()))
    return f"{ROBOT}<!--{text * count}{'.' * rest}-->"


def test_a_running_check_does_not_delay_the_end(session: Session, file: Path) -> None:
    has_begun, may_end, has_ended = threading.Event(), threading.Event(), threading.Event()

    def check(message: CheckTexts) -> TextsChecked:
        has_begun.set()
        may_end.wait(60.0)
        has_ended.set()
        return TextsChecked(message.number, (), None)

    session.shown.check = check  # type: ignore[method-assign]
    try:
        with serving(session) as url, connected(url) as page:
            request = {"type": "check_texts", "number": 1, "files": [str(file)], "texts": [ROBOT]}
            page.send(json.dumps(request))
            assert has_begun.wait(60.0)
        assert not has_ended.is_set()
    finally:
        may_end.set()


async def work_in_context() -> tuple[str, bool]:
    variable = ContextVar("variable", default="")
    variable.set("of the caller")
    caller = threading.get_ident()
    return await on_daemon_thread(lambda: (variable.get(), threading.get_ident() != caller))


def test_work_has_the_context_of_its_caller_and_its_own_thread() -> None:
    assert asyncio.run(work_in_context()) == ("of the caller", True)


def test_the_error_of_work_is_raised_in_the_caller() -> None:
    with pytest.raises(ZeroDivisionError):
        asyncio.run(on_daemon_thread(divmod, 1, 0))


def test_unsaved_text_is_checked(page: ClientConnection, file: Path) -> None:
    findings = checked(page, [str(file)], ['<robot name="r"/>'])["findings"]
    assert "the robot has no link" in [finding["message"] for finding in findings]


@pytest.mark.parametrize("text", ["a", '"', "\\", "字", "😀", "é"])
def test_the_largest_text_is_saved(page: ClientConnection, file: Path, text: str) -> None:
    largest = commented(text, LARGEST)
    was = commented(text, LARGEST - 20)
    file.write_text(was, encoding="utf-8")
    page.send(json.dumps({"type": "save_source", "file": str(file), "was": was, "text": largest}))
    assert answer(page, "source_saved", "refused")["type"] == "source_saved"
    assert file.read_text(encoding="utf-8") == largest


def test_a_text_of_control_characters_fits_in_a_message(page: ClientConnection, file: Path) -> None:
    # the longest JSON: each byte becomes six characters. XML does not allow it, so that it has a finding
    texts = ["\x01" * LARGEST] * 2
    assert checked(page, [str(file)] * 2, texts)["type"] == "texts_checked"


def test_a_larger_text_is_refused_with_its_size(page: ClientConnection, file: Path) -> None:
    refused = checked(page, [str(file)], [commented("字", LARGEST + 1)])
    assert refused["reason"] == "check_texts.texts.0 has 500001 bytes: the limit is 500000"


def test_texts_that_are_too_large_together_are_refused(page: ClientConnection, file: Path) -> None:
    refused = checked(page, [str(file)] * 3, [commented("字", LARGEST)] * 2 + ["a"])
    assert refused["reason"] == (
        "the unsaved texts have 1,000,001 bytes: the limit of a check is 1,000,000. Save some"
    )


@pytest.mark.parametrize(("size", "reason"), [(LARGEST, ""), (LARGEST + 1, "more than 500,000 bytes")])
def test_a_file_that_is_too_large_is_read_only(session: Session, file: Path, size: int, reason: str) -> None:
    file.write_text(commented("字", size), encoding="utf-8")
    source = session.handle(OpenSource(str(file)), 1)[0]
    assert isinstance(source, SourceText)
    assert (reason in source.read_only) if reason else source.read_only == ""


# --- In the worker ---


SLOW = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="l${len([i*i for i in python.range(1000000)])}"/>
</robot>"""


def test_a_reading_that_takes_too_long_keeps_the_last_valid_robot(
    file: Path, page: ClientConnection, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(READING, "limits", WorkerLimits(seconds=0.2))
    found = answer(page, "findings")
    assert not found["stale"]
    file.write_text(SLOW)
    while not found["stale"]:
        found = answer(page, "findings")
    (finding,) = found["findings"]
    assert finding["code"] == "F009"
    assert re.search("(took|waited) longer than [0-9.]+ s and was stopped", finding["message"])
    assert "--limit-time 2 " in finding["hint"]
    refused = checked(page, [str(file)], [SLOW])
    assert refused["reason"].startswith("checking the unsaved text ")
    monkeypatch.setattr(READING, "limits", WorkerLimits())
    file.write_text(ROBOT)
    while found["stale"]:
        found = answer(page, "findings")
    assert found["findings"] == []


def test_a_page_cannot_include_files_outside_the_folders_of_the_robot(tmp_path: Path) -> None:
    """Findings would show it their lines."""
    package, secret = tmp_path / "package", tmp_path / "secret.txt"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>package</name></package>")
    robot = package / "robot.xacro"
    robot.write_text(ROBOT)
    secret.write_text("password: hunter2")
    includes = f"""<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
      <link name="base"/><xacro:include filename="{secret}"/>
      <xacro:property name="p" value="${{xacro.load_yaml('{secret}')}}"/><link name="${{p['password']}}"/>
    </robot>"""
    session = open_session(str(robot), simulate=False)
    with serving(session) as url, connected(url) as page:
        found = checked(page, [str(robot)], [includes])["findings"]
        refused = f"{secret} cannot be read: it is outside the description's own folders and all packages"
        (error,) = [f for f in found if f["severity"] == "error"]
        assert refused in error["message"]  # the include
        assert error["related"][0]["message"].startswith(refused)  # load_yaml
        assert "hunter2" not in json.dumps(found)
        saving = {"type": "save_source", "file": str(robot), "was": ROBOT, "text": includes}
        page.send(json.dumps(saving))
        while not (found := answer(page, "findings"))["stale"]:
            pass
        assert refused in json.dumps(found, ensure_ascii=False)
        assert "hunter2" not in json.dumps(found)


def test_a_user_may_include_any_file(tmp_path: Path) -> None:
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "package.xml").write_text("<package><name>package</name></package>")
    (tmp_path / "wheel.xacro").write_text("<robot><link name='wheel'/></robot>")
    robot = tmp_path / "package" / "robot.xacro"
    robot.write_text(ROBOT)
    session = open_session(str(robot), simulate=False)
    robot.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base"/>'
        f'<xacro:include filename="{tmp_path}/wheel.xacro"/></robot>'
    )
    assert str(tmp_path / "wheel.xacro") in session.read().files
