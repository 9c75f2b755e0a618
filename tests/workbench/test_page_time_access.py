"""Accessibility of timeline, plots and log."""

from collections.abc import Callable
from typing import Any

import pytest

from kbot.workbench.session.session import Session

from .axe import violations
from .conftest import until
from .served import state_of

OpenPage = Callable[..., Any]


@pytest.mark.parametrize(("theme", "size"), [("dark", (1440, 900)), ("light", (390, 844))])
def test_axe_reports_no_violations_while_looking_back(
    driving: tuple[str, Session], open_page: OpenPage, theme: str, size: tuple[int, int]
) -> None:
    page = open_page(
        driving[0],
        viewport={"width": size[0], "height": size[1]},
        color_scheme=theme,
        reduced_motion="reduce",
    )
    until(lambda: state_of(driving[1]).at > 2.0)
    page.keyboard.press("y")
    page.keyboard.press("l")  # a narrow page has room for one panel
    until(lambda: page.locator("#plots canvas").count() == 1)
    page.keyboard.press("k")
    page.get_by_role("slider", name="Time shown").focus()
    for _ in range(5):
        page.keyboard.press("PageDown")
    until(lambda: page.evaluate("document.documentElement.dataset.time === 'past'"))
    until(lambda: page.get_by_role("button", name="Resume from here").is_visible())
    for opened in ("", "Save the plot", "1 bookmark"):
        if opened:
            page.get_by_role("button", name=opened).click()
            until(lambda: page.locator(":popover-open").count() == 1)
        assert violations(page) == []
