"""The pictures of the page in the documentation, taken in a browser: `python docs/page_pictures.py`.

They are committed. `drawn_pictures.py` draws the pictures that need no browser, each time the site is built.
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

import kbot
from kbot.kinematics.planar_pose import PlanarPose
from kbot.trials import Bound, Command, NeverTouches, Reaches, RobotSource, Scenario, Step
from kbot.trials.films import run_filmed
from kbot.trials.reports.html import write_html
from kbot.workbench.serve import open_session, serving

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from browsing import SHOWS, opened_browser

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

IMAGES = Path(__file__).parent / "images"


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    with opened_browser() as browser:
        driving(browser)
        finding(browser)
        trials_report(browser)
        tutorial(browser)
        film(browser)


def driving(browser: Browser) -> None:
    """KBot on its way between boxes, with the path it took."""
    with serving(open_session("kbot", simulate=True, world="boxes")) as address:
        page = opened(browser, address, 1440, 860)
        page.get_by_role("button", name="Stop", exact=True).wait_for()  # the panels come after the picture
        page.wait_for_timeout(1000)
        page.keyboard.down("w")
        page.wait_for_timeout(700)
        page.keyboard.down("a")
        page.wait_for_timeout(1300)
        page.keyboard.up("a")
        page.wait_for_timeout(500)
        page.keyboard.down("d")
        page.wait_for_timeout(900)
        page.evaluate("kbot.drawn()")
        page.screenshot(path=IMAGES / "workbench.png")
        page.close()


def finding(browser: Browser) -> None:
    """A mistake in a macro: the finding, its line and its link."""
    shipped = Path(kbot.__file__).parent / "robots" / "kbot_description"
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(shipped, Path(folder) / "kbot_description"))
        macros = copy / "urdf" / "kbot_macros.xacro"
        text = macros.read_text()
        macros.write_text(text.replace('izz="${m*r*r/2}"', 'izz="${m*r*r*2}"'))
        with serving(open_session(str(copy / "urdf" / "kbot.xacro"), simulate=False)) as address:
            page = opened(browser, address, 1440, 860)
            page.locator("#findings li[data-code] button.finding").first.click()
            page.locator("[data-option=inertia]").click()
            page.wait_for_timeout(500)
            page.screenshot(path=IMAGES / "finding.png")
            page.close()


def trials_report(browser: Browser) -> None:
    """The report of a robot that hits a wall, with its film, path and measures."""
    steps = [Step(Command(0.3, 0.06)), Step(Command(0.3, -0.12), at=2.0)]
    expect = [NeverTouches(), Reaches(1.25, 0.05, 0.1), Bound("odometry_error", max=0.02)]
    scenario = Scenario(
        "doorway", 6.0, steps, expect, RobotSource("kbot"), "corridor:length=2", PlanarPose(0.0, 0.05, 0.0)
    )
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.html"
        write_html(str(report), [run_filmed(scenario)], "KBot in a corridor")
        context = browser.new_context(
            viewport={"width": 1180, "height": 1080}, color_scheme="light", reduced_motion="reduce"
        )
        page = context.new_page()
        page.goto(report.as_uri())
        page.screenshot(path=IMAGES / "trials_report.png")  # fewer colours would lose those of thin lines
        context.close()


def tutorial(browser: Browser) -> None:
    """The page in the steps of the tutorial whose picture is not that of the robot alone."""
    steps, images = IMAGES.parent / "tutorial" / "steps", IMAGES.parent / "tutorial" / "images"
    images.mkdir(exist_ok=True)
    for name, file, keys in (
        ("01_empty", "01_empty", ""),
        ("03_inertia", "03_inertia", "3"),
        ("06_joints", "05_caster", "4"),
    ):
        with reader_page(browser, steps / f"{file}.xacro", simulate=False) as page:
            take(page, images / f"{name}.png", keys)
    with reader_page(browser, steps / "09_drive.xacro", simulate=True) as page:
        page.get_by_role("button", name="Stop", exact=True).wait_for()
        page.keyboard.down("w")
        page.wait_for_timeout(1500)
        page.keyboard.down("a")
        page.wait_for_timeout(700)
        page.keyboard.up("a")
        page.wait_for_timeout(1000)
        take(page, images / "09_drive.png", "")


def film(browser: Browser) -> None:
    """A drive, a typing error, its finding, its fix, and the drive again."""
    shipped = Path(kbot.__file__).parent / "robots" / "kbot_description"
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(shipped, Path(folder) / "kbot_description"))
        session = open_session(str(copy / "urdf" / "kbot.xacro"), simulate=True, world="playground")
        with serving(session) as address:
            page = opened(browser, address, 1100, 680)
            page.get_by_role("button", name="Stop", exact=True).wait_for()
            shots = Film(page)
            session.speed = 0.25  # a slow machine takes few pictures a second
            shots.hold(1.5)
            shots.drive("w", 2.0)
            page.locator("#links [data-link=left_wheel]").click()
            cylinder = page.locator("#source .cm-line", has_text="<cylinder").first
            name = cylinder.locator("text=wheel_radius").first
            name.wait_for()
            shots.hold(1.5)
            name.dblclick()
            for letter in "wheel_raduis":
                page.keyboard.type(letter)
                shots.hold(0.12)
            page.keyboard.press("Control+s")
            page.locator("#findings [data-severity=error] .fix").first.wait_for()
            shots.hold(3.5)
            page.locator("#findings [data-severity=error] .fix").first.click()
            page.locator("#findings [data-severity=error]").first.wait_for(state="detached")
            shots.hold(1.5)
            page.get_by_role("button", name="Close the source").click()
            shots.drive("w", 1.5)
            shots.drive("a", 1.5)
            shots.drive("w", 2.0)
            shots.hold(1.0)
            shots.save(IMAGES / "first_minute.gif")
            page.close()


class Film:
    """Pictures of a page with the seconds that each is shown.

    Those of a drive are shown in simulated time.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self._pictures: list[Image.Image] = []
        self._seconds: list[float] = []

    def hold(self, seconds: float) -> None:
        """Show the page as it is now."""
        self._page.wait_for_timeout(300)  # until it has drawn what has just happened
        self._take(seconds)

    def drive(self, key: str, seconds: float) -> None:
        """Hold a key down for some simulated seconds."""
        self._page.keyboard.down(key)
        start = now = self._time()
        while now < start + seconds:
            self._take(0.0)
            before, now = now, self._time()
            self._seconds[-1] = now - before
        self._page.keyboard.up(key)

    def save(self, path: Path) -> None:
        """Write a GIF. All pictures share their colours: then only what changes between two is stored."""
        small = [picture.resize((880, 544), Image.Resampling.LANCZOS) for picture in self._pictures]
        every = Image.fromarray(np.concatenate([np.asarray(picture)[::4, ::4] for picture in small]))
        colours = every.quantize(256, method=Image.Quantize.MAXCOVERAGE)
        few = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in small]
        milliseconds = [max(40, round(seconds * 1000.0)) for seconds in self._seconds]
        few[0].save(path, save_all=True, append_images=few[1:], duration=milliseconds, loop=0, optimize=True)

    def _time(self) -> float:
        return float(self._page.evaluate("kbot.time"))

    def _take(self, seconds: float) -> None:
        self._pictures.append(Image.open(io.BytesIO(self._page.screenshot())).convert("RGB"))
        self._seconds.append(seconds)


@contextmanager
def reader_page(browser: Browser, step: Path, *, simulate: bool) -> Iterator[Page]:
    """A page with the file of a step, under the name that the tutorial's reader gives it."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "my_robot" / "urdf" / "my_robot.xacro"
        target.parent.mkdir(parents=True)
        shutil.copy(step, target)
        with serving(open_session(str(target), simulate=simulate)) as address:
            yield opened(browser, address, 1100, 640, "light")


def take(page: Page, path: Path, keys: str) -> None:
    """Press keys in the page, and store its picture with few colours."""
    for key in keys:
        page.keyboard.press(key)
    page.wait_for_timeout(500)
    page.evaluate("kbot.drawn()")
    shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    shot.quantize(256).save(path, optimize=True)
    page.close()


def opened(browser: Browser, address: str, width: int, height: int, colours: str = "dark") -> Page:
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=colours)
    page.goto(f"{address}?shadows=on")
    end = time.monotonic() + 30
    while not page.evaluate(SHOWS):
        if time.monotonic() > end:
            sys.exit("the page did not come up")
        time.sleep(0.02)
    page.locator("#findings").wait_for()  # the panels come after the picture
    page.wait_for_timeout(1000)
    return page


if __name__ == "__main__":
    main()
