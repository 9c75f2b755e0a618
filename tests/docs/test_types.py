"""The programs of the docs pass `mypy --strict`, as the files that `mypy` checks by itself do.

`examples` and the tutorial's files are in the `files` of `[tool.mypy]`. The run here has the same options, so
it reads the cache that `make check` leaves. It then takes seconds, and without it as long as `mypy`.
"""

import json
import subprocess
import sys
from pathlib import Path

from kbot.templates import Sizes, make_package

from .pages import DOCS, ROOT, programs

PAGES = sorted([*DOCS.rglob("*.md"), ROOT / "README.md"])
NOT_CHECKED = {
    "docs/how-to/choose-a-wheel.md": "pandas has no types",
    "docs/how-to/train-a-policy.md": "its parts are those of examples/train_a_policy",
    "docs/tutorial/program.md": "its programs are the files of docs/tutorial/steps",
}
NEEDS_ROS = "import actionlib, rospy"
"""The first line of a program for ROS 1, which has no types."""
GIVEN = {
    "docs/reference/check.md": 'text = "<robot/>"\n',
    "docs/reference/policies.md": "import gymnasium\nenvironment = gymnasium.make('kbot/Goal-v0')\n"
    "onnx_bytes = b''\n",
    "docs/reference/workbench.md": "import kbot\n",
}
"""What the text of a page introduces, and not its programs."""
TYPES = """
from typing import Any, assert_type

import kbot
from kbot.messages import Image, Imu, LaserScan, PointCloud2
from kbot.sensors import Camera, CloudSensor, Lidar, LidarSensor

sim = kbot.Simulation("kbot")
lidar = sim.add_sensor(Lidar(link="base_link", rate=20))
assert_type(lidar, LidarSensor)
assert_type(lidar.latest, LaserScan)
cloud = sim.add_sensor(Lidar(link="base_link", rows=16))
assert_type(cloud, CloudSensor | Any)
camera = sim.add_sensor(Camera(link="base_link", depth=True))
assert_type(camera.latest, Image)
assert_type(camera.latest_depth, Image)
assert_type(sim.add_sensor(kbot.sensors.Imu(link="base_link")).latest, Imu)
assert_type(sim.robot, kbot.Robot)
assert_type(sim.robots["kbot"].robot, kbot.Robot)
assert_type(sim.robot.pose("base_link"), kbot.Transform)
assert_type(kbot.record.Recording("run.mcap").summary().seconds, float)
assert_type(kbot.learn.Policy.read("policy.onnx"), kbot.learn.Policy)


def mount(spec: Lidar) -> LaserScan | PointCloud2:
    return sim.add_sensor(spec).latest
"""


def test_the_programs_of_the_docs_pass_mypy_strict(tmp_path: Path) -> None:
    """The programs of a page follow each other, as in one file."""
    for page in PAGES:
        name = page.relative_to(ROOT).as_posix()
        parts = [part for part in programs(page.read_text("utf-8")) if not part.startswith(NEEDS_ROS)]
        if parts and name not in NOT_CHECKED:
            file = f"page_{page.parent.name}_{page.stem}.py".replace("-", "_")
            (tmp_path / file).write_text(GIVEN.get(name, "") + "\n".join(parts), "utf-8")
    notebook = json.loads((ROOT / "examples" / "first_drive.ipynb").read_text("utf-8"))
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    (tmp_path / "first_drive.py").write_text("\n".join(cells), "utf-8")
    (tmp_path / "inferred_types.py").write_text(TYPES, "utf-8")
    make_package(tmp_path / "new_robot", "new_robot", Sizes())
    files = [str(file) for file in sorted(tmp_path.rglob("*.py"))]
    assert len(files) > 15
    words = [sys.executable, "-m", "mypy", "--no-error-summary", *files]
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert ended.stdout + ended.stderr == ""
