"""From `kbot view kbot --no-browser` to the first picture, beside a bare three.js page.

    python benchmarks/bench_first_picture.py [--runs N]

Both pages are opened in the same headless Chromium, in turn. The bare page draws KBot's boxes, cylinders
and sphere with three.js and nothing else; it is bundled from `web/node_modules` (`python hatch_build.py
--force` installs them) and comes from a server that already runs, so that it pays for no Python. KBot's page
is opened twice: just after the command said its address, and again from the server that has served it once,
which is what the bare page is compared with. Its first picture shows the robot's solid surfaces; floor, edges
and axes follow with the next one, and the panels after that.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ROOT = Path(__file__).parents[1]
WEB = ROOT / "web"
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync")

BARE = """
import * as THREE from "three";
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0x0f1318);
scene.add(new THREE.HemisphereLight(0xffffff, 0x666666, 1.5), new THREE.DirectionalLight(0xffffff, 2));
const add = (geometry, color, x, y, z) => {
  const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color }));
  mesh.position.set(x, y, z);
  scene.add(mesh);
};
add(new THREE.BoxGeometry(0.16, 0.16, 0.01), 0x0000cc, -0.02, 0, 0.04);
add(new THREE.CylinderGeometry(0.035, 0.035, 0.005, 64), 0x000000, 0, 0.087, 0.035);
add(new THREE.CylinderGeometry(0.035, 0.035, 0.005, 64), 0x000000, 0, -0.087, 0.035);
add(new THREE.SphereGeometry(0.0175, 48, 32), 0xcc0000, -0.08, 0, 0.0175);
const camera = new THREE.PerspectiveCamera(32, innerWidth / innerHeight, 0.01, 100);
camera.up.set(0, 0, 1);
camera.position.set(-0.4, -0.3, 0.25);
camera.lookAt(0, 0, 0);
renderer.render(scene, camera);
window.drawn = true;
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    from playwright.sync_api import sync_playwright

    with bare_page() as bare, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(ARGUMENTS))
        command, page, again, plain = [], [], [], []
        for _ in range(runs):
            whole, fresh, warm = view(browser)
            command.append(whole)
            page.append(fresh)
            again.append(warm)
            plain.append(first_picture(browser, bare, "!!window.drawn"))
        browser.close()
    middle = statistics.median
    print(f"kbot view kbot --no-browser, to the first picture: {middle(command):.2f} s (bound 3 s)")
    print(f"  of that, opening the page:                       {middle(page):.2f} s")
    print(f"opening it again, from the same server:            {middle(again):.2f} s")
    print(f"a bare three.js page, from a running server:       {middle(plain):.2f} s")
    print(f"opened again / bare page (bound 1.25):             {middle(again) / middle(plain):.2f}")
    print(f"opened just after the start / bare page:           {middle(page) / middle(plain):.2f}")


def view(browser: Browser) -> tuple[float, float, float]:
    """Seconds from the command to the picture, from opening the page to it, and from opening it once more."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "kbot", "view", "kbot", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        found = re.search(r"http://\S+", running.stdout.readline())
        assert found is not None
        is_drawn = "!!window.kbot && kbot.frames > 0 && kbot.revision > 0"
        fresh = first_picture(browser, found[0], is_drawn)
        whole = time.perf_counter() - start
        warm = first_picture(browser, found[0], is_drawn)
        running.terminate()
    return whole, fresh, warm


def first_picture(browser: Browser, address: str, is_drawn: str) -> float:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    start = time.perf_counter()
    page.goto(address, wait_until="commit")
    while not page.evaluate(is_drawn):
        time.sleep(0.005)
    taken = time.perf_counter() - start
    page.close()
    return taken


@contextmanager
def bare_page(script: str = BARE) -> Iterator[str]:
    """Address of a bare page, bundled as the workbench's is."""
    with tempfile.TemporaryDirectory(dir=WEB, prefix="bare-") as folder:
        (Path(folder) / "main.js").write_text(script)
        tag = '<body style="margin:0"><script type="module" src="./main.js"></script>'
        (Path(folder) / "index.html").write_text(f'<!doctype html><link rel="icon" href="data:,">{tag}')
        vite = [
            str(WEB / "node_modules" / ".bin" / "vite"),
            "build",
            folder,
            "--logLevel",
            "error",
            "--base",
            "./",
        ]
        subprocess.run(vite, check=True, cwd=WEB)
        handler = functools.partial(Quiet, directory=str(Path(folder) / "dist"))
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            yield f"http://127.0.0.1:{server.server_port}/"
            server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


def chromium() -> str:
    names = (os.environ.get("KBOT_CHROMIUM"), "chromium", "chromium-browser", "google-chrome")
    found = next((path for name in names if name and (path := shutil.which(name))), None)
    return found or sys.exit("there is no Chromium (install one, or set KBOT_CHROMIUM to its path)")


if __name__ == "__main__":
    main()
