"""Pushes, kicks and faults as a user gives them: by dragging, by fields, by keyboard."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import blue, middle, screenshot
from .served import run_between_steps, state_of
from .test_page_tools import at, drag, from_above, pose, tool, wait_for_current_picture

OpenPage = Callable[..., Any]
ABOVE = "kbot.look([0, -0.001, 3], [0, 0, 0])"


def strength(page: Any) -> Any:
    return page.locator(".hint").get_by_label("Strength")


def menu(page: Any) -> Any:
    page.get_by_role("button", name="World and faults").click()
    return page.get_by_role("dialog", name="World and faults")


@pytest.mark.parametrize(("end", "direction"), [((0.0, 0.5), (0, 1)), ((-0.4, -0.4), (-1, -1))])
def test_the_robot_is_pushed_in_the_direction_of_the_drag(
    driving: tuple[str, Session], open_page: OpenPage, end: tuple[float, float], direction: tuple[int, int]
) -> None:
    address, session = driving
    page = open_page(address)
    from_above(page, ABOVE)
    page.keyboard.press("n")
    strength(page).fill("40")
    drag(page, at(page, 0.0, 0.0, 0.02), at(page, *end, 0.02))
    expected = np.array(direction) / np.hypot(*direction)
    removed = until(lambda: pose(session)[:2] if np.hypot(*pose(session)[:2]) > 0.03 else None)
    assert np.dot(removed, expected) / np.hypot(*removed) > 0.9


def test_a_kick_is_set_in_fields_and_is_visible(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    from_above(page, ABOVE)
    column, row = middle(blue(screenshot(page)))
    form = menu(page).locator("form", has=page.get_by_role("heading", name="Push the robot"))
    form.get_by_label("Push or kick").select_option("kick")
    assert not form.get_by_label("Link to push").is_visible()
    form.get_by_label("Strength").fill("2")
    form.get_by_label("Direction in degrees").fill("90")
    form.get_by_role("button", name="Apply").click()
    until(lambda: pose(session)[1] > 0.05)  # moved to the left
    assert abs(pose(session)[0]) < 0.05
    page.keyboard.press("Escape")

    def moved() -> tuple[float, float]:
        now = middle(blue(screenshot(page)))
        return now[0] - column, now[1] - row

    until(lambda: moved()[1] < -8)
    assert abs(moved()[0]) < abs(moved()[1])


def test_an_object_can_be_pushed_but_not_kicked(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    from_above(page, ABOVE)
    page.keyboard.press("b")
    page.mouse.click(*at(page, 0.4, 0.0))
    until(lambda: len(state_of(session).bodies) == 7 and abs(state_of(session).bodies[2]) < 1e-3)
    page.keyboard.press("n")
    page.locator(".hint").get_by_label("Push or kick").select_option("kick")
    wait_for_current_picture(page, session)
    drag(page, at(page, 0.4, 0.0, 0.1), at(page, 0.4, 0.4, 0.1))
    until(lambda: "Only the robot can be kicked" in page.locator(".notices").inner_text())
    page.locator(".hint").get_by_label("Push or kick").select_option("push")
    strength(page).fill("60")
    drag(page, at(page, 0.4, 0.0, 0.1), at(page, 0.4, 0.4, 0.1))
    until(lambda: state_of(session).bodies[1] > 0.03)


def test_a_push_is_aimed_by_keyboard(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    from_above(page, "kbot.look([0, -0.001, 1], [0, 0, 0])")
    page.keyboard.press("n")
    strength(page).fill("40")
    page.locator(".picture canvas").focus()
    page.keyboard.press("Enter")
    for _ in range(10):
        page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")
    until(lambda: pose(session)[0] < -0.03)
    assert state_of(session).command == (0.0, 0.0)  # the arrow keys did not drive


def test_faults_are_listed_with_the_remaining_time_and_ended(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address)
    opened = menu(page)
    assert not opened.get_by_role("group", name="Faults", exact=True).is_visible()
    form = opened.locator("form", has=page.get_by_role("heading", name="Inject a fault"))
    form.get_by_label("Fault").select_option("payload")
    form.get_by_label("Target", exact=True).select_option("base_link")
    form.get_by_label("Seconds").fill("600")
    form.get_by_role("button", name="Inject").click()
    row = opened.locator(".faults li")
    until(lambda: row.count() == 1)
    assert row.locator(".words").inner_text() == "base_link carries 0.5 kg"

    def left() -> float:
        found = re.fullmatch(r"(\d+\.\d) s left", row.locator(".left").inner_text())
        return float(found[1]) if found else 0.0

    first = until(left)
    until(lambda: 0 < left() < first)
    session.paused = True
    (fault,) = state_of(session).faults
    assert fault.stop is not None
    assert fault.stop - fault.start == pytest.approx(600.0)
    until(lambda: left() == pytest.approx(fault.stop - state_of(session).time, abs=0.11))
    assert page.get_by_role("button", name="World and faults: 1 active").count() == 1
    row.get_by_role("button", name="End: base_link carries 0.5 kg").click()
    until(lambda: not opened.get_by_role("group", name="Faults", exact=True).is_visible())
    assert state_of(session).faults == ()
    assert page.get_by_role("button", name="World and faults", exact=True).count() == 1


def test_a_run_restarts_with_another_seed(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    opened = menu(page)
    seed = opened.get_by_label("noise seed")
    assert seed.input_value() == "1"
    seed.fill("7")
    revision = page.evaluate("kbot.revision")
    opened.get_by_role("button", name="Restart", exact=True).click()
    until(
        lambda: (
            run_between_steps(session, session.about).seed == 7 and page.evaluate("kbot.revision") > revision
        )
    )
    page.get_by_role("combobox", name="World").select_option("boxes")
    until(lambda: run_between_steps(session, session.about).world == "boxes")
    assert run_between_steps(session, session.about).seed == 7
    menu(page)
    until(lambda: seed.input_value() == "7")
    assert tool(page, "Interact").get_attribute("aria-pressed") == "true"
