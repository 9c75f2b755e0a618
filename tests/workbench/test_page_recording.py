"""The page records the displayed run and plays it back."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.record import Recording
from kbot.workbench.protocol import Seek, SetLoop
from kbot.workbench.serve import serving
from kbot.workbench.session.played_session import played_session

from .conftest import until, wait_for_page
from .displayed import Show
from .served import Speaker, run_between_steps, state_of
from .test_foreign_recordings import no_robot
from .test_page_time import drag, page, shown_x, slider

__all__ = ["page"]

OpenPage = Callable[..., Any]


def test_the_page_records_to_a_file(page: Any, tmp_path: Path) -> None:
    page.reload()  # it loaded with another folder
    wait_for_page(page)
    record = page.get_by_role("button", name="Record", exact=True)
    until(lambda: record.get_attribute("title") == f"Record to a new file in {tmp_path}")
    record.click()
    name = until(lambda: page.locator(".recording .name").inner_text())
    until(lambda: page.locator(".notice").get_by_text(f"Recording to {tmp_path / name}").is_visible())
    until(lambda: page.locator(".recording .size").inner_text() > "0:00.9")
    page.get_by_role("button", name="Stop recording").click()
    until(lambda: page.locator(".notice").get_by_text(f"Recorded to {tmp_path / name}.").is_visible())
    with page.expect_download() as saved:
        page.get_by_role("link", name="Download").click()
    assert saved.value.suggested_filename == name
    assert saved.value.path().read_bytes() == (tmp_path / name).read_bytes()
    summary = Recording(str(tmp_path / name)).summary()
    assert summary.broken == ""
    assert summary.seconds > 0.9
    assert {"/robot_description", "/odom", "/joint_states", "/tf"} <= summary.topics.keys()
    played = played_session(str(tmp_path / name))
    played.handle(Seek(1e6), 1)
    assert played.state().poses[0] == pytest.approx(state_of(page.session).odometry[0], abs=0.05)


def test_a_recording_is_played_back_and_scrubbed(page: Any, open_page: OpenPage) -> None:
    page.get_by_role("button", name="Record", exact=True).click()
    until(lambda: page.locator(".recording .name").count())
    page.keyboard.down("w")
    until(lambda: state_of(page.session).odometry[0] > 0.8)
    page.keyboard.up("w")
    path = run_between_steps(page.session, page.session.recording.view).file
    page.get_by_role("button", name="Stop recording").click()
    until(lambda: run_between_steps(page.session, page.session.recording.view) is None)
    session = played_session(path)
    session.handle(SetLoop(True), 1)  # else it may end and pause before the page is ready
    with serving(session) as address:
        player = open_page(address)
        until(lambda: shown_x(player) > 0.6)
        assert player.title() == f"{Path(path).name} \u00b7 KBot"
        crumbs = [Path(path).name, "Source", "recording"]
        until(lambda: player.locator(".crumbs").inner_text().split() == crumbs)
        assert player.locator(".topbar .status").inner_text() == "connected"
        player.keyboard.press("p")
        until(lambda: session.paused)
        player.keyboard.press("k")
        until(lambda: player.get_by_role("button", name="1 bookmark").is_visible())
        assert "Bookmark 1" in Path(f"{path}.bookmarks.yaml").read_text()
        drag(player, 0.02)
        until(lambda: shown_x(player) < 0.45)
        assert " of " in slider(player).get_attribute("aria-valuetext")
        loop = player.get_by_role("button", name="Loop")
        for is_on in (False, True):
            loop.click()
            until(lambda is_on=is_on: loop.get_attribute("aria-pressed") == str(is_on).lower())
            assert run_between_steps(session, session.timeline).loop is is_on
        assert player.get_by_role("button", name="Record", exact=True).count() == 0
        player.get_by_label("Speed", exact=True).select_option("10")
        player.get_by_role("button", name="Continue").click()
        until(lambda: shown_x(player) > 0.6)
        until(lambda: shown_x(player) < 0.5)  # playback restarted


def test_frames_and_a_scan_are_shown_without_a_robot(open_page: OpenPage, tmp_path: Path) -> None:
    session = played_session(no_robot(tmp_path))
    session.handle(SetLoop(True), 1)
    with serving(session) as address:
        player = open_page(address)
        until(lambda: player.locator(".notice").get_by_text("only frames and sensors are shown").is_visible())
        player.keyboard.press("p")
        until(lambda: session.paused)
        show = Show(player, Speaker(session))
        until(lambda: show.status("LaserScan").startswith("fine: /scan"))
        show.row("TF").locator(".head").click()
        show.row("TF").get_by_text("Tree").click()
        names = show.row("TF").locator(".frames li")
        until(lambda: names.filter(has_text="laser").count())
        assert show.field("TF", "axes").is_checked()
