"""The page under failures, and when there are many of them."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from kbot.messages.navigation import Path as PlannedPath
from kbot.messages.navigation import PoseStamped
from kbot.workbench.serve import open_session, serving
from kbot.workbench.serving.past import Past
from kbot.workbench.session.session import Session

from .axe import violations
from .conftest import until, wait_for_page
from .displayed import WORLD, Show, pose
from .served import Speaker, do, state_of

OpenPage = Callable[..., Any]

KEEP_SOCKETS = """window.sockets = []; window.WebSocket = class extends WebSocket {
  constructor(...words) { super(...words); sockets.push(this);
    this.addEventListener('message', ({ data }) => {
      if (typeof data !== 'string') return;
      if (data.includes('"odometry"')) window.lastState = JSON.parse(data);
      if (data.includes('"covariance"')) window.lastOdometry = JSON.parse(data); }); } };"""

COUNT_MESSAGES = """window.told = 0; window.WebSocket = class extends WebSocket {
  constructor(...words) { super(...words); this.addEventListener('message', () => { told += 1; }); } };"""

SLOW = """window.WebSocket = class extends WebSocket {
  constructor(...words) {
    super(...words);
    this.addEventListener('message', () => {
      for (const end = performance.now() + 100; performance.now() < end;);
    });
  } };"""
"""Lets a page take a tenth of a second for each message, of which there are more than fifty a second."""

HEAR = """async (count) => {
  const say = (data) => sockets.at(-1).dispatchEvent(new MessageEvent('message', { data }));
  const state = lastState, odometry = lastOdometry;
  for (let i = 0; i < count; i += 1) {
    state.time += 1 / 60;
    state.positions = state.positions.map((position) => position + 0.01);
    for (let at = 0; at < state.poses.length; at += 7) {
      state.poses[at] = Math.cos(state.time * 2);
      state.poses[at + 1] = Math.sin(state.time * 2);
    }
    say(JSON.stringify(state));
    odometry.time = state.time;
    say(JSON.stringify(odometry));
    if (i % 20 === 0) say(JSON.stringify({ type: 'refused', reason: `no ${state.time}` }));
    if (i % 300 === 0) await new Promise((resolve) => setTimeout(resolve));
  }
  await kbot.drawn();
}"""
"""The messages of several minutes for a page, at once: states, a topic, refusals."""

STATES_BETWEEN_CLEARINGS = 721
"""The plots' last minute grows by these, 3600 and a fifth, before the oldest are forgotten."""


def inks(page: Any) -> set[str]:
    """Return the colours of the numbers that show the current state."""
    numbers = page.locator(".transport .time, #drive .reading output, #drive .meter output")
    assert numbers.count() == 9  # the time, two speeds and two poses
    return {entry.evaluate("e => getComputedStyle(e).color") for entry in numbers.all()}


def test_a_page_reconnects_to_a_restarted_server(xacro: Path, browser: Any) -> None:
    page = browser.new_page(viewport={"width": 960, "height": 560}, color_scheme="dark")
    with serving(open_session(str(xacro), simulate=True)) as address:
        page.goto(address)
        wait_for_page(page)
        live = inks(page)
        page.evaluate("kbot.look([0.3, 0.4, 0.5], [0, 0, 0])")
        page.keyboard.press("4")
        page.locator("#links [data-link=left_wheel]").click()
        until(lambda: page.locator("#links [aria-selected=true]").count() == 1)
        camera = page.evaluate("kbot.camera()")
    until(lambda: page.get_by_text("KBot has ended.").is_visible())
    assert page.inner_text(".status") == "ended"
    assert inks(page).isdisjoint(live)  # stale numbers look different
    assert violations(page) == []
    xacro.write_text(xacro.read_text().replace('"base_len" default="0.16"', '"base_len" default="0.2"'))
    with serving(open_session(str(xacro), simulate=True), port=urlsplit(address).port):
        until(lambda: page.inner_text(".status") == "live")
        until(lambda: page.get_by_label("base_len, as a number").input_value() == "0.2")
        assert page.get_by_text("KBot has ended.").is_hidden()
        assert inks(page) == live
        now = page.evaluate("kbot.camera()")["clipFromWorld"]
        assert np.allclose(now, camera["clipFromWorld"], atol=1e-9)
        assert page.locator("[data-option=frames]").get_attribute("aria-pressed") == "true"
        assert page.locator("#links [aria-selected=true]").inner_text().startswith("left_wheel")
        page.keyboard.down("w")
        until(lambda: float(page.inner_text("[data-reading=x]").replace("\u2212", "-")) > 0.02)
    page.close()


def test_a_hanging_server_is_distinguished_from_an_idle_one(
    driving: tuple[str, Session], browser: Any
) -> None:
    address, session = driving
    page = browser.new_page(viewport={"width": 640, "height": 400})
    page.add_init_script(COUNT_MESSAGES)
    page.goto(address)
    wait_for_page(page)
    page.keyboard.press("p")
    until(lambda: session.paused)
    reported = page.evaluate("told")
    until(lambda: page.evaluate("told") > reported + 5)
    assert page.inner_text(".status") == "live"
    page.keyboard.press("p")
    until(lambda: not session.paused)
    answers = threading.Event()

    def hang() -> bool:
        answers.wait(120.0)
        return False

    session._motion._sim.errands.append(hang)
    until(lambda: page.get_by_text("No connection to the server.").is_visible())
    answers.set()
    until(lambda: page.inner_text(".status") == "live")
    until(lambda: page.get_by_text("No connection to the server.").is_hidden())
    page.close()


def test_a_page_does_not_grow_as_the_description_changes(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page = open_page(viewing)

    def change(times: int) -> dict[str, int]:
        for _ in range(times):
            revision = page.evaluate("kbot.revision")
            page.get_by_label("base_len", exact=True).fill(str(0.1 + 0.001 * (revision % 100)))
            until(lambda revision=revision: page.evaluate("kbot.revision") > revision)
            page.evaluate("kbot.drawn()")
        return dict(page.evaluate("kbot.held()"))

    before = change(2)
    after = change(6)  # a leak of one change would show up six times
    assert after == before


def test_an_open_page_does_not_grow(driving: tuple[str, Session], browser: Any) -> None:
    context = browser.new_context(viewport={"width": 640, "height": 400})
    context.add_init_script(KEEP_SOCKETS)
    page = context.new_page()
    page.goto(driving[0])
    wait_for_page(page)
    page.get_by_role("button", name="Topics and log", exact=True).click()
    page.locator("[data-topic='/odom'] .head").click()
    page.get_by_role("button", name="twist.twist.linear.x", exact=True).click()
    until(lambda: page.locator("#plots canvas").count() == 1)
    until(lambda: page.evaluate("!!window.lastOdometry && !!window.lastState"))
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    tools = context.new_cdp_session(page)

    def held() -> tuple[int, dict[str, int]]:
        """Return the bytes of the page's objects, and counts of its document's nodes."""
        for _ in range(2):
            tools.send("HeapProfiler.collectGarbage")
        heap = tools.send("Runtime.getHeapUsage")["usedSize"]
        return heap, tools.send("Memory.getDOMCounters")

    page.evaluate(HEAR, 12 * STATES_BETWEEN_CLEARINGS)  # the trail of 8000 points is full too
    heap, document = held()
    page.evaluate(HEAR, 6 * STATES_BETWEEN_CLEARINGS)
    later_heap, later_document = held()
    assert later_heap - heap < 200_000  # 46 bytes for each state
    assert later_document["nodes"] <= document["nodes"] + 20
    assert later_document["jsEventListeners"] <= document["jsEventListeners"]
    context.close()


def test_a_slow_page_receives_less_and_does_not_fall_behind(
    driving: tuple[str, Session], browser: Any
) -> None:
    address, session = driving
    page = browser.new_page(viewport={"width": 320, "height": 200})
    page.add_init_script(SLOW)
    page.goto(address)
    until(lambda: page.evaluate("!!window.kbot && kbot.time > 0"))
    began = state_of(session).time
    # without skipping it would be ten seconds behind
    until(lambda: state_of(session).time > began + 15.0, 300.0)
    shown = page.evaluate("kbot.time")
    assert shown > began + 10.0
    page.close()


def test_latched_messages_are_kept_when_the_timeline_arrives_later(
    driving: tuple[str, Session], open_page: OpenPage, monkeypatch: pytest.MonkeyPatch
) -> None:
    address, session = driving
    path = PlannedPath(WORLD, (PoseStamped(WORLD, pose()), PoseStamped(WORLD, pose(1.0))))
    do(session, lambda motion: motion.bus.advertise("/plan", PlannedPath, latched=True).publish(path))
    sends_timeline, send_timeline = threading.Event(), Past.send_timeline
    monkeypatch.setattr(
        Past,
        "send_timeline",
        lambda past, client, again=False: (
            send_timeline(past, client, again) if sends_timeline.is_set() else None
        ),
    )
    page = open_page(address)
    show = Show(page, Speaker(session))
    show.add("Path", "/plan")
    until(lambda: show.status("Path").startswith("fine: /plan"))
    assert page.locator(".timeline").is_hidden()
    sends_timeline.set()
    until(lambda: page.locator(".timeline").is_visible())
    page.evaluate("kbot.drawn()")
    assert "no message received" not in show.status("Path")
