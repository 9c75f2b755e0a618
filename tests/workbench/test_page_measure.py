"""Measuring as a user does: the distance is shown before the second click, and a step can be undone."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import screenshot
from .test_page_tools import at, from_above

OpenPage = Callable[..., Any]


@pytest.fixture
def page(driving: tuple[str, Session], open_page: OpenPage) -> Any:
    """A page that measures on a floor seen from above."""
    address, session = driving
    session.paused = True
    page = open_page(address)
    from_above(page, "kbot.look([0.5, 0.4999, 3], [0.5, 0.5, 0])")
    page.keyboard.press("m")
    return page


def shown(page: Any) -> list[float]:
    return [float(re.sub(r"[^\d.]", "", text)) for text in page.locator(".measure").all_inner_texts()]


def drawn(page: Any, x: float, y: float) -> bool:
    """Return whether an orange line passes through a place of the floor."""
    box = page.locator(".picture").bounding_box()
    column, row = (round(a - b) for a, b in zip(at(page, x, y), (box["x"], box["y"]), strict=True))
    near = screenshot(page).astype(int)[row - 2 : row + 3, column - 2 : column + 3]
    return bool((near[..., 0] - near[..., 2] > 80).any())


def test_the_distance_is_shown_while_the_pointer_moves(page: Any) -> None:
    page.mouse.click(*at(page, 0.2, 0.6))
    for x in (0.5, 0.8):
        page.mouse.move(*at(page, x, 0.6))
        until(lambda x=x: shown(page) == pytest.approx([x - 0.2], abs=0.01))
        until(lambda x=x: drawn(page, x - 0.06, 0.6))
    assert page.locator(".measure.moving").count() == 1
    page.mouse.click(*at(page, 0.8, 0.6))
    until(lambda: page.locator(".measure.moving").count() == 0)
    page.mouse.move(*at(page, 0.8, 0.2))
    until(lambda: shown(page) == pytest.approx([0.6, 0.4, 90.0], rel=0.02))
    page.mouse.move(*at(page, 0.5, 0.3))
    until(lambda: shown(page) == pytest.approx([0.6, np.hypot(0.3, 0.3), 45.0], rel=0.02))


def test_escape_undoes_one_step_and_then_leaves_the_tool(page: Any) -> None:
    for place in ((0.2, 0.6), (0.8, 0.6), (0.8, 0.2)):
        page.mouse.click(*at(page, *place))
    page.mouse.move(*at(page, 0.8, 0.9))
    until(lambda: shown(page) == pytest.approx([0.6, 0.4, 90.0], rel=0.02))  # the third point is set
    page.keyboard.press("Escape")
    page.mouse.move(*at(page, 0.8, 0.8))
    until(lambda: shown(page) == pytest.approx([0.6, 0.2, 90.0], rel=0.02))  # and can be set again
    page.keyboard.press("Escape")
    page.mouse.move(*at(page, 0.2, 0.9))
    until(lambda: shown(page) == pytest.approx([0.3], rel=0.02))
    page.keyboard.press("Escape")
    until(lambda: shown(page) == [])
    assert page.locator(".hint").is_visible()
    page.keyboard.press("Escape")
    until(lambda: not page.locator(".hint").is_visible())


def test_distances_are_measured_by_keyboard(page: Any) -> None:
    page.locator(".picture canvas").focus()
    page.keyboard.press("Enter")
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    # eighty pixels of the picture, at the scale of the floor in its middle
    metre = at(page, 1.0, 0.5)[0] - at(page, 0.0, 0.5)[0]
    until(lambda: shown(page) == pytest.approx([80 / metre], rel=0.03))
    page.keyboard.press("Enter")
    for _ in range(5):
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    until(lambda: shown(page) == pytest.approx([80 / metre, 40 / metre, 90.0], rel=0.03))
    assert page.locator(".measure.moving").count() == 0
