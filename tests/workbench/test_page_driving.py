"""Driving in the page by keyboard, pad, touch and gamepad, and what stops the robot."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from kbot.workbench.protocol import MoveModel
from kbot.workbench.serve import open_session, serving
from kbot.workbench.session.session import Session

from .conftest import until, wait_for_page
from .pictures import blue, id_image, middle, pixels_per_metre, screenshot
from .served import do, state_of

FROM_ABOVE = "kbot.look([0.3, -0.001, 2.4], [0.3, 0, 0])"

PLUG_IN = """() => {
  window.stick = [0, 0];
  window.looks = 0;
  navigator.getGamepads = () => { window.looks += 1; return [{ axes: window.stick }]; };
  dispatchEvent(new Event("gamepadconnected"));
}"""

OpenPage = Callable[..., Any]


def test_held_keys_drive_the_robot_across_the_picture(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(driving[0])
    page.keyboard.press("8")  # the view does not follow
    page.evaluate(FROM_ABOVE)
    before = middle(blue(screenshot(page)))
    page.keyboard.down("w")
    until(lambda: state_of(driving[1]).odometry[0] > 0.12)  # it must not drive out of the picture
    page.keyboard.up("w")
    until(lambda: reading(page, "x") > 0.12 and standing(page))
    after = middle(blue(screenshot(page)))
    # seen from above with y up, forward is to the right
    assert after[0] - before[0] > 0.12 * pixels_per_metre(page)
    assert abs(after[1] - before[1]) < 0.01 * pixels_per_metre(page)
    robot = id_image(page)[0] >= 0
    with_path = screenshot(page).astype(int)
    page.locator("[data-option=trail]").click()
    left = (np.abs(screenshot(page).astype(int) - with_path).sum(axis=2) > 60) & ~robot
    assert np.ptp(np.nonzero(left)[1]) > 0.03 * pixels_per_metre(page)  # its trail, behind it


def test_the_true_pose_is_shown_beside_odometry(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    world = page.get_by_role("group", name="In the world")
    until(lambda: [reading(page, entry, "In the world") for entry in ("x", "y", "yaw")] == [0.0, 0.0, 0.0])
    assert "differs from odometry" not in world.inner_text()
    do(session, lambda motion: motion.act(MoveModel("kbot", 1.2, -0.1, 0.0, np.radians(99.0))))
    until(lambda: reading(page, "x", "In the world") == pytest.approx(1.2, abs=0.002))
    assert reading(page, "y", "In the world") == pytest.approx(-0.1, abs=0.002)
    assert reading(page, "yaw", "In the world") == pytest.approx(99.0, abs=0.2)
    assert abs(reading(page, "x")) < 0.002  # no wheel turned
    assert "differs from odometry" in world.inner_text()


def test_the_heading_is_shown_within_half_a_turn(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.keyboard.down("ArrowLeft")
    until(lambda: state_of(driving[1]).odometry[2] < -2.0)  # after half a turn to the left
    page.keyboard.up("ArrowLeft")
    until(lambda: standing(page))
    yaw = np.degrees(state_of(driving[1]).odometry[2])
    until(lambda: abs((reading(page, "yaw") - yaw + 180) % 360 - 180) < 0.2)
    assert abs(reading(page, "yaw")) <= 180


def test_turning_keys_turn_the_robot_in_place(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.keyboard.down("ArrowLeft")
    until(lambda: reading(page, "yaw") > 30)
    page.keyboard.up("ArrowLeft")
    until(lambda: standing(page))
    assert abs(reading(page, "x")) < 0.002
    assert abs(reading(page, "y")) < 0.002


def test_a_page_that_loses_the_keyboard_stops_the_robot(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(driving[0])
    page.keyboard.down("w")
    until(lambda: reading(page, "x") > 0.02)
    page.evaluate("dispatchEvent(new Event('blur'))")
    until(lambda: standing(page))


@pytest.mark.parametrize("held", ["key", "pad", "gamepad"])
def test_a_key_held_when_the_connection_is_lost_does_not_drive_afterwards(
    xacro: Path, browser: Any, held: str
) -> None:
    page = browser.new_page(viewport={"width": 960, "height": 560})
    with serving(open_session(str(xacro), simulate=True)) as address:
        page.goto(address)
        wait_for_page(page)
        page.evaluate(PLUG_IN)
        hold(page, held)
        until(lambda: reading(page, "x") > 0.02)
    until(lambda: page.inner_text(".status") == "ended")
    session = open_session(str(xacro), simulate=True)
    with serving(session, port=urlsplit(address).port):
        until(lambda: page.inner_text(".status") == "live")
        if held == "key":
            page.keyboard.down("w")  # a key repeat
        elif held == "pad":
            page.mouse.move(*from_middle_of_pad(page, 58))
        begun = state_of(session).time
        until(lambda: state_of(session).time > begun + 0.5)
        assert state_of(session).odometry[0] == pytest.approx(0.0, abs=1e-3)
        let_go(page, held)
        hold(page, held)
        until(lambda: state_of(session).odometry[0] > 0.02)
    page.close()


def test_a_key_held_when_the_computer_sleeps_does_not_drive_when_it_wakes(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    address, session = driving
    page = open_page(address)
    page.keyboard.down("w")
    until(lambda: state_of(session).command[0] > 0.05)
    page.evaluate("() => { const now = Date.now; Date.now = () => now() + 60_000; }")
    until(lambda: state_of(session).command == (0.0, 0.0))
    page.keyboard.down("w")  # a key repeat
    begun = state_of(session).time
    until(lambda: state_of(session).time > begun + 0.3)
    assert state_of(session).command == (0.0, 0.0)
    page.keyboard.up("w")
    page.keyboard.down("w")
    until(lambda: state_of(session).command[0] > 0.05)


def test_closing_the_page_stops_the_robot(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page, other = open_page(driving[0]), open_page(driving[0])
    page.keyboard.down("w")
    until(lambda: reading(other, "x") > 0.02)
    until(lambda: other.inner_text(".who") == "Driven from another tab")
    page.close()
    until(lambda: standing(other) and other.inner_text(".who") == "")


def test_the_pad_drives_by_pointer(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    box = page.locator(".pad").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 60)
    until(lambda: reading(page, "x") > 0.05)
    page.mouse.up()
    until(lambda: standing(page))
    assert abs(reading(page, "yaw")) < 0.5


def test_the_pad_drives_by_touch_on_a_phone(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0], viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    box = page.locator(".pad").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    touch = page.context.new_cdp_session(page)
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y - 50}]})
    until(lambda: reading(page, "x") > 0.05)
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    until(lambda: standing(page))


def test_a_gamepad_drives(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.evaluate(PLUG_IN)
    page.evaluate("window.stick = [0.05, -1]")
    until(lambda: reading(page, "x") > 0.05)
    page.evaluate("window.stick = [0.05, 0.05]")
    until(lambda: standing(page))
    assert abs(reading(page, "yaw")) < 0.5


def test_pause_step_reset_and_speed(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    page.keyboard.down("w")
    until(lambda: reading(page, "x") > 0.05)
    page.keyboard.up("w")
    page.keyboard.press("p")
    until(lambda: page.inner_text(".rate") == "paused")
    at = page.evaluate("kbot.time")
    page.get_by_role("button", name="Step").click()
    until(lambda: abs(page.evaluate("kbot.time") - at - 0.1) < 0.0021)
    page.get_by_role("button", name="Reset").click()
    until(lambda: page.evaluate("kbot.time") == 0 and reading(page, "x") == 0)
    page.get_by_role("combobox", name="Speed").select_option("5")
    until(lambda: session.speed == 5.0)
    page.get_by_role("button", name="Continue").click()
    until(lambda: page.evaluate("kbot.time") > 0.5)


def test_shift_and_drag_push_the_robot(driving: tuple[str, Session], open_page: OpenPage) -> None:
    address, session = driving
    page = open_page(address)
    at = page.evaluate("kbot.where('base_link')")
    page.keyboard.down("Shift")
    page.mouse.move(at["x"], at["y"])
    page.mouse.down()
    page.mouse.move(at["x"], at["y"] - 200)
    until(lambda: state_of(session).poses[2] > 0.3)  # lifted by the push
    page.mouse.up()
    page.keyboard.up("Shift")
    until(lambda: state_of(session).poses[2] < 0.15)  # and falls, on its wheels or not


def reading(page: Any, name: str, place: str = "Odometry") -> float:
    """Return a number of the pose readout."""
    return float(
        page.inner_text(f"[aria-label={place!r}] [data-reading={name}]").replace("\u2212", "-") or "nan"
    )


def standing(page: Any) -> bool:
    numbers = page.locator(".meter .number").all_inner_texts()
    return numbers == ["0.00", "0.00"]


def from_middle_of_pad(page: Any, up: float) -> tuple[float, float]:
    """Return a point this many pixels above the middle of the pad."""
    box = page.locator(".pad").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2 - up


def hold(page: Any, what: str) -> None:
    """Drive straight ahead by keyboard, pad or gamepad."""
    if what == "key":
        page.keyboard.down("w")
    elif what == "pad":
        page.mouse.move(*from_middle_of_pad(page, 0))
        page.mouse.down()
        page.mouse.move(*from_middle_of_pad(page, 60))
    else:
        page.evaluate("window.stick = [0, -1]")


def let_go(page: Any, what: str) -> None:
    if what == "key":
        page.keyboard.up("w")
    elif what == "pad":
        page.mouse.up()
    else:
        page.evaluate("window.stick = [0, 0]")
        looks = page.evaluate("window.looks")
        until(lambda: page.evaluate("window.looks") > looks)
