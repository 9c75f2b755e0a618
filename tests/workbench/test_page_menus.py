"""Menus and dialogs by keyboard: without violations for axe, and not wider than the page."""

from collections.abc import Callable
from typing import Any

import pytest

from kbot.workbench.session.session import Session

from .axe import violations
from .conftest import until

OpenPage = Callable[..., Any]

SIZES = {"wide": (1440, 900, "dark"), "phone": (390, 844, "light"), "zoomed": (640, 400, "dark")}
"""Width, height and theme; a page of 1280 by 800 at 200 % is the last."""
AGAIN = "document.activeElement.blur()"


def world_menu(page: Any) -> str:
    page.get_by_role("button", name="World and faults").press("Enter")
    page.get_by_role("button", name="Inject").press("Enter")
    return "#world-menu:has(.faults li)"


def keys(page: Any) -> str:
    page.keyboard.press("?")
    return "dialog.help"


def traffic(page: Any) -> str:
    page.keyboard.press("y")
    return "#traffic:has(.topics li)"


def plots(page: Any) -> str:
    page.keyboard.press("l")
    return "#plots"


def saving(page: Any) -> str:
    page.locator(".save-menu summary").press("Enter")
    return ".save-menu[open]"


def bookmarks(page: Any) -> str:
    page.keyboard.press("k")
    until(lambda: page.locator(".marked").inner_text() == "1")  # the server has received it
    page.locator(".marked").press("Enter")
    return ".timeline:has(:popover-open)"


def settings(page: Any) -> str:
    sheet = page.locator(".sheets").get_by_role("button", name="Displays")
    if sheet.is_visible():
        sheet.press("Enter")
    for head in page.locator(".display .head").all():
        head.press("Enter")
    page.locator(".display[data-display=TF] details summary").press("Enter")
    return "#displays:has(.folded li)"


def tool(page: Any) -> str:
    page.keyboard.press("n")
    return ".chip-bars:has(.hint .tool-options)"


OPENERS = (world_menu, keys, traffic, plots, saving, bookmarks, settings, tool)


@pytest.mark.parametrize("size", SIZES)
def test_axe_reports_no_violations_in_menus(
    driving: tuple[str, Session], open_page: OpenPage, size: str
) -> None:
    width, height, theme = SIZES[size]
    page = open_page(
        driving[0],
        viewport={"width": width, "height": height},
        color_scheme=theme,
        reduced_motion="reduce",
    )
    found = {}
    for opener in OPENERS:
        opened = opener(page)
        until(lambda opened=opened: page.locator(opened).first.is_visible())
        name = opener.__name__
        if wrong := violations(page, opened):
            found[name] = wrong
        if page.evaluate("document.documentElement.scrollWidth") > width:
            found[name] = [("serious", "wider than the page", "")]
        page.keyboard.press("Escape")
        page.keyboard.press("Escape")
        page.evaluate(AGAIN)
    assert found == {}


def test_the_tree_of_links_is_navigated_by_keyboard(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    for _ in range(80):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.dataset.link ?? ''"):
            break

    def on() -> str:
        return str(page.evaluate("document.activeElement.dataset.link"))

    assert on() == "base_footprint"
    for key, link in (
        ("ArrowRight", "base_link"),
        ("ArrowRight", "left_wheel"),
        ("ArrowRight", "left_wheel"),  # it has no children
        ("ArrowDown", "right_wheel"),
        ("ArrowLeft", "base_link"),
        ("End", "caster_wheel"),
        ("ArrowUp", "right_wheel"),
        ("Home", "base_footprint"),
    ):
        page.keyboard.press(key)
        assert on() == link, key
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    until(lambda: page.locator("#links [aria-selected=true]").count() == 1)
    assert page.locator("#links [aria-selected=true]").inner_text().startswith("base_link")


def test_the_save_menu_closes_for_every_focus(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    for leave in (lambda: page.keyboard.press("Escape"), lambda: page.mouse.click(480, 500)):
        page.locator(".save-menu summary").click()
        until(lambda: page.locator(".save-sheet").is_visible())
        leave()
        until(lambda: not page.locator(".save-sheet").is_visible())
