"""Tests the core without `kbot.ros`, in a process that cannot import `kbot.ros` and its verbs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

REFUSE = """
import sys
class WithoutRos:
    def find_spec(self, name, path=None, target=None):
        if name in ("kbot.ros", "kbot.cli.ros") or name.startswith(("kbot.ros.", "kbot.cli.ros.")):
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
sys.meta_path.insert(0, WithoutRos())
"""
NOT_LOADED = "\nassert not [m for m in sys.modules if m.startswith('kbot.ros')]"


def run_without_ros(code: str, folder: Path) -> str:
    """Run a program in a process without `kbot.ros`, and return its output."""
    ended = subprocess.run(
        [
            sys.executable,
            "-c",
            REFUSE + code + "\nassert not [m for m in sys.modules if m.startswith('kbot.ros')]",
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


LIBRARY = {
    "expand": """
import kbot
from kbot.model.load import resolve_robot_path
assert "<link" in kbot.xacro.expand(resolve_robot_path("kbot"), {}).text
""",
    "check": """
from kbot.checks import check_file
from kbot.model.load import resolve_robot_path
assert not [d for d in check_file(resolve_robot_path("kbot")) if d.is_error]
""",
    "simulate": """
import kbot
sim = kbot.Simulation(kbot.load("kbot"))
sim.cmd_vel(0.2, 0.0)
sim.run(0.5)
assert sim.odometry.pose.x > 0.02
""",
    "navigate": """
import kbot
from kbot.navigation import GoalState, go_to
trip = go_to(kbot.Simulation(kbot.load("kbot")), kbot.PlanarPose(0.3, 0.0, 0.0))
assert trip.status.state is GoalState.REACHED, trip.status
""",
    "record": """
import kbot
from kbot.record import Recorder, Recording
from kbot.record.feed import Feed
from kbot.tf.state_publishers import StatePublishers
sim = kbot.Simulation(kbot.load("kbot"))
StatePublishers(sim)
with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), "run.mcap"):
    sim.run(0.5)
assert "/tf" in Recording("run.mcap").summary().topics
""",
    "view": """
import urllib.request
from kbot.workbench.serve import open_session, serving
with serving(open_session("kbot", simulate=False)) as url:
    assert urllib.request.urlopen(url).status == 200
""",
    "notebook": """
import kbot
assert "<iframe" in kbot.load("kbot").show()._repr_html_()
""",
}


@pytest.mark.parametrize("what", LIBRARY)
def test_the_library_works_without_the_ros_wing(what: str, tmp_path: Path) -> None:
    run_without_ros(LIBRARY[what], tmp_path)


VERBS = {
    "expand": ["expand", "kbot"],
    "check": ["check", "kbot"],
    "info": ["info", "kbot"],
    "export": ["export", "kbot", "--to", "glb"],
    "bag": ["bag", "info", "--help"],
    "sim": ["sim", "kbot", "--headless", "--duration", "0.2", "--record", "run.mcap"],
}


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_works_without_the_ros_wing(verb: str, tmp_path: Path) -> None:
    run_without_ros(f"from kbot.cli.main import run\nassert run({VERBS[verb]!r}) == 0", tmp_path)
