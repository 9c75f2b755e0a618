"""Going back in time in the page by mouse, touch and keyboard; bookmarks; recording; playback."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.messages.navigation import Path as Way
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

from .conftest import until, wait_for_page
from .served import run_between_steps, served, state_of

OpenPage = Callable[..., Any]


@pytest.fixture
def page(driving: tuple[str, Session], open_page: OpenPage, tmp_path: Path) -> Any:
    """A page of a robot that has driven for a while and is at rest."""
    address, session = driving
    session.recording.folder = str(tmp_path)
    session.paused = True  # so that the timeline starts when the page connects
    page = open_page(address)
    page.session, page.start = session, state_of(session).time
    session.paused = False
    # Half a second at rest is 5 % of the timeline, even if a busy machine makes that 10 s long.
    until(lambda: state_of(session).time > page.start + 0.5)
    page.keyboard.down("w")
    until(lambda: state_of(session).odometry[0] > 0.3)
    page.keyboard.up("w")
    until(lambda: state_of(session).command == (0.0, 0.0) and state_of(session).twist[0] < 1e-3)
    until(lambda: page.evaluate("kbot.time") > page.start + 2.0)
    return page


def slider(page: Any) -> Any:
    return page.get_by_role("slider", name="Time shown")


def drag(page: Any, part: float) -> None:
    """Drag the thumb from its place to a part of the timeline."""
    box = until(slider(page).bounding_box)
    at = box["y"] + box["height"] / 2
    now, low, high = (float(slider(page).evaluate(f"s => s.{n}")) for n in ("valueAsNumber", "min", "max"))
    page.mouse.move(box["x"] + 6 + (box["width"] - 12) * (now - low) / max(high - low, 1e-9), at)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * part, at, steps=6)
    page.mouse.up()


def shown_x(page: Any) -> float:
    return float(page.evaluate("kbot.poses()[0]"))


def is_past(page: Any) -> bool:
    return bool(page.evaluate("document.documentElement.dataset.time === 'past'"))


def settled(page: Any) -> float:
    """Return the displayed simulated time once the page shows the time that it requested last."""
    until(lambda: is_past(page) and not page.evaluate("kbot.seeks"))
    return float(page.evaluate("kbot.time"))


def test_the_robot_is_shown_at_its_earlier_pose(page: Any) -> None:
    now = state_of(page.session).odometry[0]
    until(lambda: shown_x(page) == pytest.approx(now, abs=0.01))
    drag(page, 0.05)
    then = settled(page)
    assert shown_x(page) < 0.1
    assert then < state_of(page.session).time - 1
    assert page.get_by_role("status").filter(has_text="live").count() == 1  # the status of the connection
    assert "ago" in slider(page).get_attribute("aria-valuetext")
    until(lambda: page.get_by_label("Simulated time in seconds").inner_text() == f"{then:.2f} s")
    reading = float(page.inner_text("[data-reading=x]").replace("\u2212", "-"))  # updated with the time
    assert reading == pytest.approx(shown_x(page), abs=2e-3)
    page.session.paused = False
    before = state_of(page.session).time
    until(lambda: state_of(page.session).time > before + 0.5)
    assert page.evaluate("kbot.time") == then  # the simulation continued, and the picture did not
    page.get_by_role("button", name="Live").click()
    until(lambda: not is_past(page) and page.evaluate("kbot.time") > then + 1)
    assert shown_x(page) == pytest.approx(now, abs=0.1)
    until(lambda: slider(page).get_attribute("aria-valuetext").endswith(" s, live"))


def test_live_numbers_are_marked_while_looking_back(page: Any) -> None:
    panels = [page.locator(f"#{name}") for name in ("parameters", "findings")]
    assert not any("current" in panel.inner_text() for panel in panels)
    drag(page, 0.05)
    until(lambda: is_past(page))
    assert all("current" in panel.inner_text() for panel in panels)


def test_a_time_without_a_scan_is_not_an_error(xacro: Path, open_page: OpenPage) -> None:
    session = open_session(str(xacro), simulate=True, arguments={"lidar": "true"})
    with served(session) as address:
        until(lambda: state_of(session).at > 1.0)  # the lidar has no subscriber
        page = open_page(address)
        lamp = page.locator(".display[data-display=LaserScan] .lamp")
        until(lambda: lamp.get_attribute("aria-label").startswith("fine"))
        slider(page).press("Home")
        until(lambda: is_past(page))
        until(lambda: lamp.get_attribute("aria-label") == "off: no message of /scan is stored for this time")
        head = page.locator("#displays .panel-head").bounding_box()
        page.get_by_role("button", name="Live").click()
        run_between_steps(session, lambda: session.topics.bus.advertise("way", Way), changes=True)
        chooser = page.get_by_label("Add a display")
        until(lambda: chooser.locator("option[value='Path /way']").count())
        chooser.select_option("Path /way")
        until(lambda: page.locator("#displays .badge").is_visible())
        assert page.locator("#displays .panel-head").bounding_box()["height"] == head["height"]


def test_keys_go_back_in_time(page: Any) -> None:
    slider(page).focus()
    now = state_of(page.session).time
    for _ in range(6):
        page.keyboard.press("PageDown")
    assert settled(page) < now - 1.0
    page.keyboard.press("Home")
    until(lambda: slider(page).evaluate("s => s.valueAsNumber === Number(s.min)"))
    first = settled(page)
    assert shown_x(page) < 0.05
    for _ in range(10):  # by 0.1 s each
        page.keyboard.press("ArrowRight")
    until(lambda: first + 0.8 < settled(page) < first + 1.2)
    page.keyboard.press("End")
    until(lambda: not is_past(page))


def test_the_timeline_shows_the_time_of_the_clock(page: Any) -> None:
    page.keyboard.press("r")
    until(lambda: page.evaluate("kbot.time") < 1.0)  # the past before a reset is not displayed
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    state = state_of(page.session)
    assert state.at > state.time + 1.0  # time on the timeline continued
    clock = page.get_by_label("Simulated time in seconds")
    until(lambda: clock.inner_text() == f"{state.time:.2f} s")
    until(lambda: slider(page).get_attribute("aria-valuetext") == f"{state.time:.2f} s, live")
    until(lambda: slider(page).evaluate("s => s.valueAsNumber") == pytest.approx(state.at, abs=2e-3))
    slider(page).focus()
    page.keyboard.press("ArrowLeft")
    until(lambda: is_past(page))
    then = settled(page)
    until(lambda: slider(page).get_attribute("aria-valuetext") == f"{then:.2f} s, 0.1 seconds ago")


def test_one_step_back_leaves_the_present(page: Any) -> None:
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    until(lambda: float(slider(page).evaluate("s => s.max")) == round(state_of(page.session).at, 3))
    slider(page).focus()
    page.keyboard.press("ArrowLeft")
    until(lambda: is_past(page))
    now = state_of(page.session).time
    until(lambda: now - 0.3 < page.evaluate("kbot.time") < now - 0.05)
    until(lambda: "0.1 seconds ago" in slider(page).get_attribute("aria-valuetext"))
    page.keyboard.press("ArrowRight")
    until(lambda: not is_past(page))


def test_keys_continue_after_the_pointer_went_back(page: Any) -> None:
    drag(page, 0.5)
    then = settled(page)
    for _ in range(4):
        page.keyboard.press("ArrowLeft")
    until(lambda: then - 0.6 < page.evaluate("kbot.time") < then - 0.1)
    assert is_past(page)
    # the arrow keys drive only while the present is displayed
    assert state_of(page.session).command == (
        0.0,
        0.0,
    )
    page.keyboard.press("Escape")
    until(lambda: not is_past(page))
    page.keyboard.down("ArrowLeft")
    until(lambda: state_of(page.session).command[1] > 0)
    page.keyboard.up("ArrowLeft")


def test_a_page_that_looks_back_shows_whether_time_is_paused(page: Any) -> None:
    drag(page, 0.3)
    until(lambda: is_past(page))
    page.keyboard.press("p")
    until(lambda: page.get_by_role("button", name="Continue").is_visible())
    assert page.session.paused
    assert is_past(page)


def test_driving_returns_to_the_present(page: Any) -> None:
    drag(page, 0.3)
    until(lambda: is_past(page))
    page.keyboard.down("w")
    until(lambda: not is_past(page) and shown_x(page) > 0.4)
    page.keyboard.up("w")


def test_each_tab_displays_its_own_time(page: Any, driving: tuple[str, Session], open_page: OpenPage) -> None:
    other = open_page(driving[0])
    drag(page, 0.05)
    until(lambda: is_past(page))
    assert not is_past(other)
    assert shown_x(other) > 0.3
    drag(other, 0.05)  # a page that connects later can display earlier times
    until(lambda: is_past(other) and shown_x(other) < 0.15)


def test_bookmarks_are_set_named_and_opened(
    page: Any, driving: tuple[str, Session], open_page: OpenPage
) -> None:
    drag(page, 0.2)
    until(lambda: is_past(page))
    first = settled(page)
    page.keyboard.press("k")
    drag(page, 0.6)
    until(lambda: page.evaluate("kbot.time") > first + 0.3)
    second = settled(page)
    page.get_by_role("button", name="Bookmark this time").click()
    page.keyboard.press("[")
    until(lambda: page.evaluate("kbot.time") == first)
    page.keyboard.press("]")
    until(lambda: page.evaluate("kbot.time") == second)
    page.keyboard.press("]")
    until(lambda: not is_past(page))
    page.get_by_role("button", name="2 bookmarks").click()
    note = page.get_by_label(f"Note at {first:.2f} s")
    note.fill("it starts")
    note.press("Enter")
    page.get_by_role("button", name=f"Go to it starts at {first:.2f} s").click()
    until(lambda: page.evaluate("kbot.time") == first)
    page.reload()
    wait_for_page(page)
    other = open_page(driving[0])
    other.get_by_role("button", name="2 bookmarks").click()
    until(lambda: other.get_by_label(f"Note at {first:.2f} s").input_value() == "it starts")
    other.get_by_role("button", name="Remove it starts").click()
    until(lambda: page.get_by_role("button", name="1 bookmark").is_visible())
    page.keyboard.press("[")
    until(lambda: page.evaluate("kbot.time") == second)


def test_the_timeline_works_by_touch(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    until(lambda: page.evaluate("kbot.time") > 3.0)
    box = slider(page).bounding_box()
    assert box["height"] >= 40
    assert box["x"] >= 0
    assert box["width"] > 340
    assert box["x"] + box["width"] <= 390
    page.touchscreen.tap(box["x"] + box["width"] * 0.3, box["y"] + box["height"] / 2)
    until(lambda: is_past(page))
    page.get_by_role("button", name="Live").tap()
    until(lambda: not is_past(page))


@pytest.mark.parametrize("size", [(390, 844), (640, 400)])
def test_everything_is_reachable_on_a_narrow_page(
    driving: tuple[str, Session], open_page: OpenPage, size: tuple[int, int]
) -> None:
    width, height = size
    page = open_page(driving[0], viewport={"width": width, "height": height})
    page.get_by_role("button", name="Topics and log", exact=True).click()
    until(lambda: page.get_by_role("log").is_visible())
    page.get_by_role("button", name="Plots", exact=True).click()
    until(lambda: page.locator("#plots canvas").count() == 1)
    until(lambda: not page.get_by_role("log").is_visible())  # one panel at a time
    tabs = page.get_by_role("navigation", name="Panels")
    for part in (tabs, page.locator("#plots"), page.locator(".timeline"), page.locator(".transport")):
        box = part.bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= height + 1
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width + 1
    assert not page.get_by_label("Drive", exact=True).is_visible()
    tabs.get_by_role("button", name="Joints").click()
    until(lambda: page.locator("#joints").is_visible() and not page.locator("#plots").is_visible())
