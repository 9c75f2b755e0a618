"""The robot's trail: it ends at the displayed time, and breaks where the robot did not drive."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import pixels_per_metre, screenshot
from .served import do, state_of
from .test_page_time import drag, is_past, page, settled, shown_x

__all__ = ["page"]

OpenPage = Callable[..., Any]


def trail_ends(page: Any) -> float:
    """Return x in m of the trail's visible end from above, or -inf if none is visible."""
    with_trail = screenshot(page).astype(int)
    page.keyboard.press("7")
    changed = np.abs(screenshot(page).astype(int) - with_trail).sum(axis=2) > 60
    page.keyboard.press("7")
    height, width = changed.shape
    columns = np.nonzero(changed[height // 2 - 20 : height // 2 + 20].any(axis=0))[0]
    return float((columns.max() - width / 2) / pixels_per_metre(page)) if columns.size else float("-inf")


def test_the_trail_ends_at_the_displayed_robot(page: Any) -> None:
    page.keyboard.press("8")  # the view does not follow
    page.evaluate("kbot.look([0, -0.001, 1.6], [0, 0, 0])")
    until(lambda: trail_ends(page) > 0.15)  # behind the robot, which hides its last part
    drag(page, 0.05)
    settled(page)
    until(lambda: shown_x(page) < 0.1 and trail_ends(page) < shown_x(page) + 0.01)
    page.get_by_role("button", name="Live").click()
    until(lambda: not is_past(page) and trail_ends(page) > 0.15)


@pytest.mark.parametrize("which", ["the page that saw it", "one that came later"])
def test_the_trail_breaks_where_the_robot_was_moved(
    page: Any, driving: tuple[str, Session], open_page: OpenPage, which: str
) -> None:
    """Driven from x=0 to 0.3, moved to y=0.4, and driven on: nothing is drawn between the two parts."""
    do(page.session, lambda motion: motion._sim.models.set_pose(0.3, 0.4, 0.0))
    page.keyboard.down("w")
    until(lambda: state_of(page.session).poses[0] > 0.6)
    page.keyboard.up("w")
    until(lambda: state_of(page.session).command == (0.0, 0.0) and state_of(page.session).twist[0] < 1e-3)
    shown = page if which == "the page that saw it" else open_page(driving[0])
    shown.keyboard.press("8")  # the view does not follow
    shown.evaluate("kbot.look([0.3, 0.199, 1.6], [0.3, 0.2, 0])")
    until(lambda: trail_at(shown, 0.1, 0.0) > 0 and trail_at(shown, 0.4, 0.4) > 0)
    assert sum(trail_at(shown, 0.3, y) for y in (0.1, 0.2, 0.3)) == 0


def trail_at(page: Any, x: float, y: float) -> int:
    """Return the number of pixels that the trail changes within 2 cm of a place on the ground."""
    with_trail = screenshot(page).astype(int)
    page.keyboard.press("7")
    changed = np.abs(screenshot(page).astype(int) - with_trail).sum(axis=2) > 60
    page.keyboard.press("7")
    clip = np.array(page.evaluate("kbot.camera().clipFromWorld")).reshape(4, 4) @ (x, y, 0.0, 1.0)
    height, width = changed.shape
    column, row = (clip[0] / clip[3] + 1) / 2 * width, (1 - clip[1] / clip[3]) / 2 * height
    reach = round(0.02 * pixels_per_metre(page))
    return int(changed[int(row) - reach : int(row) + reach, int(column) - reach : int(column) + reach].sum())


def test_a_new_tab_shows_the_whole_trail(
    page: Any, driving: tuple[str, Session], open_page: OpenPage
) -> None:
    other = open_page(driving[0])
    other.keyboard.press("8")  # the view does not follow
    other.evaluate("kbot.look([0, -0.001, 1.6], [0, 0, 0])")
    until(lambda: trail_ends(other) > 0.15)
    drag(other, 0.05)
    until(lambda: is_past(other) and shown_x(other) < 0.1 and trail_ends(other) < shown_x(other) + 0.01)


BLOCK = "setTimeout(() => { const end = Date.now() + 4000; while (Date.now() < end); })"


@pytest.mark.parametrize("view", ["busy", "past"])
def test_a_path_that_the_page_did_not_receive_is_drawn(
    driving: tuple[str, Session], open_page: OpenPage, view: str
) -> None:
    """The robot drives half a circle while the page is busy or displays the past."""
    address, session = driving
    page = open_page(address)
    page.keyboard.press("8")  # the view does not follow
    page.evaluate("kbot.look([0, 0.199, 1.6], [0, 0.2, 0])")
    do(session, lambda motion: motion._sim.cmd_vel(0.3, 1.5))
    until(lambda: trail_ends(page) > 0.05)
    if view == "busy":
        page.evaluate(BLOCK)
    else:
        drag(page, 0.05)
        until(lambda: is_past(page))
    before = state_of(session)
    until(lambda: state_of(session).at > before.at + 0.8)
    middle = state_of(session).poses
    until(lambda: state_of(session).at > before.at + 2.0)
    do(session, lambda motion: motion._sim.cmd_vel(0.0, 0.0))
    if view == "past":
        page.get_by_role("button", name="Live").click()
    until(lambda: not is_past(page) and abs(shown_x(page) - state_of(session).poses[0]) < 0.01)
    until(lambda: trail_at(page, middle[0], middle[1]) > 0, 10.0)
