"""Plots and time in the page: the past, seeking, zooming and saving."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.workbench.session.session import Session

from .conftest import until, wait_for_page
from .served import state_of
from .test_plot import points, ticks

OpenPage = Callable[..., Any]

WIDE = {"width": 1280, "height": 800}

CSV = """async () => {
  const { createObjectURL } = URL;
  let file;
  URL.createObjectURL = (blob) => ((file = blob), "");
  HTMLAnchorElement.prototype.click = () => undefined;
  try {
    const items = [...document.querySelectorAll("#plot-save button")];
    items.find((item) => item.textContent === "Save as CSV").click();
    return await file.text();
  } finally {
    URL.createObjectURL = createObjectURL;
    delete HTMLAnchorElement.prototype.click;
  }
}"""
"""The text that the page would save. Chromium refuses downloads once a page saved about 20 within seconds,
which is fewer than a test that waits for its rows may need."""


@pytest.fixture
def page(driving: tuple[str, Session], open_page: OpenPage) -> Any:
    """A page of a robot that drove and stopped while its plots were closed."""
    address, session = driving
    page = open_page(address, viewport=WIDE)
    page.session = session
    page.began = until(lambda: page.evaluate("kbot.time"))
    page.keyboard.down("w")
    until(lambda: state_of(session).odometry[0] > 0.3)
    page.keyboard.up("w")
    until(lambda: state_of(session).twist[0] == 0.0)
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    open_plots(page)
    return page


def open_plots(page: Any) -> None:
    page.keyboard.press("l")
    until(lambda: page.locator("#plots canvas").count() == 1)


def save(page: Any, kind: str) -> str:
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save the plot").click()
        page.get_by_role("button", name=f"Save as {kind}").click()
    assert saved.value.suggested_filename == f"kbot-plot.{kind.lower()}"
    return str(saved.value.path().read_text())


def table(page: Any) -> np.ndarray:
    """Return the displayed rows, with the time first."""
    lines = page.evaluate(CSV).splitlines()[1:]
    return np.array([[float(cell) for cell in line.split(",")] for line in lines])


def once(page: Any, holds: Callable[[np.ndarray], Any]) -> np.ndarray:
    """Return the displayed rows once a condition holds for them."""
    found: list[np.ndarray] = []

    def look() -> bool:
        found[:] = [table(page)]
        return len(found[0]) > 0 and bool(holds(found[0]))

    until(look)
    return found[0]


def shown(page: Any, first: float) -> np.ndarray:
    """Return the displayed rows once they start early enough."""
    return once(page, lambda rows: rows[0, 0] <= first)


def plot(page: Any) -> dict[str, float]:
    return dict(page.locator("#plots .u-over").bounding_box())


def click(page: Any, part: float) -> None:
    box = plot(page)
    page.mouse.click(box["x"] + box["width"] * part, box["y"] + box["height"] / 2)


def drag(page: Any, start: float, end: float) -> None:
    box = plot(page)
    page.mouse.move(box["x"] + box["width"] * start, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * end, box["y"] + box["height"] / 2, steps=5)
    page.mouse.up()


def line(page: Any) -> Any:
    return page.get_by_role("slider", name="Time in the plot")


def at_line(page: Any) -> float:
    """Return the time of the cursor, in s on the timeline."""
    return float(line(page).get_attribute("aria-valuenow"))


def is_past(page: Any) -> bool:
    return bool(page.evaluate("document.documentElement.dataset.time === 'past'"))


def test_plots_show_values_from_before_they_were_opened(page: Any) -> None:
    rows = shown(page, page.began + 0.2)
    assert rows[:, 1].max() > 0.2  # it drove while the plots were closed
    assert rows[-1, 0] == pytest.approx(state_of(page.session).time, abs=0.1)
    assert (np.diff(rows[:, 0]) > 0).all()
    way = float(np.trapezoid(rows[:, 1], rows[:, 0]))
    assert way == pytest.approx(state_of(page.session).odometry[0], abs=0.02)


def test_plots_show_values_from_while_no_page_was_open(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address, viewport=WIDE)
    page.goto("about:blank")
    left = state_of(session).time
    until(lambda: state_of(session).time > left + 4.0)
    page.goto(address)
    wait_for_page(page)
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    open_plots(page)
    page.get_by_label("Time span").select_option("all")  # however long the page took to load
    rows = once(page, lambda rows: rows[0, 0] < left + 0.5 and rows[-1, 0] > left + 4.0)
    assert np.diff(rows[:, 0]).max() < 0.5
    assert rows[-1, 0] == pytest.approx(state_of(session).at, abs=0.1)  # without a reset there is one clock


def test_plotted_topic_values_survive_closing_the_page(page: Any) -> None:
    name = "/odom twist.twist.linear.x"
    page.keyboard.press("y")
    page.locator("[data-topic='/odom'] .head").click()
    page.keyboard.press("p")  # so that it publishes
    field = page.locator("[data-topic='/odom']").get_by_role("button", name="twist.twist.linear.x")
    until(field.count)
    field.click()
    until(lambda: page.get_by_role("button", name=name).count() == 1)
    page.reload()
    wait_for_page(page)
    received = page.session.topics._wanted
    until(lambda: "/odom" not in received)  # no page subscribes to it
    open_plots(page)
    until(lambda: "/odom" in received)
    page.get_by_role("button", name=name).click()
    until(lambda: "/odom" not in received)


def test_more_curves_than_colours_are_distinct(page: Any) -> None:
    chips = page.locator("#plots .chip")
    add = page.get_by_label("Plot another field")
    for field in ("x", "y", "yaw", "left_wheel_joint", "right_wheel_joint", "commanded turning speed"):
        before = chips.count()
        add.select_option(field)
        until(lambda before=before: chips.count() == before + 1)
    assert chips.count() == 9
    assert page.locator("#plots .chip.dashed").count() == 3
    rows = shown(page, page.began + 0.2)
    assert rows.shape[1] == 10


def test_a_click_seeks_and_moves_the_cursor(page: Any) -> None:
    rows = shown(page, page.began + 0.2)
    click(page, 0.5)
    middle = (rows[0, 0] + rows[-1, 0]) / 2
    until(lambda: is_past(page) and abs(page.evaluate("kbot.time") - middle) < 0.15)
    box = plot(page)
    until(lambda: abs(line(page).bounding_box()["x"] - box["x"] - box["width"] / 2) < 6)
    then = page.evaluate("kbot.time")
    x = line(page).bounding_box()["x"]
    page.mouse.move(x, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(x + box["width"] * 0.2, box["y"] + 20, steps=4)
    page.mouse.up()
    wanted = then + 0.2 * (rows[-1, 0] - rows[0, 0])
    until(lambda: abs(page.evaluate("kbot.time") - wanted) < 0.15)
    assert table(page)[0, 0] == rows[0, 0]  # dragging the cursor does not zoom
    page.keyboard.press("Escape")
    until(lambda: not is_past(page))


def test_a_drag_zooms_and_a_double_click_resets_the_zoom(page: Any) -> None:
    rows = shown(page, page.began + 0.2)
    drag(page, 0.25, 0.75)
    length = rows[-1, 0] - rows[0, 0]
    until(lambda: abs(np.ptp(table(page)[:, 0]) - length / 2) < 0.2)
    assert not is_past(page)
    assert table(page)[0, 0] == pytest.approx(rows[0, 0] + length / 4, abs=0.1)
    box = plot(page)
    page.mouse.dblclick(box["x"] + box["width"] / 2, box["y"] + 20)
    until(lambda: abs(np.ptp(table(page)[:, 0]) - length) < 0.1)
    until(lambda: not is_past(page))  # a double click is not a click


def test_keys_navigate_the_plot(page: Any) -> None:
    rows = shown(page, page.began + 0.2)
    line(page).focus()
    page.keyboard.press("Home")
    until(lambda: is_past(page) and abs(page.evaluate("kbot.time") - rows[0, 0]) < 0.1)
    page.keyboard.press("PageUp")
    until(lambda: page.evaluate("kbot.time") > rows[0, 0] + 0.05 * np.ptp(rows[:, 0]))
    until(lambda: 0.05 * np.ptp(rows[:, 0]) < at_line(page) < 0.5 * np.ptp(rows[:, 0]))
    before = at_line(page)
    page.keyboard.press("ArrowLeft")  # possibly not as far as the previous state
    until(lambda: at_line(page) < before)
    page.keyboard.press("End")
    until(lambda: not is_past(page))
    for _ in range(4):
        page.keyboard.press("+")
    page.keyboard.press("ArrowLeft")  # by a hundredth of the displayed range
    until(lambda: is_past(page))
    page.keyboard.press("0")
    until(lambda: abs(np.ptp(table(page)[:, 0]) - np.ptp(rows[:, 0])) < 0.1)
    line(page).focus()
    page.keyboard.press("+")
    until(lambda: np.ptp(table(page)[:, 0]) < 0.6 * np.ptp(rows[:, 0]))
    line(page).focus()
    page.keyboard.press("0")
    until(lambda: abs(np.ptp(table(page)[:, 0]) - np.ptp(rows[:, 0])) < 0.1)
    until(lambda: line(page).get_attribute("aria-valuetext") == f"{page.evaluate('kbot.time'):.2f} s")


def test_a_reset_of_time_is_marked(page: Any) -> None:
    shown(page, page.began + 0.2)
    marks = page.locator("#plots .jump")
    assert marks.count() == 0
    page.keyboard.press("r")
    until(lambda: page.evaluate("kbot.time") < 0.1)  # the past before a reset is not displayed
    page.keyboard.press("p")
    until(lambda: state_of(page.session).time > 0.5 and page.inner_text(".rate") != "paused")
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    until(lambda: marks.count() == 1)
    rows = once(page, lambda reported: (np.diff(reported[:, 0]) < 0).sum() == 1 and reported[-1, 0] > 0.5)
    first = 1 + int(np.diff(rows[:, 0]).argmin())
    assert marks.inner_text() == f"\u2192 {rows[first, 0]:.2f} s"
    before = rows[first - 1, 0] - rows[0, 0]
    after = rows[-1, 0] - rows[first, 0]
    whole = page.locator("#plots .u-over").bounding_box()
    box = until(marks.bounding_box)  # None while it is redrawn
    assert box["y"] + 15 <= whole["y"] + 1  # its label is above the curves
    part = (box["x"] - whole["x"]) / whole["width"]
    assert part == pytest.approx(before / (before + after), abs=0.03)


def test_cursor_and_values_belong_to_the_displayed_time(page: Any) -> None:
    rows = shown(page, page.began + 0.2)
    fastest = int(rows[:, 1].argmax())
    click(page, (rows[fastest, 0] - rows[0, 0]) / np.ptp(rows[:, 0]))
    until(lambda: is_past(page))
    page.mouse.move(5, 5)
    value = page.locator("#plots .chip .value").first
    until(lambda: value.inner_text() and abs(float(value.inner_text()) - rows[fastest, 1]) < 0.05)


def test_the_plot_is_saved_as_a_drawing(page: Any) -> None:
    rows = shown(page, page.began + 0.2)
    svg = save(page, "SVG")
    drawn = points(svg, "forward speed [m/s]")
    numbers, places = ticks(svg, "x")
    slope, start = np.polyfit(numbers, places, 1)
    assert (drawn[-1, 0] - start) / slope == pytest.approx(rows[-1, 0], abs=0.1)
    numbers, places = ticks(svg, "y")
    slope, start = np.polyfit(numbers, places, 1)
    assert ((drawn[:, 1] - start) / slope).max() == pytest.approx(rows[:, 1].max(), abs=0.01)
    assert re.search(r'id="turning speed \[rad/s\]"', svg)


def test_a_reset_does_not_end_the_plot(page: Any) -> None:
    before = shown(page, page.began + 0.2)
    page.keyboard.press("r")
    until(lambda: page.evaluate("kbot.time") == 0.0)
    page.keyboard.press("p")
    until(lambda: 1.0 < state_of(page.session).time < before[-1, 0])
    rows = once(page, lambda rows: (np.diff(rows[:, 0]) < 0).any())
    turn = int(np.argmin(np.diff(rows[:, 0])))
    assert rows[: turn + 1, 1].max() == pytest.approx(before[:, 1].max(), abs=1e-3)
    assert rows[turn + 1, 0] < 0.2
