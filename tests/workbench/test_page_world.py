"""The world on show: its parameters, what is told of it, and what happens to those in it."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from kbot.workbench.serve import open_session, serving
from kbot.workbench.session import Session

from .conftest import until

OpenPage = Callable[..., Any]


@pytest.fixture
def boxes() -> Iterator[tuple[str, Session]]:
    session = open_session("kbot", simulate=True, world="boxes:count=20")
    with serving(session) as address:
        yield address, session


def test_the_world_menu_has_the_parameters_that_the_run_was_started_with(
    boxes: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(boxes[0])
    menu = page.locator("#world-menu")
    page.get_by_role("button", name="World and faults").click()
    until(lambda: menu.get_by_label("count").input_value() == "20")
    assert menu.get_by_label("spread").input_value() == "1.6"  # as when it is not given
    menu.get_by_label("count").fill("3")
    menu.get_by_role("button", name="Start", exact=True).click()
    until(lambda: len(boxes[1].scene.bodies) == 3)
    until(lambda: menu.get_by_label("count").input_value() == "3")
    page.get_by_label("World", exact=True).select_option("maze")
    until(lambda: menu.get_by_label("size").count() == 1)
    page.get_by_label("World", exact=True).select_option("boxes")
    until(lambda: menu.get_by_label("count").count() == 1)
    assert menu.get_by_label("count").input_value() == "12"


@pytest.mark.parametrize("width", [390, 960, 1280])
def test_what_is_told_covers_no_button(viewing: str, open_page: OpenPage, width: int) -> None:
    page = open_page(viewing, viewport={"width": width, "height": 700})
    sheet = page.locator(".sheets").get_by_role("button", name="Displays")
    if sheet.is_visible():
        sheet.click()
    with page.expect_download():
        page.get_by_label("Settings of the displays").select_option("kbot")
    notice = page.locator(".notices .info")
    until(notice.is_visible)
    box = notice.bounding_box()
    for button in page.locator(".centre button:visible, .centre summary:visible").all():
        other = button.bounding_box()
        apart = any(
            one[along] + one[size] <= two[along]
            for along, size in (("x", "width"), ("y", "height"))
            for one, two in ((box, other), (other, box))
        )
        assert apart, button.get_attribute("aria-label") or button.inner_text()
