"""What the page draws in a second beside a bare three.js page of the same boxes, and what serving costs.

    python benchmarks/bench_page.py [--seconds S]

Each pair of pages is shown in turn in the same headless Chromium (software rendering), and both turn about
their scene all the time, so that every frame is drawn anew. The bare pages draw with an `InstancedMesh`
and the same material, and have nothing else: no floor, no edges, no panels, no socket.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from bench_first_picture import ARGUMENTS, bare_page, chromium

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

BOXES = 1000
ROUNDS = 3

BARE = """
import * as THREE from "three";
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(714, 672);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0x0f1318);
const sun = new THREE.DirectionalLight(0xffffff, 2.1);
const fill = new THREE.DirectionalLight(0xffffff, 0.5);
scene.add(new THREE.HemisphereLight(0xffffff, 0x666666, 1.5), sun, fill);
const material = new THREE.MeshStandardMaterial({ roughness: 0.62, metalness: 0.05 });
const boxes = new THREE.InstancedMesh(new THREE.BoxGeometry(0.1, 0.1, 0.1), material, COUNT);
const place = new THREE.Matrix4();
for (let i = 0; i < COUNT; i += 1) {
  const isStart = Math.abs((i % 40) - 20) < 3 && Math.abs(Math.floor(i / 40) - 12) < 3;
  place.makeScale(isStart ? 0 : 1, isStart ? 0 : 1, isStart ? 0 : 1); // no box where the robot starts
  boxes.setMatrixAt(i, place.setPosition((i % 40) * 0.2 - 4, Math.floor(i / 40) * 0.2 - 2.5, 0.05));
}
for (let i = 0; i < COUNT; i += 1) boxes.setColorAt(i, new THREE.Color(0.5, 0.4, 0.3));
scene.add(boxes);
const camera = new THREE.PerspectiveCamera(32, 714 / 672, 0.01, 100);
camera.up.set(0, 0, 1);
window.frames_drawn = 0;
const draw = (now) => {
  camera.position.set(9 * Math.cos(now / 2000), 9 * Math.sin(now / 2000), 4);
  camera.lookAt(0, 0, 0);
  renderer.render(scene, camera);
  window.frames_drawn += 1;
  requestAnimationFrame(draw);
};
requestAnimationFrame(draw);
window.drawn = true;
"""

TURN = """() => { const turn = (now) => {
  kbot.look([9 * Math.cos(now / 2000), 9 * Math.sin(now / 2000), 4], [0, 0, 0]);
  requestAnimationFrame(turn); }; requestAnimationFrame(turn); }"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=4.0)
    seconds = parser.parse_args().seconds
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(ARGUMENTS))
        with tempfile.TemporaryDirectory() as folder:
            world = Path(folder) / "boxes.sdf"
            world.write_text(boxes_world())
            ours, bare = frames(browser, ["sim", "kbot", "--world", str(world)], seconds)
        print(f"{BOXES} boxes: {ours:.1f} frames a second, bare {bare:.1f}: {ours / bare:.2f} (bound 0.9)")
        share = serving(browser, seconds)
        print(f"one page of a running simulation: {share:.1%} of a core for the server (bound 4 %)")
        print(f"from a moved slider to the pose it makes: median {lag(browser) * 1000:.0f} ms (bound 100 ms)")
        browser.close()


def boxes_world() -> str:
    shape = "<geometry><box><size>0.1 0.1 0.1</size></box></geometry>"
    paint = "<material><diffuse>0.5 0.4 0.3 1</diffuse></material>"
    visual = f"<visual name='v'>{shape}{paint}</visual>"
    link = f"<link name='l'><collision name='c'>{shape}</collision>{visual}</link>"
    boxes = "".join(
        f"<model name='b{i}'><static>true</static>"
        f"<pose>{i % 40 * 0.2 - 4} {i // 40 * 0.2 - 2.5} 0.05 0 0 0</pose>{link}</model>"
        for i in range(BOXES)
        if not (abs(i % 40 - 20) < 3 and abs(i // 40 - 12) < 3)  # the robot starts there
    )
    plane = "<geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
    ground = (
        f"<model name='ground'><static>true</static><link name='l'><collision name='c'>{plane}</collision>"
        f"<visual name='v'>{plane}</visual></link></model>"
    )
    return f'<?xml version="1.0"?><sdf version="1.9"><world name="many">{ground}{boxes}</world></sdf>'


def frames(browser: Browser, words: list[str], seconds: float) -> tuple[float, float]:
    """Frames a second of the page and of the bare one; medians of alternating rounds."""
    ours, plain = [], []
    with kbot(words) as (address, _), bare_page(BARE.replace("COUNT", str(BOXES))) as bare:
        for _ in range(ROUNDS):
            with page(browser, address, "!!window.kbot && kbot.frames > 0") as shown:
                shown.evaluate(TURN)
                ours.append(rate(shown, "kbot.frames", seconds))
            with page(browser, bare, "!!window.drawn") as shown:
                plain.append(rate(shown, "window.frames_drawn", seconds))
    return statistics.median(ours), statistics.median(plain)


def rate(shown: Page, counter: str, seconds: float) -> float:
    time.sleep(1.0)
    before, start = shown.evaluate(f"[{counter}, performance.now()]")
    time.sleep(seconds)
    after, end = shown.evaluate(f"[{counter}, performance.now()]")
    return (after - before) / (end - start) * 1000.0


def serving(browser: Browser, seconds: float) -> float:
    """The share of a core that one page costs the server, beyond what the simulation takes without a page."""
    with kbot(["sim", "kbot"]) as (address, process):
        time.sleep(1.0)
        alone = share_of_core(process.pid, seconds)
        with page(browser, address, "!!window.kbot && kbot.frames > 0") as shown:
            shown.locator(".topbar").wait_for()
            time.sleep(1.0)
            return share_of_core(process.pid, seconds) - alone


def lag(browser: Browser) -> float:
    """Seconds from a moved slider to the pose that the server answers with, the median of some."""
    script = """(value) => new Promise((resolve) => {
      const was = kbot.poses(), start = performance.now();
      const slider = document.querySelector('[data-joint=left_wheel_joint] [type=range]');
      slider.value = value; slider.dispatchEvent(new Event('input'));
      const look = () => kbot.poses() !== was ? resolve(performance.now() - start) : setTimeout(look, 1);
      look(); })"""
    with (
        kbot(["view", "kbot"]) as (address, _),
        page(browser, address, "!!window.kbot && kbot.frames > 0") as shown,
    ):
        shown.locator("[data-joint=left_wheel_joint]").wait_for()
        taken = []
        for value in range(1, 16):
            time.sleep(0.1)
            taken.append(float(shown.evaluate(script, value / 10.0)) / 1000.0)
    return statistics.median(taken)


def share_of_core(pid: int, seconds: float) -> float:
    before = cpu_seconds(pid)
    time.sleep(seconds)
    return (cpu_seconds(pid) - before) / seconds


def cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


@contextmanager
def page(browser: Browser, address: str, ready: str) -> Iterator[Page]:
    shown = browser.new_page(viewport={"width": 1280, "height": 720})
    shown.goto(address)
    while not shown.evaluate(ready):
        time.sleep(0.01)
    yield shown
    shown.close()


@contextmanager
def kbot(words: list[str]) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    command = [sys.executable, "-m", "kbot", *words, "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        line = running.stdout.readline()
        while "http://" not in line:
            line = running.stdout.readline()
        yield "http://" + line.split("http://")[1].split()[0], running
        running.terminate()


if __name__ == "__main__":
    main()
