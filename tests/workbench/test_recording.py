"""A recording that a page starts stays in its folder, whatever the robot's name."""

from pathlib import Path

import pytest

from kbot.model.load import load_robot_text
from kbot.sim import Simulation
from kbot.workbench.timeline.recording import RunRecording

BODY = """<link name="base"><inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


@pytest.mark.parametrize(
    ("robot", "begins"),
    [("../evil", "___evil-"), ("/tmp/x/abs", "_tmp_x_abs-"), (".", "_-"), ("a" * 300, "a" * 100 + "-")],
)
def test_the_file_is_in_the_folder_and_has_a_plain_name(robot: str, begins: str, tmp_path: Path) -> None:
    folder = tmp_path / "started here"
    folder.mkdir()
    text = f'<robot name="{robot}">{BODY}</robot>'
    simulation = Simulation(load_robot_text(text, "robot.urdf").require())
    recording = RunRecording(str(folder))
    recording.begin(simulation, "empty")
    simulation.run(0.1)
    recording.end()
    (made,) = (path for path in tmp_path.rglob("*") if path.is_file())
    assert made.parent == folder
    assert made.name.startswith(begins)
    assert made.suffix == ".mcap"
