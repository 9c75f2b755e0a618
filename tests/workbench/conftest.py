"""Fixtures: a robot to display, a server that displays it, and a real browser."""

import shutil
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import kbot
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

from .pages import Pages
from .served import served

ROBOTS = Path(kbot.__file__).parent / "robots"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the shipped robot package that a test may change."""
    return Path(shutil.copytree(ROBOTS / "kbot_description", tmp_path / "kbot_description"))


@pytest.fixture
def xacro(package: Path) -> Path:
    return package / "urdf" / "kbot.xacro"


@pytest.fixture
def viewing(xacro: Path) -> Iterator[str]:
    """The address of a workbench with sliders for the copied robot."""
    with served(open_session(str(xacro), simulate=False)) as address:
        yield address


@pytest.fixture
def driving(xacro: Path) -> Iterator[tuple[str, Session]]:
    """Address and session of a workbench that simulates the copied robot on an empty plane."""
    session = open_session(str(xacro), simulate=True, seed=1)
    with served(session) as address:
        yield address, session


@pytest.fixture
def keeps_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep simulated time from falling behind on a slow machine. Sessions are given the time that passes."""
    monkeypatch.setattr("kbot.workbench.driving.driving.BUSY_SECONDS", float("inf"))


@cache
def pages_of(browser: Any) -> Pages:
    return Pages(browser)


@pytest.fixture(scope="module")
def pages(browser: Any) -> Pages:
    return pages_of(browser)


@pytest.fixture
def open_page(pages: Pages) -> Iterator[Callable[..., Any]]:
    """Open an address and wait for its first picture. A script error or a blocked load fails the test."""
    opened = []

    def open_one(address: str, **options: Any) -> Any:
        page = pages.open(address, **{"viewport": {"width": 960, "height": 560}, **options})
        opened.append(page)
        wait_for_page(page)
        return page

    yield open_one
    for page in opened:
        pages.give_back(page)
    assert not [complaint for page in opened for complaint in page.complaints]


READY = """() => !!window.kbot && kbot.frames > 0 && kbot.revision > 0
  && document.querySelector('.topbar') !== null
  && (document.querySelector('.topbar .status')?.dataset.link ?? 'live') === 'live'"""


def wait_for_page(page: Any) -> None:
    """Wait until a loading page is ready: its panels exist, its server receives it, and nothing in it
    moves."""
    until(lambda: page.evaluate(READY))
    page.evaluate("document.fonts.ready.then(() => kbot.drawn())")


def until(condition: Callable[[], Any], seconds: float = 60.0) -> Any:
    """Wait for a condition and return its value. Fails after a timeout."""
    end = time.monotonic() + seconds
    while not (result := condition()):
        assert time.monotonic() < end, "it did not come true in time"
        time.sleep(0.02)
    return result
