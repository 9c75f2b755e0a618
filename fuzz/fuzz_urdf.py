"""Fuzzes the reader and the writer of URDF, and the conversion of a robot for the simulation.

A description gives a robot or diagnostics. A robot without errors can be written, read again and simulated,
unless a KbotError refuses it.
"""

from contextlib import suppress

from choices import Choices
from diagnostics import check_diagnostics
from edits import edited, real_files

import kbot
from kbot.model.load import load_robot_text
from kbot.model.writer import to_urdf
from kbot.text import KbotError

SEEDS = real_files(".urdf", is_wanted=lambda data: b"<mesh" not in data)
WORDS = [
    b'<link name="l"/>', b'<joint name="j" type="prismatic">', b"</joint>", b'<mimic joint="j"/>',
    b"<inertial/>", b'<parent link="base_link"/>', b'<child link="l"/>', b'<axis xyz="0 0 0"/>',
    b'<sphere radius="0"/>', b'<limit effort="0" velocity="0"/>', b'type="floating"', b'type="planar"',
    b'type="ball"', b"<visual/>", b'<transmission name="t"><joint name="j"/></transmission>',
    b'<capsule radius="1" length="1"/>', b"<collision>",
    b'<gazebo reference="base_link"><mu1>x</mu1><sensor type="imu" name="s"/></gazebo>', b"</collision>",
]  # fmt: skip


def one_input(choices: Choices) -> None:
    text = edited(choices, SEEDS, WORDS).decode(errors="replace")
    loaded = load_robot_text(text, "fuzz.urdf")
    check_diagnostics(loaded.diagnostics)
    if loaded.has_errors or loaded.robot is None:
        return
    again = load_robot_text(to_urdf(loaded.robot), "again.urdf").robot
    assert again is not None
    assert list(again.links) == list(loaded.robot.links)
    with suppress(KbotError):
        kbot.Simulation(loaded.robot).step(2)


TARGETS = {"urdf": one_input}
