"""Tests that bad clients do not fill the log, and that an internal error is one line with a crash file."""

import asyncio
import logging
from pathlib import Path

import pytest

from kbot.text.complaints import EVERY_SECONDS, FIRST, Complaints


@pytest.fixture(autouse=True)
def crash_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("kbot.text.crash.state_folder", lambda: tmp_path)
    return tmp_path / "crashes"


def messages(caplog: pytest.LogCaptureFixture) -> list[str]:
    assert not any(record.exc_info for record in caplog.records)
    return [record.getMessage() for record in caplog.records]


def test_later_complaints_are_only_counted(caplog: pytest.LogCaptureFixture) -> None:
    now = 0.0
    complaints = Complaints(logging.getLogger("complaints"), clock=lambda: now)
    for number in range(FIRST + 1000):
        complaints.add(f"bad {number}")
    assert messages(caplog) == [f"bad {number}" for number in range(FIRST)]
    now = EVERY_SECONDS
    complaints.add("bad again")
    assert messages(caplog)[-1] == "1001 more bad messages or requests. The last one: bad again"
    complaints.add("and again")
    assert len(caplog.records) == FIRST + 1


def test_a_fault_has_a_crash_file_once(caplog: pytest.LogCaptureFixture, crash_folder: Path) -> None:
    complaints = Complaints(logging.getLogger("complaints"))
    for what in ("drive", "drive", "publish"):
        reported = complaints.fault(what, ValueError("no such thing"))
        assert reported == "KBot could not process this: ValueError: no such thing; please report it"
    first, again, other = messages(caplog)
    assert first.startswith("drive failed: internal error (ValueError)")
    assert again == "drive failed again: ValueError: no such thing"
    assert other.startswith("publish failed: internal error (ValueError)")
    files = sorted(crash_folder.iterdir())
    assert len(files) == 2
    assert any(str(file) in first for file in files)
    assert all("ValueError: no such thing" in file.read_text() for file in files)


def test_a_failed_callback_is_one_line(caplog: pytest.LogCaptureFixture, crash_folder: Path) -> None:
    async def run() -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(Complaints(logging.getLogger("complaints")).loop_fault)
        loop.call_soon(lambda: 1 // 0)
        await asyncio.sleep(0)
        loop.call_exception_handler({"message": "a transport failed", "exception": ConnectionError("gone")})

    asyncio.run(run())
    fault, broken = messages(caplog)
    assert fault.startswith("a task of the server failed: internal error (ZeroDivisionError)")
    assert broken == "a transport failed: gone"
