"""A browser without WebGL: everything but the picture works, with a notice."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from kbot.cli.main import run
from kbot.workbench.session.session import Session

from .conftest import until
from .pictures import screenshot
from .served import state_of

OpenPage = Callable[..., Any]

NOT_DRAWN = "This browser cannot draw the robot"
TAKEN_AWAY = "The browser lost the graphics context"

LOSE = """() => {
  const context = document.querySelector(".picture canvas").getContext("webgl2");
  window.taker = context.getExtension("WEBGL_lose_context");
  taker.loseContext();
}"""


@pytest.fixture(scope="module", params=["--disable-3d-apis", "--disable-software-rasterizer"])
def plain(
    request: pytest.FixtureRequest, browser: Any, chromium: str, chromium_arguments: tuple[str, ...]
) -> Iterator[Any]:
    """A browser without WebGL."""
    arguments = [*chromium_arguments, request.param]
    plain = browser.browser_type.launch(executable_path=chromium, args=arguments)
    yield plain
    plain.close()


@pytest.fixture
def page(plain: Any) -> Iterator[Any]:
    page = plain.new_page(viewport={"width": 1180, "height": 640})
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    yield page
    page.close()
    assert faults == []


def test_without_webgl_everything_but_the_picture_works(driving: tuple[str, Session], page: Any) -> None:
    address, session = driving
    page.goto(address)
    until(lambda: page.get_by_role("alert").get_by_text(NOT_DRAWN).is_visible())
    until(lambda: page.inner_text(".status") == "live")
    page.keyboard.down("w")
    until(lambda: state_of(session).odometry[0] > 0.02)
    page.keyboard.up("w")
    page.locator("#links [data-link=left_wheel]").click()
    until(lambda: page.locator(".cm-line.here").count() == 1)
    page.mouse.move(590, 300)
    page.mouse.click(590, 300)
    for key in ("f", "o", "4", "m", "t", "l"):  # whole robot, flat, frames, measure, theme, plots
        page.keyboard.press(key)
    until(lambda: page.locator("#plots canvas").count() == 1)
    page.locator(".save-menu summary").click()
    assert page.get_by_role("button", name="Record a video").count() == 0
    page.get_by_role("button", name="Image (PNG)").click()
    until(lambda: "this browser cannot draw the image" in page.inner_text(".notices"))


def test_a_saved_page_without_webgl_has_its_joints(page: Any, tmp_path: Path) -> None:
    out = tmp_path / "kbot.html"
    assert run(["export", "kbot", "-o", str(out)]) == 0
    page.goto(out.as_uri())
    until(lambda: page.get_by_role("alert").get_by_text(NOT_DRAWN).is_visible())
    page.get_by_label("left_wheel_joint in degrees").fill("30")
    until(lambda: page.evaluate("kbot.poses().length") > 0)


def test_the_picture_returns_after_a_lost_webgl_context(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.keyboard.press("3")
    page.evaluate("kbot.drawn()")
    before = screenshot(page)
    page.evaluate(LOSE)
    until(lambda: page.get_by_role("alert").get_by_text(TAKEN_AWAY).is_visible())
    page.evaluate("taker.restoreContext()")
    until(lambda: page.get_by_text(TAKEN_AWAY).is_hidden())
    page.evaluate("kbot.drawn()")
    until(lambda: (screenshot(page) == before).all())
