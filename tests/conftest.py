"""What every test may ask for: the shared reference data and a browser, where they are there."""

import os
import shutil
from collections.abc import Generator
from pathlib import Path
from typing import TypeVar

import pytest
from hypothesis import settings

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

NO_SKIP = bool(os.environ.get("KBOT_NO_SKIP"))
"""Set where everything must be there: a test that would be skipped fails instead."""

CHROMIUMS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference data: `KBOT_SHARED`, or `shared` beside the repository."""
    folder = Path(os.environ.get("KBOT_SHARED") or Path(__file__).parents[2] / "shared")
    if not folder.is_dir():
        pytest.skip(f"the reference data is not at {folder} (set KBOT_SHARED)")
    return folder


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of the machine's Chromium: `KBOT_CHROMIUM`, or the first of the usual names."""
    names = filter(None, (os.environ.get("KBOT_CHROMIUM"), *CHROMIUMS))
    path = next((found for found in map(shutil.which, names) if found), None)
    if path is None:
        pytest.skip("there is no Chromium (install one, or set KBOT_CHROMIUM to its path)")
    return path


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    return _refuse_skip(report)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    return _refuse_skip(report)


def _refuse_skip(report: Report) -> Report:
    if NO_SKIP and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped, which KBOT_NO_SKIP forbids: {report.longrepr}"
    return report
