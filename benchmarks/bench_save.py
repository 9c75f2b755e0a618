"""From a saved file to the new robot in the picture.

    python benchmarks/bench_save.py [--runs N]

A copy of KBot is shown in headless Chromium; one size in it is changed on disk again and again, and the
page is asked every few milliseconds whether it has drawn the new description.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

import kbot
from kbot.workbench.serve import open_session, serving

ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync")
READY = "!!window.kbot && kbot.frames > 0 && kbot.revision > 0"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=15)
    runs = parser.parse_args().runs
    from playwright.sync_api import sync_playwright

    shipped = Path(kbot.__file__).parent / "robots" / "kbot_description"
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        file = Path(shutil.copytree(shipped, Path(folder) / "kbot_description")) / "urdf" / "kbot.xacro"
        text = file.read_text()
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(ARGUMENTS))
        with serving(open_session(str(file), simulate=False)) as address:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(address)
            while not page.evaluate(READY):
                time.sleep(0.01)
            taken = []
            for run in range(runs):
                revision, frames = page.evaluate("[kbot.revision, kbot.frames]")
                start = time.perf_counter()
                file.write_text(
                    text.replace('"base_len" default="0.16"', f'"base_len" default="{0.2 + run / 1000}"')
                )
                while page.evaluate(f"kbot.revision <= {revision} || kbot.frames <= {frames}"):
                    time.sleep(0.002)
                taken.append(time.perf_counter() - start)
        browser.close()
    print(
        f"from a save to the picture: median {statistics.median(taken) * 1e3:.0f} ms, "
        f"worst {max(taken) * 1e3:.0f} ms of {runs} (bound 500 ms)"
    )


def chromium() -> str:
    names = (os.environ.get("KBOT_CHROMIUM"), "chromium", "chromium-browser", "google-chrome")
    found = next((path for name in names if name and (path := shutil.which(name))), None)
    return found or sys.exit("there is no Chromium (install one, or set KBOT_CHROMIUM to its path)")


if __name__ == "__main__":
    main()
