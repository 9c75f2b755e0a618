"""Plots of what the robot does."""

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.workbench.session import Session

from .conftest import until
from .pictures import decode_png

OpenPage = Callable[..., Any]


def test_fields_are_plotted_chosen_and_saved(driving: tuple[str, Session], open_page: OpenPage) -> None:
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
    until(lambda: float(page.inner_text("[data-reading=x]").replace("\u2212", "-")) > 0.15)
    page.keyboard.up("w")
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    risen = decode_png(page.locator("#plots canvas").screenshot())
    green = (risen[..., 1] > 150) & (risen[..., 0] < 130)  # the third line is the wheel's angle
    rows = np.nonzero(green)[0]
    assert rows.max() - rows.min() > 0.3 * risen.shape[0]
    assert not np.array_equal(flat, risen)
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save the plot").click()
        page.get_by_role("button", name="Save as CSV").click()
    lines = saved.value.path().read_text().splitlines()
    assert lines[0] == '"time [s]","forward speed [m/s]","forward speed asked [m/s]","left_wheel_joint [rad]"'
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert (np.diff(table[:, 0]) > 0).all()
    x = float(page.inner_text("[data-reading=x]").replace("\u2212", "-"))
    assert abs(table[-1, 3] * 0.035 - x) < 0.01
    page.reload()
    until(lambda: page.evaluate("!!window.kbot && kbot.revision > 0"))
    page.keyboard.press("l")
    until(lambda: page.locator("#plots .chip").count() == 3)
