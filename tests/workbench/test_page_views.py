"""The viewpoint of the page."""

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.workbench.protocol import MoveModel
from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import blue, id_image, screenshot
from .served import do, state_of

OpenPage = Callable[..., Any]


def share(page: Any, link: str) -> float:
    """Return the share of the picture that a link covers."""
    page.evaluate("kbot.drawn()")
    ids, links = id_image(page)
    return float((ids == links.index(link)).mean())


def clip(page: Any) -> np.ndarray:
    page.evaluate("kbot.drawn()")
    return np.array(page.evaluate("kbot.camera()")["clipFromWorld"]).reshape(4, 4)


def test_a_double_click_fills_the_picture_with_a_link(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    before = share(page, "left_wheel")
    page.locator("#links").get_by_role("button", name="left_wheel").dblclick()
    until(lambda: share(page, "left_wheel") > 4 * before)
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Show the whole robot").click()
    until(lambda: abs(share(page, "left_wheel") - before) < 0.3 * before)


def test_without_perspective_parallels_stay_parallel(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    assert not np.allclose(clip(page)[3], (0, 0, 0, 1))
    shown = share(page, "base_link")
    page.keyboard.press("o")
    assert np.allclose(clip(page)[3], (0, 0, 0, 1))
    assert abs(share(page, "base_link") - shown) < 0.25 * shown
    page.get_by_role("button", name="Top").click()
    # from above x is to the right and y is up, at the same scale
    right, up = clip(page)[0], clip(page)[1]
    camera = page.evaluate("kbot.camera()")
    assert abs(right[0] * camera["width"] - up[1] * camera["height"]) < 1e-2 * right[0] * camera["width"]
    assert abs(right[1]) < 1e-3 * right[0]


def test_an_address_opens_the_same_view(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.keyboard.press("o")
    page.get_by_role("button", name="Side").click()
    address = page.evaluate("location.href")  # Playwright is notified of it later
    other = open_page(address)
    assert "#eye=" in address
    assert np.allclose(clip(page), clip(other), rtol=1e-3, atol=1e-3)
    lost = open_page(viewing + "#eye=1,2&at=nonsense")
    assert share(lost, "base_link") > 0.02


def test_an_address_opens_the_same_view_of_a_robot_that_has_moved(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    """It is relative to the robot while it is followed, and to the world otherwise."""
    address, session = driving
    page = open_page(address)
    page.get_by_role("button", name="Top", exact=True).click()
    until(lambda: "&frame=base_footprint" in page.url)
    along = page.url
    start = clip(page)
    page.get_by_role("toolbar", name="View").get_by_role("button", name="Follow").click()
    until(lambda: page.url.endswith("&still"))
    assert "frame" not in page.url
    still = page.url
    do(session, lambda motion: motion.act(MoveModel("kbot", 1.0, 0.5, 0.0, 0.0)))
    until(lambda: np.allclose(state_of(session).poses[:2], (1.0, 0.5), atol=0.01))
    # the same part of the picture: a metre ahead and half a metre aside
    expected = start @ np.array([[1, 0, 0, -1.0], [0, 1, 0, -0.5], [0, 0, 1, 0], [0, 0, 0, 1]])
    followed, stays = open_page(along), open_page(still)
    until(lambda: np.allclose(clip(followed), expected, atol=0.02))
    until(lambda: np.allclose(clip(stays), start, atol=0.02))


def test_a_view_is_relative_to_any_frame(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0] + "#eye=1,0.5,0.5&at=0,0,0&frame=left_wheel")
    time = state_of(driving[1]).time
    until(lambda: state_of(driving[1]).time > time + 0.2)  # the robot stays there
    seen, size = page.evaluate("kbot.where('left_wheel')"), page.locator(".centre").bounding_box()
    middle = size["x"] + size["width"] / 2, size["y"] + size["height"] / 2
    assert np.allclose((seen["x"], seen["y"]), middle, atol=25)  # the timeline covers its bottom


def test_an_address_opens_the_same_kind_of_view(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    view = page.get_by_role("toolbar", name="View")
    for button in ("Ortho", "Follow"):
        view.get_by_role("button", name=button).click()
    until(lambda: page.url.endswith("&flat&still"))
    view.get_by_role("button", name="Ride").click()
    until(lambda: page.url.endswith("&flat&ride&still"))
    other = open_page(page.url)
    pressed = [
        other.get_by_role("toolbar", name="View")
        .get_by_role("button", name=button)
        .get_attribute("aria-pressed")
        for button in ("Ortho", "Follow", "Ride")
    ]
    assert pressed == ["true", "false", "true"]


def test_ride_looks_ahead_of_the_robot(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.keyboard.press("9")
    page.keyboard.down("a")
    until(lambda: float(page.inner_text("[data-reading=yaw]").replace("\u2212", "-")) > 90)
    page.keyboard.up("a")
    until(lambda: page.locator(".meter .number").all_inner_texts() == ["0.00", "0.00"])
    page.evaluate("kbot.drawn()")
    yaw = np.radians(float(page.inner_text("[data-reading=yaw]").replace("\u2212", "-")))
    ahead = clip(page) @ (10 * np.cos(yaw), 10 * np.sin(yaw), 0.0, 1.0)
    assert ahead[3] > 0
    assert abs(ahead[0] / ahead[3]) < 0.02


def test_a_wall_in_between_does_not_hide_the_robot(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.get_by_role("combobox", name="World").select_option("boxes")
    until(lambda: page.evaluate("kbot.revision") >= 2)
    page.keyboard.press("8")  # the view does not follow
    boxes = [body for body in driving[1].scene.bodies if len(body.parts) == 1]
    x, y, z = min(boxes, key=lambda body: np.hypot(*body.position[:2])).position
    page.evaluate(f"kbot.look([{2.2 * x}, {2.2 * y}, {2.2 * z + 0.05}], [0, 0, 0.03])")
    assert share(page, "base_link") > 0.002
    assert blue(screenshot(page)).sum() > 200


def test_pressed_buttons_look_pressed_under_the_pointer(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    ortho = page.get_by_role("button", name="Ortho")

    def look() -> list[str]:
        return list(
            ortho.evaluate("e => { const s = getComputedStyle(e); return [s.backgroundColor, s.boxShadow]; }")
        )

    plain = look()
    ortho.hover()
    until(lambda: look() != plain)
    beneath = look()
    assert beneath[1] == "none"
    ortho.click()
    until(lambda: ortho.get_attribute("aria-pressed") == "true" and look()[1] != "none")
    page.mouse.move(0, 0)
    until(lambda: look()[0] not in (plain[0], beneath[0]))
    assert "inset" in look()[1]
