"""Processor time of commands that read many meshes or draw a picture, compared with their libraries alone.

    python benchmarks/bench_meshes.py [--from FOLDER]

Each command is a process of its own, with its imports, in turn with its peer. The minimum of three runs
counts, and the ratio is that of the minima. `kbot check` reads the 106 meshes of ur_description, and its peer
loads these files with trimesh. `kbot export` draws the KBot robot as a PNG of 1280 x 720 pixels. Its peer
draws as many shapes at this size with MuJoCo's renderer, without a floor, smooth edges or a description.
`kbot sim` loads two worlds whose meshes collide as 28,000 and 87,000 convex plates. Its peer is MuJoCo, which
reads as many boxes from a file of its own format. Opening the page of a robot of 3,000 links is `GET /`, in
ms of wall-clock time, compared with `json.dumps` of the same text. More than a third of the check is the
parsing of 61 MB of COLLADA by pycollada, half of the picture is imports, and a third of the larger world is
MuJoCo, which adds and compiles its shapes.

Exit status 1 if a limit is exceeded. `--from FOLDER` is that of `bench_robots.py`.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator, Sequence
from pathlib import Path

from public_repositories import ENVIRONMENT, Source, chosen_by_user, fetch

ROBOT = Source("ros-industrial/universal_robot", "a7a2c5459b9702ba8b07ebf35f0134159e50e680")
WORLDS = Source("neobotix/neo_simulation", "4181e9f070e01fae678e6be6fa694804a32f63b9")
MODELS = Source("osrf/gazebo_models", "8163eb4b5e7e21985c6591d1c0bfb56468c0093f")
RUNS = 3
LINKS = 3000

LOAD = """
import sys, pathlib, trimesh
for file in sorted(pathlib.Path(sys.argv[1]).rglob("*")):
    if file.suffix.lower() in (".dae", ".stl"):
        trimesh.load_scene(str(file))
"""
DRAW = """
import os, sys
os.environ["MUJOCO_GL"] = "egl"
import mujoco
from PIL import Image
geoms = "<geom type='box' size='.08 .08 .005'/><geom size='.0175' pos='-.08 0 0'/>"
geoms += "<geom type='cylinder' size='.035 .0025' pos='0 .09 0' euler='90 0 0'/>" * 2
size = "<visual><global offwidth='1280' offheight='720'/></visual>"
model = mujoco.MjModel.from_xml_string(f"<mujoco>{size}<worldbody>{geoms}</worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 720, 1280) as renderer:
    renderer.update_scene(data)
    Image.fromarray(renderer.render()).save(sys.argv[1])
"""
BOXES = """
import sys, mujoco
geoms = "".join(f"<geom type='box' size='.1 .1 .1' pos='{i} 0 0'/>" for i in range(int(sys.argv[1])))
mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geoms}</worldbody></mujoco>")
"""


def seconds(command: Sequence[str], environment: dict[str, str]) -> float:
    """The processor time of a command, with that of its own processes."""
    before = os.times()
    subprocess.run(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False
    )
    after = os.times()
    return after.children_user - before.children_user + after.children_system - before.children_system


def compared(
    name: str, limit: float, kbot: Sequence[str], peer: Sequence[str], models: str = ""
) -> tuple[str, bool]:
    """A line of the table, and whether it is within the limit. The least times of both commands count."""
    environment = {**ENVIRONMENT, "GAZEBO_MODEL_PATH": models}
    commands = ([sys.executable, "-m", "kbot", *kbot], [sys.executable, "-c", *peer])
    times = [[seconds(command, environment) for command in commands] for _ in range(RUNS)]
    ours, theirs = (min(column) for column in zip(*times, strict=True))
    line = f"{name:44}{ours:7.2f}{theirs:9.2f}{ours / theirs:8.2f}   (limit {limit:g} s)"
    return line, ours <= limit


def lines(folder: Path) -> Iterator[tuple[str, bool]]:
    robot, worlds, models = (folder / source.folder for source in (ROBOT, WORLDS, MODELS))
    described, picture = str(robot / "ur_description"), str(folder / "x.png")
    yield compared("check ur_description / trimesh", 3.0, ["check", described], [LOAD, described])
    yield compared("export kbot -o x.png / MuJoCo", 1.0, ["export", "kbot", "-o", picture], [DRAW, picture])
    known = f"{models}:{worlds / 'models'}"
    for world, count in (("neo_track1", 28_000), ("neo_track2", 87_000)):
        file = str(worlds / "worlds" / f"{world}.world")
        sim = ["sim", "kbot", "--headless", "--world", file, "--duration", "0.1"]
        yield compared(f"sim in {world} / MuJoCo", 5.0, sim, [BOXES, str(count)], known)


def opened(folder: Path) -> str:
    """The line of a page of many links."""
    shape = '<geometry><box size="0.1 0.1 0.1"/></geometry>'
    links = (f'<link name="l{i}"><visual>{shape}</visual></link>' for i in range(LINKS))
    joints = (
        f'<joint name="j{i}" type="continuous"><parent link="l0"/><child link="l{i}"/>'
        f'<origin xyz="0 {i} 0"/></joint>'
        for i in range(1, LINKS)
    )
    (folder / "many.urdf").write_text("\n".join(['<robot name="many">', *links, *joints, "</robot>"]))
    command = [sys.executable, "-m", "kbot", "view", str(folder / "many.urdf"), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            address = re.search(r"http://\S+", (server.stdout and server.stdout.readline()) or "")
            if address is None:
                return "GET / failed: the server printed no address"
            time.sleep(5.0)  # it prepares in the background what the first page needs
            times = [_get(address[0]) for _ in range(5 * RUNS)]
        finally:
            server.terminate()
    ours, theirs = (1e3 * min(column) for column in zip(*times, strict=True))
    return f"{f'GET / of {LINKS:,} links / json.dumps, ms':44}{ours:7.0f}{theirs:9.0f}{ours / theirs:8.2f}"


def _get(address: str) -> tuple[float, float]:
    """Seconds to get a page, and to encode the messages in it as JSON."""
    start = time.perf_counter()
    with urllib.request.urlopen(address) as answer:
        page = answer.read().decode()
    end = time.perf_counter()
    greeting = json.loads(page.partition('id="greeting">')[2].partition("</script>")[0])
    encoding = time.perf_counter()
    json.dumps(greeting)
    return end - start, time.perf_counter() - encoding


def main() -> int:
    is_met = True
    _, given = chosen_by_user(__doc__, [])
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for source in (ROBOT, WORLDS, MODELS):
            fetch(source, folder, given)
        print(f"{'processor time in s':44}{'KBot':>7}{'peer':>9}{'ratio':>8}")
        for line, is_within in lines(folder):
            print(line, flush=True)
            is_met &= is_within
        print(opened(folder))
    return 0 if is_met else 1


if __name__ == "__main__":
    sys.exit(main())
