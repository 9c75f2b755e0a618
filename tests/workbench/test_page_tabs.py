"""Many tabs of one browser on one server, each with another view."""

from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from kbot.workbench.serve import open_session, serving
from kbot.workbench.serving import server
from kbot.workbench.serving.hub import Hub

from .conftest import READY, until
from .pages import is_complaint
from .served import state_of

LINK = "document.querySelector('.status').dataset.link"
IS_PAST = "document.documentElement.dataset.time === 'past'"
HALF_WAY_BACK = """(() => { const slider = document.querySelector('.timeline [type=range]');
  slider.value = (Number(slider.min) + Number(slider.max)) / 2;
  slider.dispatchEvent(new Event('input')); })()"""


@pytest.fixture
def hubs(monkeypatch: pytest.MonkeyPatch) -> list[Hub]:
    """The hubs of the servers that are started, with the pages connected to each."""
    made: list[Hub] = []

    def make() -> Hub:
        made.append(Hub())
        return made[-1]

    monkeypatch.setattr(server, "Hub", make)
    return made


class Tabs:
    """Tabs of one window. `complaints` are the messages of their consoles."""

    def __init__(self, browser: Any) -> None:
        self.context = browser.new_context(viewport={"width": 480, "height": 320})
        self.complaints: list[str] = []

    def open(self, address: str) -> Any:
        page = self.context.new_page()
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", lambda m: self.complaints.append(m.text) if is_complaint(m) else None)
        page.goto(address, wait_until="commit")
        return page


def each(tabs: list[Any], script: str, value: object, seconds: float = 60.0) -> None:
    """Wait until a script gives a value in each of the tabs."""
    for tab in tabs:
        until(partial(lambda tab: tab.evaluate(script) == value, tab), seconds)


def waiting(hub: Hub) -> int:
    """Return the number of messages that wait for any page."""
    return sum(len(client._waiting) for client in hub)


def test_many_tabs_stay_in_step_and_reconnect_after_a_restart(
    xacro: Path, browser: Any, hubs: list[Hub]
) -> None:
    tabs = Tabs(browser)
    session = open_session(str(xacro), simulate=True, seed=1)
    with serving(session) as address:
        all_tabs = [tabs.open(address) for _ in range(7)]
        each(all_tabs, READY, True, 300.0)
        driver, plotter, listener, looks_back, other, *closed = all_tabs
        for tab in closed:
            tab.close()
        until(lambda: len(hubs[0]) == 5)
        again = tabs.open(address)
        each([again], READY, True, 300.0)
        plotter.keyboard.press("l")
        listener.keyboard.press("y")
        driver.keyboard.down("w")
        until(lambda: state_of(session).odometry[0] > 0.1)
        driver.keyboard.up("w")
        looks_back.evaluate(HALF_WAY_BACK)
        until(lambda: looks_back.evaluate(IS_PAST))
        other.keyboard.press("p")
        until(lambda: session.paused)
        now = state_of(session).time
        live = [driver, plotter, listener, other, again]
        each(live, "kbot.time", now)
        assert len({str(tab.evaluate("[...kbot.poses()]")) for tab in live}) == 1
        assert looks_back.evaluate(IS_PAST)
        assert looks_back.evaluate("kbot.time") < now
        until(lambda: waiting(hubs[0]) == 0)
        assert tabs.complaints == []
    everyone = [*live, looks_back]
    each(everyone, LINK, "lost")
    anew = open_session(str(xacro), simulate=True, seed=1)
    with serving(anew, port=urlsplit(address).port):
        each(everyone, LINK, "live")
        until(lambda: driver.evaluate("kbot.time") != now)  # until then, P ends the pause of the first server
        driver.keyboard.press("p")
        until(lambda: anew.paused)
        now = state_of(anew).time
        each(everyone, "kbot.time", now)
        until(plotter.locator("#plots canvas").is_visible)
        until(listener.get_by_role("list", name="Topics", exact=True).is_visible)
        until(lambda: waiting(hubs[1]) == 0)
        assert tabs.complaints == []
        tabs.context.close()
        until(lambda: len(hubs[1]) == 0)
    assert not any(anew.topics.subscribed_by(number) for number in range(1, 50))
