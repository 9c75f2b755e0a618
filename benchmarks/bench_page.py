"""Frame rate of the page compared with a bare three.js page, and the cost of serving it.

    python benchmarks/bench_page.py [--rounds N] [--seconds S]

There are two scenes. In the first, KBot stands in a grid of 1,000 boxes, minus the 25 boxes around its start.
In the second, KBot turns between four walls: the server sends 20 frames, which are drawn as axes, 50 times a
second, and a scan of 360 beams 10 times a second. Each scene is shown in turn by the workbench and by a bare
page (`bare.js`) in the same headless Chromium with software rendering. The bare page has the same robot,
boxes, walls and floor, axes whose rods have ten sides instead of six, the same canvas, pixel ratio,
antialiasing, lights, materials and camera path. Its own timers, at 50 Hz and 10 Hz, replace the messages from
the server. It draws no floor grid, edge lines, contact shadows or beams, and has no panels and no socket.
Both cameras orbit the scene, so that every frame is drawn again. Frame rates are compared round by round. The
processor time per frame of the browser's renderer and GPU processes is compared too, because other load on
the machine hardly affects it.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from browsing import (
    KEEP_SOCKET,
    SHOWS,
    answer_lag,
    bare_page,
    drawing_seconds,
    kbot,
    opened_browser,
    page,
    share_of_core,
)

import kbot as package

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

BARE = Path(__file__).with_name("bare.js")
SHIPPED = Path(package.__file__).parent / "robots" / "kbot_description" / "urdf" / "kbot.xacro"

PLACES = [
    (i % 40 * 0.2 - 4, i // 40 * 0.2 - 2.5, 0.05)
    for i in range(1000)
    if not (abs(i % 40 - 20) < 3 and abs(i // 40 - 12) < 3)  # the robot starts here
]
WALLS = {(0.1, 4, 0.4): [(2, 0, 0.2), (-2, 0, 0.2)], (4, 0.1, 0.4): [(0, 2, 0.2), (0, -2, 0.2)]}

TURN = """([away, height]) => { const turn = (now) => {
  kbot.look([away * Math.cos(now / 2000), away * Math.sin(now / 2000), height], [0, 0, 0]);
  requestAnimationFrame(turn); }; requestAnimationFrame(turn); }"""

LIDAR = """<gazebo reference="base_link"><sensor type="gpu_lidar" name="lidar"><topic>scan</topic>
<update_rate>10</update_rate><pose>0 0 0.1 0 0 0</pose><lidar><scan><horizontal><samples>360</samples>
<min_angle>-3.14159</min_angle><max_angle>3.12413</max_angle></horizontal></scan>
<range><min>0.2</min><max>8</max></range></lidar></sensor></gazebo>"""

DISPLAYS = """displays:
- {kind: Grid, name: Grid}
- {kind: RobotModel, name: RobotModel}
- {kind: TF, name: TF, properties: {axes: true}}
- {kind: World, name: World}
- {kind: LaserScan, name: LaserScan, properties: {beams: true}}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4.0)
    options = parser.parse_args()
    rounds, seconds = options.rounds, options.seconds
    with tempfile.TemporaryDirectory() as folder, opened_browser() as browser:
        many = Path(folder) / "boxes.sdf"
        many.write_text(world_of({(0.1, 0.1, 0.1): PLACES}))
        with kbot(["sim", "kbot", "--world", str(many)]) as (address, _):
            compare("1,000 boxes", "boxes", browser, address, (9.0, 4.0), rounds, seconds)
        with framed_robot(Path(folder)) as (address, process):
            time.sleep(1.0)
            alone = share_of_core(process.pid, seconds)
            compare("20 frames and a scan", "frames", browser, address, (1.4, 0.8), rounds, seconds)
            with turning(browser, address) as shown:
                share = share_of_core(process.pid, seconds) - alone
                late = answer_lag(shown)
        print(f"  one such page takes {share:.1%} of a core of the server (limit 4 %)")
        print(f"  from a request to its answer {late:.0f} ms (limit 100 ms)")
        print(f"from a moved slider to the new pose: median {slider_lag(browser):.0f} ms (limit 100 ms)")


def compare(
    title: str,
    scene: str,
    browser: Browser,
    address: str,
    path: tuple[float, float],
    rounds: int,
    seconds: float,
) -> None:
    """Show the workbench and the bare page in turn, and print the comparison."""
    script = BARE.read_text().replace("SCENE", scene).replace("BOXES", json.dumps(PLACES))
    ours, bare = [], []
    with turning(browser, address) as shown:
        width, height = shown.evaluate("(({width, height}) => [width, height])(kbot.camera())")
    with bare_page(script) as plain:
        for _ in range(rounds):
            with page(browser, f"{plain}?width={width}&height={height}", "window.frames_drawn > 0") as shown:
                bare.append(rate(shown, "window.frames_drawn", seconds))
            with turning(browser, address) as shown:
                shown.evaluate(TURN, list(path))
                ours.append(rate(shown, "kbot.frames", seconds))
    pairs = list(zip(ours, bare, strict=True))
    frames = statistics.median(own[0] / other[0] for own, other in pairs)
    work = statistics.median(other[1] / own[1] for own, other in pairs)
    print(
        f"{title}: {statistics.median(frame_rate for frame_rate, _ in ours):.1f} frames a second, "
        f"bare {statistics.median(frame_rate for frame_rate, _ in bare):.1f}: {frames:.2f} (limit 0.9), "
        f"by processor time per frame {work:.2f}"
    )


def rate(shown: Page, counter: str, seconds: float) -> tuple[float, float]:
    """Frames per second, and the browser's processor time per frame in s."""
    time.sleep(1.0)
    (before, start), worked = shown.evaluate(f"[{counter}, performance.now()]"), drawing_seconds()
    time.sleep(seconds)
    (after, end), worked = shown.evaluate(f"[{counter}, performance.now()]"), drawing_seconds() - worked
    return (after - before) / (end - start) * 1000.0, worked / max(1, after - before)


@contextmanager
def turning(browser: Browser, address: str) -> Iterator[Page]:
    """The whole page, with the key held down that turns the robot left."""
    with page(browser, address, SHOWS, KEEP_SOCKET) as shown:
        shown.locator(".topbar").wait_for()
        shown.keyboard.down("a")
        yield shown
        shown.keyboard.up("a")


def slider_lag(browser: Browser) -> float:
    """Median time from a moved slider to the new pose from the server, in ms."""
    script = """(value) => new Promise((resolve) => {
      const was = kbot.poses(), start = performance.now();
      const slider = document.querySelector('[data-joint=left_wheel_joint] [type=range]');
      slider.value = value; slider.dispatchEvent(new Event('input'));
      const look = () => kbot.poses() !== was ? resolve(performance.now() - start) : setTimeout(look, 1);
      look(); })"""
    with kbot(["view", "kbot"]) as (address, _), page(browser, address, SHOWS) as shown:
        shown.locator("[data-joint=left_wheel_joint]").wait_for()
        taken = []
        for value in range(1, 16):
            time.sleep(0.1)
            taken.append(float(shown.evaluate(script, value / 10.0)))
    return statistics.median(taken)


@contextmanager
def framed_robot(folder: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """KBot with a lidar and 20 frames in total, between four walls."""
    more = "".join(
        f'<link name="frame_{i}"/><joint name="to_frame_{i}" type="fixed"><parent link="base_link"/>'
        f'<child link="frame_{i}"/><origin xyz="{0.02 * i - 0.14:.2f} 0.05 0.03"/></joint>'
        for i in range(15)
    )
    robot, walls, displays = folder / "framed.xacro", folder / "walls.sdf", folder / "framed.kbot.yaml"
    robot.write_text(
        f'<robot name="framed" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        f'<xacro:include filename="{SHIPPED}"/>{more}{LIDAR}</robot>'
    )
    walls.write_text(world_of(WALLS))
    displays.write_text(DISPLAYS)
    words = ["sim", str(robot), "--world", str(walls), "--config", str(displays)]
    with kbot(words) as served:
        yield served


def world_of(boxes: dict[tuple[float, float, float], list[tuple[float, float, float]]]) -> str:
    """A world with static boxes, by size, on a ground plane."""
    models = "".join(
        f"<model name='b{number}_{i}'><static>true</static><pose>{x} {y} {z} 0 0 0</pose><link name='l'>"
        f"<collision name='c'>{_box(size)}</collision><visual name='v'>{_box(size)}"
        "<material><diffuse>0.5 0.4 0.3 1</diffuse></material></visual></link></model>"
        for number, (size, places) in enumerate(boxes.items())
        for i, (x, y, z) in enumerate(places)
    )
    plane = "<geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
    ground = (
        f"<model name='ground'><static>true</static><link name='l'><collision name='c'>{plane}</collision>"
        f"<visual name='v'>{plane}</visual></link></model>"
    )
    return f'<?xml version="1.0"?><sdf version="1.9"><world name="many">{ground}{models}</world></sdf>'


def _box(size: tuple[float, float, float]) -> str:
    return f"<geometry><box><size>{' '.join(map(str, size))}</size></box></geometry>"


if __name__ == "__main__":
    main()
