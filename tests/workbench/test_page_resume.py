"""Resuming a simulation in the page, recorded worlds, and damaged recordings."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.record.replay import replay
from kbot.sim import Simulation
from kbot.workbench.protocol import Spawn
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session

from .conftest import until
from .served import do, run_between_steps, served, state_of
from .test_playback_damage import damaged, whole  # noqa: F401 - a fixture

OpenPage = Callable[..., Any]


def slider(page: Any) -> Any:
    return page.get_by_role("slider", name="Time shown")


def is_past(page: Any) -> bool:
    return bool(page.evaluate("document.documentElement.dataset.time === 'past'"))


def shown_x(page: Any) -> float:
    return float(page.evaluate("kbot.poses()[0]"))


def press(page: Any, part: float) -> None:
    """Click on the timeline at a part of its length."""
    box = slider(page).bounding_box()
    page.mouse.click(box["x"] + 6 + (box["width"] - 12) * part, box["y"] + box["height"] / 2)


def test_a_simulation_resumes_from_the_displayed_time(
    driving: tuple[str, Session], open_page: OpenPage, tmp_path: Path
) -> None:
    address, session = driving
    session.recording.folder = str(tmp_path)
    page, other = open_page(address), open_page(address)
    page.keyboard.press("p")  # so that the recording starts with the run
    until(lambda: session.paused)
    page.keyboard.press("r")
    until(lambda: page.evaluate("kbot.time") == 0.0)  # the past before a reset is not displayed
    began = state_of(session).at
    page.get_by_role("button", name="Record", exact=True).click()
    until(lambda: page.locator(".recording .name").count())
    page.keyboard.press("p")
    until(lambda: not session.paused)
    assert not page.get_by_role("button", name="Resume from here").is_visible()
    page.keyboard.down("w")
    until(lambda: state_of(session).odometry[0] > 0.6)
    page.keyboard.up("w")
    until(lambda: state_of(session).twist[0] == 0.0)
    page.keyboard.press("y")
    page.keyboard.press("p")  # the timeline does not move under the pointer
    until(lambda: page.inner_text(".rate") == "paused")
    until(lambda: float(slider(page).evaluate("s => s.max")) == pytest.approx(state_of(session).at, abs=2e-3))
    low, high = (float(slider(page).evaluate(f"s => s.{end}")) for end in ("min", "max"))
    press(page, (began + 1.3 - low) / (high - low))
    until(lambda: is_past(page) and shown_x(page) < 0.55)
    page.keyboard.press("p")
    until(lambda: page.get_by_role("button", name="Pause").is_visible())
    page.get_by_role("button", name="Resume from here").click()
    until(lambda: not is_past(page) and state_of(session).odometry[0] < 0.6)
    until(lambda: state_of(session).command == (0.0, 0.0))
    reported = page.get_by_role("log").get_by_text("The simulation continues from")
    until(lambda: reported.count() == 1)
    assert "The recording contains both runs" in reported.inner_text()
    until(lambda: "continues from" in other.locator(".log").text_content())  # other tabs are notified
    assert not session.paused
    assert not page.get_by_role("button", name="Resume from here").is_visible()
    file = run_between_steps(session, session.recording.view).file
    page.get_by_role("button", name="Stop recording").click()
    until(lambda: run_between_steps(session, session.recording.view) is None)
    assert replay(file).is_same
    other.close()


def test_objects_added_later_disappear_from_the_picture(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address)
    until(lambda: state_of(session).at > 2.0)
    do(session, lambda motion: motion.act(Spawn("box", 1.0, 1.0, 0.3, 0.0, 0.1, 0.1, 0.1)))
    until(lambda: len(session.scene.bodies) > 0)
    until(lambda: state_of(session).at > 3.5)
    press(page, 0.0)
    until(lambda: is_past(page))
    page.get_by_role("button", name="Resume from here").focus()
    page.keyboard.press("Enter")
    until(lambda: not is_past(page) and len(session.scene.bodies) == 0)


@pytest.fixture
def recorded(tmp_path: Path) -> str:
    """A run towards a wall of boxes that exists from the start, past a crate that is spawned after 2 s."""
    sim = Simulation("kbot", "boxes")
    path = tmp_path / "run.mcap"
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path)):
        sim.cmd_vel(0.1, 0.0)
        sim.run(2.0)
        sim.models.spawn_thing("box", "crate", 0.6, 0.4, 0.0, 0.0, (0.2, 0.2, 0.2))
        sim.run(2.0)
    return str(path)


def test_a_recording_is_shown_in_its_world(recorded: str, open_page: OpenPage) -> None:
    session = played_session(recorded)
    session.paused = True
    with served(session) as address:
        page = open_page(address)
        page.evaluate("kbot.look([0, 0, 6], [0.01, 0, 0])")
        assert page.locator(".crumbs").inner_text().strip() != ""
        without = pixels(page)
        press(page, 0.75)
        until(lambda: run_between_steps(session, session.timeline).at > 2.5)
        until(lambda: pixels(page) != without)
        assert {body.name for body in session.scene.bodies} >= {"crate", "box_0"}
        page.close()


def pixels(page: Any) -> bytes:
    page.evaluate("kbot.drawn()")
    return bytes(page.locator(".picture canvas").first.screenshot())


def test_a_damaged_part_is_reported_in_the_page(
    whole: Path,  # noqa: F811 - the fixture of another file
    tmp_path: Path,
    open_page: OpenPage,
) -> None:
    path, start, end = damaged(whole, tmp_path / "bad.mcap", 6)
    session = played_session(str(path))
    session.paused = True
    with served(session) as address:
        page = open_page(address)
        press(page, (start + 0.1) / run_between_steps(session, session.timeline).end)
        words = page.locator(".notices").get_by_text(f"is damaged from {start:.2f} s to {end:.2f} s")
        until(words.count)
        assert run_between_steps(session, session.timeline).at == pytest.approx(start, abs=0.01)
        until(lambda: float(slider(page).evaluate("s => s.value")) == pytest.approx(start, abs=0.05))
        page.close()
