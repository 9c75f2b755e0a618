"""Time from saving a file to the new robot in the picture, for KBot and the largest robot of the corpus.

    python benchmarks/bench_save.py [--runs N]

Headless Chromium with software rendering shows a copy of the description. One size in it is changed on disk
again and again, and the page reports when it has drawn the new description. The largest robot is the corpus
entry (KBOT_SHARED, or `shared` beside the repository) with the most links. The corpus has no mesh files, so a
box that changes is added to this robot. Without a corpus, this robot is left out. The worst run is the first:
it is saved 0.3 s after the page has opened, and waits until the process that reads files has started.
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from browsing import SHOWS, opened_browser

import kbot
from kbot.workbench.serve import open_session, serving

if TYPE_CHECKING:
    from playwright.sync_api import Browser

CORPUS = Path(os.environ.get("KBOT_SHARED") or Path(__file__).parents[2] / "shared") / "corpus"
SHIPPED = Path(kbot.__file__).parent / "robots" / "kbot_description"

WATCH = """() => { window.saved = new Promise((resolve) => {
  const revision = kbot.revision;
  let before = kbot.frames;
  const look = () => {
    if (kbot.revision === revision) before = kbot.frames;
    if (kbot.revision !== revision && kbot.frames > before) requestAnimationFrame(() => resolve(Date.now()));
    else setTimeout(look, 1);
  };
  look(); }); }"""
"""Resolves to the start time in ms of the frame after the first picture of a new description. The browser has
that picture by then."""

BOX = """<link name="bench_box"><visual><geometry><box size="0.3 0.3 SIZE"/></geometry></visual></link>
<joint name="bench_joint" type="fixed"><parent link="base_link"/><child link="bench_box"/></joint></robot>"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=15)
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as folder, opened_browser() as browser:
        file = Path(shutil.copytree(SHIPPED, Path(folder) / SHIPPED.name)) / "urdf" / "kbot.xacro"
        text = file.read_text()

        def widened(size: float) -> str:
            return text.replace('"base_len" default="0.16"', f'"base_len" default="{size}"')

        taken = saves(browser, file, widened, runs)
        print(f"KBot, from a save to the picture: {summary(taken)} (limit 250 ms)")
        largest = largest_entry()
        if largest is None:
            print(f"there is no corpus at {CORPUS}: the largest robot is left out")
            return
        copied = Path(shutil.copytree(CORPUS / "src", Path(folder) / "src"))
        file = copied / largest["repo"].replace("/", "+") / largest["entry"]
        text = file.read_text()

        def heightened(size: float) -> str:
            return text.replace("</robot>", BOX.replace("SIZE", str(size)))

        taken = saves(browser, file, heightened, runs, [str(path) for path in copied.iterdir()])
        print(
            f"{largest['robot']} of {largest['links']} links ({file.name}): {summary(taken)} (limit 1000 ms)"
        )


def saves(
    browser: Browser, file: Path, text: Callable[[float], str], runs: int, packages: list[str] | None = None
) -> list[float]:
    """Seconds from each save to its picture."""
    file.write_text(text(0.2))
    taken = []
    with serving(open_session(str(file), simulate=False, package_path=packages or [])) as address:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(address)
        while not page.evaluate(SHOWS):
            time.sleep(0.01)
        page.locator(".topbar").wait_for()
        for run in range(runs):
            time.sleep(0.3 + run % 4 / 100)  # varies the phase relative to the file watcher
            page.evaluate(WATCH)
            start = time.time()
            file.write_text(text(0.3 + run / 1000))
            taken.append(page.evaluate("saved") / 1000 - start)
        page.close()
    return taken


def summary(taken: list[float]) -> str:
    median, worst = statistics.median(taken) * 1e3, max(taken) * 1e3
    return f"median {median:.0f} ms, worst of {len(taken)} runs {worst:.0f} ms"


def largest_entry() -> dict[str, str] | None:
    """The row of the corpus manifest with the most links; None without a corpus."""
    if not (CORPUS / "manifest.csv").exists():
        return None
    with (CORPUS / "manifest.csv").open(newline="") as file:
        plain = [row for row in csv.DictReader(file) if not row["args"]]
    return max(plain, key=lambda row: int(row["links"]))


if __name__ == "__main__":
    main()
