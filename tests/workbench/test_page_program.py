"""The page shows a program that drives: who drives, its errors, and what it prints, plots and draws."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .axe import violations
from .conftest import until
from .pictures import blue, decode_png, screenshot
from .scripted import needs_signals, scripted

pytestmark = needs_signals
OpenPage = Callable[..., Any]
WIDE = {"viewport": {"width": 1280, "height": 760}}
BAR = ".notice.program"

CIRCLE = """
def drive(sim):
    print("on my way")
    sim.draw.points("ball", [(0.4, 0.3, 0.1)], color=(1.0, 0.0, 1.0), size=0.2)
    sim.draw.text("label", (0.4, -0.3, 0.1), "hello", color="black")
    while True:
        sim.cmd_vel(0.2, 0.3)
        sim.run(0.1)
        sim.plot("turned", sim.odometry.pose.yaw)
"""


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "drive.py"
    path.write_text(CIRCLE)
    return path


def x_of(page: Any) -> float:
    shown = page.inner_text("[aria-label=Odometry] [data-reading=x]")
    return float(shown.replace("\u2212", "-"))


def magenta(page: Any) -> int:
    """The number of pixels of the ball's colour in the view."""
    picture = screenshot(page).astype(int)
    return int(((picture[..., 0] > 90) & (picture[..., 2] > 90) & (picture[..., 1] < 60)).sum())


def test_a_script_is_watched_stopped_started_again_and_saved(script: Path, open_page: OpenPage) -> None:
    with scripted(script) as run:
        page = open_page(run.url, **WIDE)
        until(lambda: x_of(page) > 0.1)
        assert "drive.py drives the robot." in page.inner_text(BAR)
        assert page.inner_text("#drive .who") == "drive.py drives"
        page.keyboard.press("w")
        until(lambda: "drive.py drives the robot. Press Space" in page.inner_text(".notice.info"))
        page.keyboard.press(" ")
        until(lambda: "drive.py was stopped." in page.inner_text(BAR))
        page.get_by_role("button", name="Run", exact=True).click()
        until(lambda: "drive.py drives the robot." in page.inner_text(BAR) and x_of(page) < 0.1)
        script.write_text("def drive(sim):\n    sim.cmd_vel(-0.2, 0.0)\n    sim.run(0.8)\n")
        until(lambda: "drive.py finished." in page.inner_text(BAR))
        assert x_of(page) < -0.05
        assert run.interrupt() == 0


def test_the_stop_button_ends_a_loop_that_makes_no_step(script: Path, open_page: OpenPage) -> None:
    script.write_text("def drive(sim):\n    print('ready')\n    while True: pass\n")
    with scripted(script) as run:
        until(lambda: run.printed("ready"))
        page = open_page(run.url, **WIDE)
        until(lambda: "drive.py:3 is running, but has not called sim.run for " in page.inner_text(BAR))
        until(lambda: blue(screenshot(page)).sum() > 500)  # the robot, at its start
        page.locator(BAR).get_by_role("button", name="Stop").click()
        until(lambda: "drive.py was stopped." in page.inner_text(BAR))
        assert run.interrupt() == 0


def test_prints_plots_and_drawings_are_shown(script: Path, open_page: OpenPage) -> None:
    with scripted(script) as run:
        page = open_page(run.url, **WIDE)
        until(lambda: page.inner_text(f"{BAR} .printed") == "on my way")
        until(lambda: page.locator("#plots .chip").all_inner_texts() != [])
        assert [text.split("\n")[0] for text in page.locator("#plots .chip").all_inner_texts()] == ["turned"]
        until(lambda: np.ptp(decode_png(page.locator("#plots canvas").screenshot())[..., 0]) > 100)
        until(lambda: magenta(page) > 200)
        page.locator(f"{BAR} .printed").click()
        entry = page.locator(".log li", has_text="on my way")
        until(lambda: entry.count() == 1)
        assert entry.locator("time").inner_text() == "0.00 s"
        # what the user closes stays closed
        page.get_by_role("button", name="Close the plots").click()
        page.get_by_role("checkbox", name="Drawings").click()
        until(lambda: magenta(page) == 0)
        at = x_of(page)
        until(lambda: x_of(page) != at)
        assert not page.locator("#plots").is_visible()
        # the next run draws again, and its prints follow those of the first
        page.get_by_role("checkbox", name="Drawings").click()
        script.write_text("def drive(sim):\n    print('another')\n    sim.run(0.1)\n")
        until(lambda: page.locator(".log li", has_text="another").count() == 1)
        until(lambda: magenta(page) == 0)
        assert entry.count() == 1
        assert run.interrupt() == 0


def test_an_error_is_shown_with_its_line_until_the_script_is_saved(script: Path, open_page: OpenPage) -> None:
    script.write_text("def drive(sim):\n    speed = 0.5\n    sim.run(0.1)\n    assert speed < 0.4\n")
    with scripted(script) as run:
        page = open_page(run.url, **WIDE)
        until(lambda: page.locator(f"{BAR} pre").is_visible())
        shown = page.locator(f"{BAR} pre").inner_text().split("\n")
        assert shown == ["drive.py:4: assertion failed at 0.100 s: speed < 0.4", "    speed = 0.5"]
        until(lambda: page.locator(".log li[data-level=error]", has_text="drive.py:4").count() == 1)
        assert violations(page, BAR) == []
        script.write_text("def drive(sim):\n    sim.run(0.1)\n")
        until(lambda: "drive.py finished." in page.inner_text(BAR))
        assert not page.locator(f"{BAR} pre").is_visible()
        assert run.interrupt() == 0
