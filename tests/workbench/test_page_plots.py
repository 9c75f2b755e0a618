"""Plots of what the robot does."""

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.workbench.session.session import Session

from .conftest import until, wait_for_page
from .pictures import decode_png

OpenPage = Callable[..., Any]
X = "[aria-label=Odometry] [data-reading=x]"


def test_fields_are_selected_plotted_and_saved(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 1280, "height": 720}, color_scheme="dark")
    page.keyboard.press("l")
    until(lambda: page.locator("#plots canvas").count() == 1)
    add = page.get_by_label("Plot another field")
    add.select_option("left_wheel_joint")
    assert page.locator("#plots .chip").count() == 4
    page.get_by_title("Remove turning speed").click()
    assert page.locator("#plots .chip").count() == 3
    flat = decode_png(page.locator("#plots canvas").screenshot())
    page.keyboard.down("w")
    until(lambda: float(page.inner_text(X).replace("\u2212", "-")) > 0.15)
    page.keyboard.up("w")
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    assert share_of_green(flat) < 0.1
    until(lambda: share_of_green(decode_png(page.locator("#plots canvas").screenshot())) > 0.3)
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save the plot").click()
        page.get_by_role("button", name="Save as CSV").click()
    lines = saved.value.path().read_text().splitlines()
    assert (
        lines[0]
        == '"time [s]","forward speed [m/s]","commanded forward speed [m/s]","left_wheel_joint [rad]"'
    )
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert (np.diff(table[:, 0]) > 0).all()
    x = float(page.inner_text(X).replace("\u2212", "-"))
    assert abs(table[-1, 3] * 0.035 - x) < 0.01
    page.reload()
    wait_for_page(page)
    page.keyboard.press("l")
    until(lambda: page.locator("#plots .chip").count() == 3)


def share_of_green(image: np.ndarray) -> float:
    """Return the share of a plot's height that its third curve covers, here the wheel's angle."""
    rows = np.nonzero((image[..., 1] > 150) & (image[..., 0] < 130))[0]
    return float(np.ptp(rows)) / image.shape[0] if len(rows) else 0.0
