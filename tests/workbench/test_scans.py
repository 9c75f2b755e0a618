"""Laser scans in the page."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from kbot.workbench.serve import open_session, serving

from .conftest import until
from .pictures import screenshot

OpenPage = Callable[..., Any]

LIDAR = {"lidar": "true"}


def test_scan_points_are_in_the_picture(xacro: Path, open_page: OpenPage) -> None:
    with serving(open_session(str(xacro), simulate=True, world="boxes", arguments=LIDAR)) as address:
        page = open_page(address)
        page.evaluate("kbot.look([0, -0.01, 5], [0, 0, 0])")
        button = page.locator("[data-option=scan]")
        until(button.is_visible)
        until(lambda: red(page) > 60)
        button.click()
        until(lambda: red(page) == 0)


def red(page: Any) -> int:
    r, g, b = (screenshot(page)[..., i].astype(int) for i in range(3))
    return int(((abs(r - 255) < 8) & (abs(g - 77) < 12) & (abs(b - 109) < 12)).sum())
