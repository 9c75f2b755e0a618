"""Time from `kbot view kbot --no-browser` to the first picture, compared with a bare three.js page.

    python benchmarks/bench_first_picture.py [--runs N]

Both pages are opened in turn in the same headless Chromium with software rendering. The bare page draws the
same box, cylinders and sphere over the whole window, with the same number of triangles, kinds of lights and
materials, and antialiasing. It uses only three.js, bundled from `web/node_modules` (`python hatch_build.py
--force` installs it), and comes from a server that is already running, so its time does not include the
start-up of Python. KBot's page is opened twice: just after the command printed its address, and again from
the same server. Its first picture shows the robot's surfaces; floor, edges and axes follow in the next
picture, and then the panels. The browser reports the time of a picture as "first contentful paint". Processor
time is that of the browser's renderer and GPU processes up to the first picture.
"""

from __future__ import annotations

import argparse
import time
from statistics import median
from typing import TYPE_CHECKING

from browsing import bare_page, drawing_seconds, kbot, opened_browser, settle

if TYPE_CHECKING:
    from playwright.sync_api import Browser

BARE = """
import * as THREE from "three";
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0x0f1318);
scene.add(new THREE.HemisphereLight(0xffffff, 0x666666, 1.5));
scene.add(new THREE.DirectionalLight(0xffffff, 2.1), new THREE.DirectionalLight(0xffffff, 0.5));
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
"""
PAINTED = "performance.getEntriesByName('first-contentful-paint')"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=7)
    runs = parser.parse_args().runs
    whole, fresh, again, plain = [], [], [], []
    with bare_page(BARE) as bare, opened_browser() as browser:
        first_picture(browser, bare)  # warms up the browser
        for _ in range(runs):
            settle()
            plain.append(first_picture(browser, bare))
            settle()
            start = time.perf_counter()
            with kbot(["view", "kbot"]) as (address, _process):
                fresh.append(first_picture(browser, address))
                whole.append(time.perf_counter() - start)
                settle()
                again.append(first_picture(browser, address))
    print(f"kbot view kbot --no-browser, to the first picture: {median(whole):.2f} s (limit 3 s)")
    print(f"a bare three.js page, from a running server:       {median(wall_times(plain)):.2f} s")
    for name, ours in (("opened just after the start", fresh), ("opened again, from the same server", again)):
        pairs = list(zip(ours, plain, strict=True))
        wall = median([own[0] / other[0] for own, other in pairs])
        work = median([own[1] / other[1] for own, other in pairs])
        print(f"{name + ':':50} {median(wall_times(ours)):.2f} s")
        print(f"  ratio to the bare page: {wall:.2f} (limit 1.25); in processor time {work:.2f}")


def wall_times(pictures: list[tuple[float, float]]) -> list[float]:
    return [seconds for seconds, _ in pictures]


def first_picture(browser: Browser, address: str) -> tuple[float, float]:
    """Seconds from requesting a page to its first picture, and the browser's processor time for it."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    worked = drawing_seconds()
    start = time.time()  # the page's clock has its origin in this clock's time
    page.goto(address, wait_until="commit")
    while not page.evaluate(f"{PAINTED}.length"):
        time.sleep(0.005)
    worked = drawing_seconds() - worked
    seen = float(page.evaluate(f"performance.timeOrigin + {PAINTED}[0].startTime")) / 1000
    page.close()
    return seen - start, worked


if __name__ == "__main__":
    main()
