"""Orthographic views from above and from the sides, which are kept."""

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.workbench.session.session import Session

from .conftest import until
from .served import state_of

OpenPage = Callable[..., Any]


def clip(page: Any) -> np.ndarray:
    page.evaluate("kbot.drawn()")
    return np.array(page.evaluate("kbot.camera()")["clipFromWorld"]).reshape(4, 4)


def ahead(page: Any) -> np.ndarray:
    """Return the unit vector of the world along which the page looks in an orthographic view."""
    direction = clip(page)[2, :3]
    return np.asarray(direction / np.linalg.norm(direction))


def shown_in(page: Any) -> float:
    """Return pixels per metre across the view."""
    return float(np.linalg.norm(clip(page)[0, :3]) / 2 * page.evaluate("kbot.camera().width"))


def view(page: Any, name: str) -> Any:
    return page.get_by_role("toolbar", name="View").get_by_role("button", name=name, exact=True)


def drag(page: Any, dx: float, dy: float) -> None:
    box = page.locator(".picture canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + 60
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + dx, y + dy, steps=5)
    page.mouse.up()


def has_perspective(page: Any) -> bool:
    return not np.allclose(clip(page)[3], (0, 0, 0, 1))


def test_the_view_from_above_turns_only_about_the_vertical(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    view(page, "Top").click()
    until(lambda: not has_perspective(page))
    assert view(page, "Top").get_attribute("aria-pressed") == "true"
    assert np.allclose(ahead(page), (0, 0, -1), atol=2e-3)
    right = clip(page)[0, :2]
    assert right[0] > 0
    assert abs(right[1]) < 1e-3 * right[0]  # x points right, y up
    drag(page, 90, 70)
    until(lambda: abs(clip(page)[0, 1]) > 0.2 * abs(clip(page)[0, 0]))
    assert np.allclose(ahead(page), (0, 0, -1), atol=2e-3)


def test_a_drag_does_not_turn_a_side_view(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    for name, direction in (("Front", (-1, 0, 0)), ("Side", (0, 1, 0))):
        view(page, name).click()
        until(lambda direction=direction: np.allclose(ahead(page), direction, atol=1e-6))
        before = clip(page)[:2, 3]
        drag(page, 60, 40)
        until(lambda before=before: np.abs(clip(page)[:2, 3] - before).min() > 0.05)  # the view was moved
        assert np.allclose(ahead(page), direction, atol=1e-6)
        assert not has_perspective(page)


def test_a_side_view_is_left_like_it_was_entered(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    aslant = clip(page)
    view(page, "Top").click()
    until(lambda: not has_perspective(page))
    view(page, "Top").click()
    until(lambda: np.allclose(clip(page), aslant, atol=1e-6))
    view(page, "Side").click()
    until(lambda: not has_perspective(page))
    page.keyboard.press("o")  # a view with perspective is not a side view any more
    until(lambda: has_perspective(page))
    assert view(page, "Side").get_attribute("aria-pressed") == "false"
    before = clip(page)
    drag(page, 60, 40)
    until(lambda: abs(clip(page)[3, 2] - before[3, 2]) > 0.05)  # the view can be turned again


def test_the_address_stores_side_view_and_zoom(driving: tuple[str, Session], open_page: OpenPage) -> None:
    driving[1].paused = True
    page = open_page(driving[0])
    view(page, "Top").click()
    until(lambda: page.url.endswith("&flat"))
    far = shown_in(page)
    drag(page, 90, 0)
    page.mouse.wheel(0, -500)
    until(lambda: shown_in(page) > 1.2 * far)
    other = open_page(until(lambda: settled(page)))
    until(lambda: np.allclose(clip(other)[:2], clip(page)[:2], rtol=1e-3, atol=2e-3))
    assert view(other, "Top").get_attribute("aria-pressed") == "true"
    drag(other, 50, 70)
    assert np.allclose(ahead(other), (0, 0, -1), atol=2e-3)


def test_the_view_is_turned_moved_and_zoomed_by_keyboard(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(driving[0])
    page.keyboard.press("8")  # the view does not follow
    page.keyboard.press("o")
    until(lambda: not has_perspective(page))
    before = ahead(page)
    for _ in range(6):
        page.keyboard.press("Shift+ArrowRight")
    # six steps of five degrees about the vertical
    until(lambda: np.isclose(np.degrees(angle(ahead(page)) - angle(before)) % 360, 30, atol=0.1))
    for _ in range(3):
        page.keyboard.press("Shift+ArrowUp")
    until(lambda: np.isclose(np.degrees(np.arcsin(before[2]) - np.arcsin(ahead(page)[2])), 15, atol=0.1))
    size = shown_in(page)
    page.keyboard.press("+")
    until(lambda: np.isclose(shown_in(page), 1.1 * size, rtol=1e-3))
    page.keyboard.press("-")
    until(lambda: np.isclose(shown_in(page), size, rtol=1e-3))
    place = clip(page)[:2, 3]
    page.keyboard.press("Control+ArrowUp")
    # a twentieth of the picture's height, which is 2 in clip space
    until(lambda: np.allclose(clip(page)[:2, 3] - place, (0, -0.1), atol=2e-3))
    assert state_of(driving[1]).command == (0.0, 0.0)  # the robot was not driven


def settled(page: Any) -> str:
    """Return the address once neither it nor the view changes any more, otherwise an empty string."""
    address, seen = page.url, clip(page)
    page.wait_for_timeout(300)
    return address if address == page.url and np.allclose(seen, clip(page), atol=1e-4) else ""


def angle(direction: np.ndarray) -> float:
    return float(np.arctan2(direction[1], direction[0]))
