"""Clients that misbehave do not fill the log."""

import logging

import pytest

from kbot.workbench.serving.complaints import EVERY_SECONDS, FIRST, Complaints


def test_after_the_first_few_only_their_number_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    now = 0.0
    complaints = Complaints(logging.getLogger("complaints"), clock=lambda: now)
    for number in range(FIRST + 1000):
        complaints.add(f"bad {number}")
    assert [record.getMessage() for record in caplog.records] == [f"bad {number}" for number in range(FIRST)]
    now = EVERY_SECONDS
    complaints.add("bad again")
    assert caplog.records[-1].getMessage() == "1001 more bad messages or requests; the last: bad again"
    complaints.add("and again")
    assert len(caplog.records) == FIRST + 1


def test_a_fault_is_logged_with_its_traceback_once(caplog: pytest.LogCaptureFixture) -> None:
    complaints = Complaints(logging.getLogger("complaints"))
    for what in ("drive", "drive", "publish"):
        told = complaints.fault(what, ValueError("no such thing"))
        assert told == "KBot failed at this: ValueError: no such thing; please report it"
    said = [(record.getMessage(), record.exc_info is not None) for record in caplog.records]
    assert said == [
        ("drive failed", True),
        ("drive failed again: ValueError: no such thing", False),
        ("publish failed", True),
    ]
