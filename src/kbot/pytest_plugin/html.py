"""Collects the runs of all tests, also from the workers of pytest-xdist, in one HTML report."""

from __future__ import annotations

import base64
import pickle
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from kbot.trials.results import TrialResult

_ATTRIBUTE = "kbot_result"
"""A report's attribute with the result of its run, as text, because xdist and other plugins send it on."""


def attach(report: pytest.TestReport, item: pytest.Item, result: TrialResult) -> None:
    """Let the report carry the result of its run to the process that writes the HTML."""
    packed = pickle.dumps(replace(result, name=item.nodeid))
    setattr(report, _ATTRIBUTE, base64.b64encode(packed).decode())


class HtmlReport:
    """A plugin that writes the report."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._results: list[TrialResult] = []
        self._problem = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        packed = getattr(report, _ATTRIBUTE, None)
        if packed is not None:
            self._results.append(pickle.loads(base64.b64decode(packed)))

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        from kbot.text import KbotError
        from kbot.trials.reports.html import write_html

        try:
            write_html(self._path, self._results, f"Tests of {session.config.rootpath.name}")
        except KbotError as error:
            self._problem = str(error)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self._problem:
            terminalreporter.write_line(f"error: {self._problem}", red=True)
        else:
            terminalreporter.write_sep("-", f"KBot: report with {len(self._results)} runs in {self._path}")
