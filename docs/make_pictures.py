"""The pictures in the documentation, made by the program itself: `python docs/make_pictures.py`."""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import kbot
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


def opened(browser: Browser, address: str, width: int, height: int) -> Page:
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme="dark")
    page.goto(f"{address}?shadows=on")
    end = time.monotonic() + 30
    while not page.evaluate(SHOWS):
        if time.monotonic() > end:
            sys.exit("the page did not come up")
        time.sleep(0.02)
    return page


if __name__ == "__main__":
    main()
