"""What tools do, by pixels: moved objects and a published point."""

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import blue, middle, screenshot
from .served import state_of
from .test_page_tools import at, drag, from_above, tool, wait_for_current_picture

OpenPage = Callable[..., Any]
ABOVE = "kbot.look([0.2, 0.1999, 3], [0.2, 0.2, 0])"


def on_picture(page: Any, x: float, y: float, z: float = 0.0) -> np.ndarray:
    """Return column and row of a place of the world in a screenshot."""
    box = page.locator(".picture").bounding_box()
    return np.array(at(page, x, y, z)) - (box["x"], box["y"])


def test_a_moved_robot_is_drawn_at_its_new_place(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    from_above(page, ABOVE)
    before = np.array(middle(blue(screenshot(page))))
    page.keyboard.press("v")
    drag(page, at(page, 0.0, 0.0, 0.05), at(page, 0.4, 0.3, 0.05))
    wanted = before + on_picture(page, 0.4, 0.3, 0.05) - on_picture(page, 0.0, 0.0, 0.05)
    assert np.linalg.norm(wanted - before) > 30
    until(lambda: np.linalg.norm(middle(blue(screenshot(page))) - wanted) < 3)


def test_a_moved_object_is_drawn_at_its_new_place(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    from_above(page, ABOVE)
    empty = screenshot(page).astype(int)
    page.keyboard.press("b")
    page.get_by_label("What to add").select_option("crate")
    page.mouse.click(*at(page, 0.5, 0.0))

    def looks_empty(x: float, y: float) -> bool:
        column, row = on_picture(page, x, y, 0.2).round().astype(int)
        near = np.s_[row - 3 : row + 4, column - 3 : column + 4]
        return bool(np.abs(screenshot(page).astype(int)[near] - empty[near]).max() < 40)

    until(lambda: not looks_empty(0.5, 0.0) and looks_empty(0.5, 0.6))
    until(lambda: abs(state_of(session).bodies[2]) < 1e-3)
    page.keyboard.press("v")
    wait_for_current_picture(page, session)
    drag(page, at(page, 0.5, 0.0, 0.3), at(page, 0.5, 0.6, 0.3))
    until(lambda: looks_empty(0.5, 0.0) and not looks_empty(0.5, 0.6))


def test_a_published_point_is_drawn_where_it_was_clicked(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    session.paused = True
    page = open_page(address, color_scheme="dark")
    from_above(page, ABOVE)
    page.get_by_label("Add a display").select_option("PointStamped")
    row = page.locator(".display[data-display=PointStamped]")
    row.locator("[data-property=colour] input").first.fill("#ff00ff")
    row.locator("[data-property=radius] input").first.fill("0.05")
    page.keyboard.press("Tab")

    def ball() -> np.ndarray:
        r, g, b = (screenshot(page)[..., i].astype(int) for i in range(3))
        rows, columns = np.nonzero((r > g + 60) & (b > g + 60))
        return np.array([columns.mean(), rows.mean()]) if len(rows) > 20 else np.full(2, np.inf)

    until(
        lambda: (
            "no message received on /clicked_point" in str(row.locator(".lamp").get_attribute("aria-label"))
        )
    )
    for place in ((0.4, 0.5), (-0.2, 0.3)):
        tool(page, "Publish point").click()
        page.mouse.click(*at(page, *place))
        until(lambda place=place: np.linalg.norm(ball() - on_picture(page, *place)) < 3)
    until(lambda: "clicked_point: -0.2" in page.locator(".notices").inner_text())
