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
