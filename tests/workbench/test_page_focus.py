"""Which keys drive and stop, wherever the focus is."""

from collections.abc import Callable
from typing import Any

import pytest

from kbot.workbench.session.session import Session

from .conftest import until

OpenPage = Callable[..., Any]


@pytest.mark.parametrize("focus", ["toggle", "list", "link"])
def test_space_stops_wherever_the_focus_is(
    driving: tuple[str, Session], open_page: OpenPage, focus: str
) -> None:
    address, session = driving
    page = open_page(address)
    place = {"toggle": "[data-option=grid]", "list": "[aria-label=Speed]", "link": "#links button"}[focus]
    page.locator(place).first.focus()
    pressed = page.get_attribute("[data-option=grid]", "aria-pressed")
    page.evaluate("dispatchEvent(new KeyboardEvent('keydown', { code: 'KeyW', key: 'w' }))")
    until(lambda: session.state().command[0] > 0.05)
    page.keyboard.press("Space")
    until(lambda: session.state().command == (0.0, 0.0))
    assert page.get_attribute("[data-option=grid]", "aria-pressed") == pressed


def test_arrows_drive_after_a_click_in_the_tree(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    page.locator("#links button[data-link=base_link]").click()
    page.keyboard.down("ArrowUp")
    until(lambda: session.state().command[0] > 0.05)
    page.keyboard.up("ArrowUp")
    until(lambda: session.state().command == (0.0, 0.0))


def test_arrows_walk_the_tree_for_those_who_came_by_keys(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.locator("#links button[data-link=base_footprint]").focus()
    page.keyboard.press("ArrowDown")
    assert page.evaluate("document.activeElement.dataset.link") == "base_link"


def test_driving_while_paused_says_so(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    page.keyboard.down("w")
    until(lambda: "press P" in page.inner_text(".notices"))
    page.keyboard.up("w")


def test_an_emptied_number_shows_the_joint_again(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    number = page.get_by_label("left_wheel_joint in degrees")
    number.fill("30")
    number.press("Tab")
    until(lambda: number.input_value() == "30.0")
    number.fill("")
    number.press("Tab")
    until(lambda: number.input_value() == "30.0")
