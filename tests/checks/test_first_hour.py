"""A learner types the chapter as printed, with its mistakes, and follows only KBot's hints and quick fixes.

Each step names what is typed, and then each finding that the learner follows, in the order of `kbot check`:
the fix that is applied, or the hint that is followed by hand. No step may make the robot worse. At the end,
the robot drives 2 m and its odometry is right within 1 cm.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.checks import Config, check_file
from kbot.checks.ranking import ranked
from kbot.model import Inertial, RobotModel
from kbot.model.load import load_robot
from kbot.text import Diagnostic, Edit, Span
from kbot.text.edits import apply_edits

ROBOT, RVIZ, GAZEBO = "urdf/kbot.xacro", "launch/kbot_base_rviz.launch", "launch/kbot_base_rviz_gazebo.launch"

PLASTIC = 1200.0  # kg/m^3
GUESSES = {"caster_wheel_radius": "0.015", "caster_wheel_joint_offset": "-0.06"}
"""What a learner may write for the properties that the chapter forgets. With this radius the caster hangs
5 mm above the ground (README of the chapter)."""


class Folder:
    """The learner's package, and the chapter to type from."""

    def __init__(self, folder: Path, chapter: Path) -> None:
        self.folder = folder
        self.printed = chapter / "printed" / "kbot_description"
        self.book = (chapter / "chapter.txt").read_text("utf-8")
        self.sections = (self.printed / ROBOT).read_text("utf-8").split("\n\n")

    def read(self, name: str) -> str:
        return (self.folder / name).read_text("utf-8")

    def write(self, name: str, text: str) -> None:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")

    def append(self, text: str) -> None:
        """Type a part of the robot before `</robot>`."""
        self.in_book(text)
        self.write(ROBOT, self.read(ROBOT).replace("</robot>", f"\n{text}\n</robot>"))

    def in_book(self, text: str) -> None:
        """Assert that the chapter prints this text."""
        assert "".join(text.split()) in "".join(self.book.split())


def type_properties(package: Folder) -> None:
    skeleton = f"{package.sections[0]}\n</robot>\n"
    package.in_book(skeleton)
    package.write(ROBOT, skeleton)


def type_base(package: Folder) -> None:
    package.append(package.sections[1])


def type_wheels(package: Folder) -> None:
    package.append(package.sections[2])


def type_caster(package: Folder) -> None:
    package.append(package.sections[3])


def make_package(package: Folder) -> None:
    """`catkin_create_pkg` writes these two files."""
    for name in ("package.xml", "CMakeLists.txt"):
        package.write(name, (package.printed / name).read_text("utf-8"))


def type_rviz_launch(package: Folder) -> None:
    text = (package.printed / RVIZ).read_text("utf-8")
    package.in_book(text)
    package.write(RVIZ, text)


def type_materials(package: Folder) -> None:
    materials = re.findall(r"<material name=.*?</material>", package.book)
    assert len(materials) == 4
    text = package.read(ROBOT).replace("<xacro:macro", "\n".join([*materials, "\n<xacro:macro"]), 1)
    box = '<box size="${base_len} ${base_width} 0.01"/>\n</geometry>\n'
    package.write(ROBOT, text.replace(box, box + '<material name="red"/>\n', 1))


def type_gazebo_launch(package: Folder) -> None:
    printed = (package.printed / GAZEBO).read_text("utf-8")
    added = printed[printed.index("<include") : printed.index("</launch>")]
    package.in_book(added)
    package.write(GAZEBO, package.read(RVIZ).replace("</launch>", f"{added}</launch>"))


@dataclass(frozen=True)
class Step:
    """What is typed, the file that is checked, what the learner follows, and what waits for a later section.

    `followed` has a line for each finding: its code, and `fix:` with the title of the fix that is applied, or
    `hint:` with the words that are followed by hand.
    """

    typed: Callable[[Folder], None]
    checked: str
    followed: list[str]
    waits: frozenset[str] = frozenset()


OFF_AXLE = "D124"
"""An info that stays: `base_footprint` is 20 mm behind the axle, as the chapter means it."""
STEPS = [
    Step(
        type_properties,
        ROBOT,
        ["P001 fix: join the root element"],
        waits=frozenset({"U003"}),  # there is no link yet: "add the first one"
    ),
    Step(
        type_base,
        ROBOT,
        [
            "I117 fix: remove the inertial",  # 20 kg in a cube of 1 mm
            "I112 fix: swap d and h",
            "I117 hint: compute the mass from volume and material: 0.31 kg of plastic",
        ],
        waits=frozenset({"S101"}),  # properties that the wheels will use: "use it, or remove it"
    ),
    Step(
        type_wheels,
        ROBOT,
        [
            "D105 fix: write 0.174",
            "S101 fix: remove <xacro:property>",  # wheel_separation, which the chapter never uses
            "I111 fix: rotate the inertial with its geometry",
            "I117 hint: compute the mass from volume and material: 0.023 kg of plastic",
            "D128 hint: raise it by 0.5 mm",
            'D125 fix: insert <limit effort="0.061" velocity="29"/>',
            "U202 fix: remove rpy",
        ],
        waits=frozenset({"D116", OFF_AXLE}),  # the caster is in the next section: "add a caster"
    ),
    Step(
        type_caster,
        ROBOT,
        [
            'X103 hint: Define it with <xacro:property name="caster_wheel_radius" value="…"/>',
            'X103 hint: Define it with <xacro:property name="caster_wheel_joint_offset" value="…"/>',
            "I117 hint: compute the mass from volume and material: 0.017 kg of plastic",
            "D118 fix: make it a fixed ball without friction",
            "D112 fix: write z = -0.025",  # the guessed radius hangs 5 mm above the ground
        ],
        waits=frozenset({OFF_AXLE}),
    ),
    Step(make_package, "package.xml", []),
    Step(
        type_rviz_launch,
        RVIZ,
        ['L053 fix: set type="robot_state_publisher"', "L057 fix: remove --inorder"],
        waits=frozenset({OFF_AXLE}),
    ),
    Step(type_materials, ROBOT, [], waits=frozenset({OFF_AXLE})),
    Step(type_gazebo_launch, GAZEBO, ["L056 fix: remove -verbose"], waits=frozenset({OFF_AXLE})),
]


def by_hand(finding: Diagnostic) -> Edit | None:
    """The edit that a hint asks for, if the finding has no fix."""
    if finding.origin is None:
        return None
    span = finding.origin.span
    if finding.code == "X103" and finding.hint.startswith("Define it with <"):
        end = span.source.data.index(b">", span.source.data.index(b"<robot")) + 1
        line = finding.hint.removeprefix("Define it with ")
        defined = line.replace("…", GUESSES[finding.message.split("'")[1]])
        return Edit(Span(span.source, end, end), f"\n  {defined}")
    mass = re.search(r"([\d.e-]+) kg of plastic", finding.hint)
    if finding.code == "I117" and mass:
        return Edit(span, mass[1])
    raised = re.fullmatch(r"raise it by ([\d.]+) mm", finding.hint)
    if finding.code == "D128" and raised:
        end = span.source.data.rindex(
            b'" rpy', 0, span.start
        )  # the origin of the shape: xyz="0 0 0" rpy="0 0 0"
        start = span.source.data.rindex(b" ", 0, end) + 1
        return Edit(Span(span.source, start, end), f"{float(raised[1]) / 1e3:g}")
    return None


def follow(path: Path, waits: frozenset[str], check_quality: Callable[[], None]) -> list[str]:
    """Follow the findings of a file, the first first, until only those that wait are left."""
    followed = list[str]()
    errors: list[str] = []
    while True:
        everything = ranked(check_file(str(path), config=Config()))
        new = [d for d in everything if d.is_error and d.code not in waits]
        # once an unknown property is defined, the next unknown name of the expression may appear
        assert len(new) <= max(len(errors), 1) or not followed, new
        errors = [d.code for d in new]
        found = [d for d in everything if d.code not in waits]
        if not found:
            return followed
        finding, hand = found[0], by_hand(found[0])
        edits = finding.fix.edits if finding.fix is not None else (hand,) if hand is not None else ()
        assert edits, f"KBot does not say what to write: {finding} ({finding.hint})"
        what = f"fix: {finding.fix.title}" if finding.fix is not None else f"hint: {finding.hint}"
        followed.append(f"{finding.code} {what}")
        assert len(followed) < 20, followed
        file = Path(edits[0].span.file)
        file.write_text(apply_edits(file.read_text("utf-8"), edits), "utf-8")
        check_quality()


class Quality:
    """How far the robot is from the truth. Each distance may only become smaller.

    The true values are computed by hand in the README of the chapter, for 10 kg: they are proportional to the
    mass.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.distances: dict[str, float] = {}

    def check(self) -> None:
        loaded = load_robot(str(self.path))
        if loaded.robot is None or any(d.is_error for d in loaded.diagnostics):
            return  # KBot reports the errors
        robot = loaded.robot
        for name, distance in distances(robot).items():
            assert distance <= self.distances.get(name, math.inf) + 1e-9, f"{name} became worse"
            self.distances[name] = distance


def distances(robot: RobotModel) -> dict[str, float]:
    found = dict[str, float]()
    for name, volume in (
        ("base_footprint", 0.0),  # a frame
        ("base_link", 0.16 * 0.16 * 0.01),
        ("left_wheel", math.pi * 0.035**2 * 0.005),
        ("right_wheel", math.pi * 0.035**2 * 0.005),
        ("caster_wheel", 4 / 3 * math.pi * float(GUESSES["caster_wheel_radius"]) ** 3),
    ):
        link = robot.links.get(name)
        if link is None:
            continue
        mass = link.inertial.mass if link.inertial is not None else 0.0
        # a real part is made of plastic, or of aluminium at most
        found[f"mass of {name}"] = max(0.99 * PLASTIC * volume - mass, mass - 2700.0 * volume, 0.0)
        if link.inertial is None:
            continue
        if name == "base_link":
            found["iyy of the base"] = abs(link.inertial.iyy / mass - 0.0021417)
            found["izz of the base"] = abs(link.inertial.izz / mass - 0.0042667)
        elif name.endswith("_wheel") and not name.startswith("caster"):
            found[f"spin of {name}"] = abs(about_y(link.inertial) / mass - 0.0006125)
    joints = robot.joints
    if "right_wheel_joint" in joints:
        track = joints["left_wheel_joint"].pose.xyz[1] - joints["right_wheel_joint"].pose.xyz[1]
        found["track width"] = abs(track - 0.174)
    if "caster_wheel_joint" in joints:
        height = joints["base_link_joint"].pose.xyz[2] + joints["caster_wheel_joint"].pose.xyz[2]
        found["caster on the ground"] = abs(height - float(GUESSES["caster_wheel_radius"]))
    return found


def about_y(inertial: Inertial) -> float:
    """The moment about the y axis of the link, kg m^2. The frames of the chapter are turned about x only."""
    roll = inertial.pose.rpy[0]
    return float(inertial.iyy * np.cos(roll) ** 2 + inertial.izz * np.sin(roll) ** 2)


@pytest.fixture
def package(tmp_path: Path, shared: Path) -> Folder:
    return Folder(tmp_path / "kbot_description", shared / "chapter")


def test_a_learner_gets_a_driving_robot_by_hints_and_fixes_alone(package: Folder) -> None:
    quality = Quality(package.folder / ROBOT)
    for step in STEPS:
        step.typed(package)
        quality.distances.clear()  # the book may type a worse part; the hints may not make it worse
        quality.check()
        followed = follow(package.folder / step.checked, step.waits, quality.check)
        assert len(followed) == len(step.followed), (step.typed.__name__, followed)
        for line, expected in zip(followed, step.followed, strict=True):
            assert line.startswith(expected), step.typed.__name__
    # all distances are zero: masses of plastic, and tensors, track and ground as computed by hand
    assert quality.distances == pytest.approx(dict.fromkeys(quality.distances, 0.0), abs=1e-6)
    assert len(quality.distances) == 11
    for name in (ROBOT, "package.xml", RVIZ, GAZEBO):
        assert not any(d.is_error for d in check_file(str(package.folder / name), config=Config()))

    simulation = kbot.Simulation(str(package.folder / ROBOT))
    simulation.run(0.5)
    simulation.cmd_vel(0.2, 0.0)
    while simulation.odometry.pose.x < 2.0 and simulation.time < 20.0:
        simulation.run(0.1)
    reported, true = simulation.odometry.pose, simulation.ground_truth.pose
    assert reported.x >= 2.0
    assert math.hypot(true.x - reported.x, true.y - reported.y) < 0.01
