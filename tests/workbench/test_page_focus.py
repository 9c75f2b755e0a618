"""Which keys drive and stop, wherever the focus is."""

from collections.abc import Callable
from typing import Any

import pytest

from kbot.workbench.session.session import Session

from .conftest import until
from .displayed import state_of

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
    until(lambda: state_of(session).command[0] > 0.05)
    page.keyboard.press("Space")
    until(lambda: state_of(session).command == (0.0, 0.0))
    assert page.get_attribute("[data-option=grid]", "aria-pressed") == pressed


def test_arrows_drive_after_a_click_in_the_tree(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    page.locator("#links button[data-link=base_link]").click()
    page.keyboard.down("ArrowUp")
    until(lambda: state_of(session).command[0] > 0.05)
    page.keyboard.up("ArrowUp")
    until(lambda: state_of(session).command == (0.0, 0.0))


def test_arrows_walk_the_tree_for_those_who_came_by_keys(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.locator("#links button[data-link=base_footprint]").focus()
    page.keyboard.press("ArrowDown")
    assert page.evaluate("document.activeElement.dataset.link") == "base_link"


def test_sliders_and_lists_keep_the_focus_of_those_who_came_by_keys(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address)
    page.keyboard.press("Tab")
    limit = page.get_by_label("Speed limit in percent")
    limit.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    assert limit.input_value() == "75"  # from 60 in steps of 5
    size = page.get_by_label("base_len", exact=True)
    size.focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    # a hundredth of its range, from 0 to twice the 0.16 that are written, each
    number = page.get_by_label("base_len, as a number")
    until(lambda: float(number.input_value()) == pytest.approx(0.176))
    speed = page.get_by_label("Speed", exact=True)
    speed.focus()
    for _ in range(2):
        page.keyboard.press("ArrowDown")
    until(lambda: state_of(session).speed == 5.0)


def test_a_slider_that_was_dragged_leaves_the_keys_with_the_robot(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address)
    limit = page.get_by_label("Speed limit in percent")
    box = limit.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.7, box["y"] - 40)
    page.mouse.up()
    until(lambda: page.evaluate("document.activeElement === document.body"))
    limited = limit.input_value()
    page.keyboard.down("ArrowUp")
    until(lambda: state_of(session).command[0] > 0.05)
    page.keyboard.up("ArrowUp")
    assert limit.input_value() == limited


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
