"""The page's own information is consistent, readable and up to date."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.protocol import RecordRun
from kbot.workbench.serve import open_session, serving
from kbot.workbench.session.played_session import played_session
from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import decode_png
from .served import served, state_of

OpenPage = Callable[..., Any]

RVIZ = """Visualization Manager:
  Class: ""
  Displays: []
  Global Options:
    Background Color: 48; 96; 48
    Fixed Frame: base_footprint
  Views:
    Current:
      Class: rviz/Orbit
      Distance: 3
      Focal Point: {X: 0, Y: 0, Z: 0}
      Pitch: 0.6
      Yaw: 0.8
"""


@pytest.fixture
def player(tmp_path: Path, xacro: Path) -> Session:
    """A session that plays back a recording of some seconds, starting with the first page."""
    simulated = open_session(str(xacro), simulate=True, seed=1)
    simulated.recording.folder = str(tmp_path)
    with serving(simulated):
        simulated.handle(RecordRun(True), 1)
        until(lambda: (view := simulated.recording.view()) is not None and view.seconds > 6.0)
        view = simulated.recording.view()
        assert view is not None
        path = view.file
        simulated.handle(RecordRun(False), 1)
    session = played_session(path)
    session.paused = session.waits_for_page = True
    return session


def test_playback_starts_with_its_page_and_keys_work_on_the_timeline(
    player: Session, open_page: OpenPage
) -> None:
    assert player.paused
    with served(player) as address:
        page = open_page(address)
        until(lambda: state_of(player).at > 0.1)
        page.keyboard.press("Tab")
        line = page.get_by_role("slider", name="Time shown")
        line.focus()
        page.keyboard.press("p")
        until(lambda: page.get_by_role("button", name="Continue").is_visible())
        page.keyboard.press("Space")
        until(lambda: page.get_by_role("button", name="Pause").is_visible())
        page.keyboard.press("Space")
        until(lambda: page.get_by_role("button", name="Continue").is_visible())
        page.keyboard.press("Home")
        until(lambda: state_of(player).at < 0.05)
        page.keyboard.press("k")
        until(lambda: page.get_by_role("button", name="1 bookmark").is_visible())
        page.keyboard.press("l")
        until(lambda: page.locator("#plots canvas").count() == 1)


def test_the_lamp_of_a_new_display_is_green(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.get_by_label("Add a display").select_option("Axes")
    page.locator(".display[data-display=Axes] select").first.wait_for()
    page.get_by_label("Add a display").select_option("Grid")
    lamp = page.locator(".display[data-display=Grid] .lamp").last
    until(lambda: page.locator(".display[data-display=Grid]").count() == 2)
    until(lambda: lamp.get_attribute("aria-label") == "fine")
    assert lamp.get_attribute("data-level") == "ok"


def test_a_broken_file_has_no_parameters(viewing: str, open_page: OpenPage, xacro: Path) -> None:
    page = open_page(viewing)
    text = xacro.read_text()
    xacro.write_text(text.replace("</robot>", ""))
    until(lambda: "Unknown until the file can be read." in page.locator("#parameters").inner_text())
    xacro.write_text(text)
    until(lambda: page.locator("#parameters [data-parameter]").count() > 0)


def test_a_reached_goal_is_reported_once(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address, viewport={"width": 1200, "height": 900})
    until(lambda: state_of(session).time > 1.0)
    page.keyboard.press("y")
    page.keyboard.press("g")
    page.locator(".picture canvas").focus()
    page.keyboard.press("Enter")  # the robot's position
    page.keyboard.press("Enter")
    log = page.get_by_role("log")
    until(lambda: "Goal reached" in log.inner_text())
    until(lambda: not page.locator(".goal").is_visible())
    second = open_page(address, viewport={"width": 1200, "height": 900})
    second.keyboard.press("y")
    until(lambda: "Connected." in second.get_by_role("log").inner_text())
    at = state_of(session).time
    until(lambda: state_of(session).time > at + 1.0)
    assert "Goal reached" not in second.get_by_role("log").inner_text()
    assert not second.locator(".goal").is_visible()


def test_the_background_of_an_rviz_file_is_behind_everything(
    xacro: Path, tmp_path: Path, open_page: OpenPage
) -> None:
    file = tmp_path / "robot.rviz"
    file.write_text(RVIZ)
    session = open_session(str(xacro), simulate=False)
    session.display_file = DisplayFile(str(file))
    with served(session) as address:
        page = open_page(address)

        def share() -> float:
            image = decode_png(page.locator(".picture canvas").first.screenshot())[..., :3].astype(int)
            return float((abs(image - (48, 96, 48)).max(axis=-1) <= 4).mean())

        until(lambda: share() > 0.5)


def test_the_timeline_uses_the_available_width(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 1400, "height": 900})
    line = page.get_by_role("slider", name="Time shown")
    until(lambda: line.is_visible())
    live = page.get_by_role("button", name="Live", exact=True)

    def gap() -> float:
        box = line.bounding_box()
        return float(live.bounding_box()["x"] - box["x"] - box["width"])

    until(lambda: gap() < 90)
    before = line.bounding_box()["width"]
    until(lambda: page.evaluate("kbot.time") > 3.0)
    page.mouse.click(line.bounding_box()["x"] + before * 0.3, line.bounding_box()["y"] + 12)
    resume = page.get_by_role("button", name="Resume from here")
    until(lambda: resume.is_visible())
    assert line.bounding_box()["width"] == pytest.approx(before, abs=1)
    x, width = resume.bounding_box()["x"], resume.bounding_box()["width"]
    centre = page.locator(".centre").bounding_box()
    assert centre["x"] < x < x + width <= centre["x"] + centre["width"]


def test_the_list_of_keys_opens_at_the_top(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing, viewport={"width": 1400, "height": 400})
    page.keyboard.press("?")
    keys = page.get_by_role("dialog", name="Keys")
    until(lambda: keys.is_visible())
    until(
        lambda: keys.evaluate(
            "one => one.contains(document.activeElement) && one.scrollHeight > one.clientHeight"
        )
    )
    assert keys.evaluate("one => one.scrollTop") == 0


def test_a_drag_over_the_picture_selects_no_text(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.keyboard.press("n")
    box = page.locator(".picture canvas").first.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(20, 300, steps=4)
    page.mouse.move(box["x"] + box["width"] + 60, 500, steps=4)
    assert page.evaluate("getSelection().toString()") == ""
    page.mouse.up()
