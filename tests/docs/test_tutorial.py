"""The tutorial: a reader who types what it shows gets the files, output and robot that it promises."""

import math
import os
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kbot
from kbot.checks import check_file
from kbot.cli.main import run
from kbot.record import Recording
from kbot.sim.script import Script

from .pages import DOCS, blocks, commands, matches, sections

STEPS = DOCS / "tutorial" / "steps"
BUILD = {heading: text for heading, text in sections("tutorial/build.md").items() if heading[0].isdigit()}
PROGRAM = sections("tutorial/program.md")
FILES = {
    1: "01_empty",
    2: "02_base",
    3: "03_inertia",
    4: "04_wheels",
    5: "05_caster",
    6: "05_caster",
    7: "07_colours",
    8: "08_fixed",
    9: "09_drive",
    10: "09_drive",
}
"""The robot's file after each step."""


def number(heading: str) -> int:
    return int(heading.partition(".")[0])


def step(name: str) -> Path:
    return STEPS / f"{name}.xacro"


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The reader's folder `my_robot`, which is the working directory."""
    folder = tmp_path / "my_robot"
    (folder / "urdf").mkdir(parents=True)
    monkeypatch.chdir(folder)
    return folder


def shown(text: str) -> list[str]:
    """The lines of the xml blocks of a step, without indentation."""
    return [line.strip() for block in blocks(text, "xml") for line in block.splitlines() if line.strip()]


@pytest.mark.parametrize("heading", BUILD)
def test_the_page_shows_every_line_of_the_file(heading):
    """Each step's file has the lines of the step before, without those that the page replaces, and exactly
    the lines that the page shows."""
    this, last = FILES[number(heading)], FILES.get(number(heading) - 1)
    after = [line.strip() for line in step(this).read_text().splitlines() if line.strip()]
    before = [line.strip() for line in step(last).read_text().splitlines() if line.strip()] if last else []
    for block in blocks(BUILD[heading], "xml"):
        if number(heading) < 10:  # step 10 shows a launch file
            lines = [line.strip() for line in block.splitlines() if line.strip()]
            assert any(after[i : i + len(lines)] == lines for i in range(len(after)))
    for line in set(after):
        assert after.count(line) <= before.count(line) + shown(BUILD[heading]).count(line)


@pytest.mark.parametrize("heading", BUILD)
def test_each_command_prints_what_the_page_shows(heading, package, capsys):
    """Commands that check run on the file as it is when the reader types them."""
    target = package / "urdf" / "my_robot.xacro"
    shutil.copy(step(FILES[number(heading)]), target)
    if number(heading) == 8:
        shutil.copy(step("07_colours"), target)
    for command in commands(BUILD[heading]):
        type_in(command, capsys)


def type_in(command, capsys):
    """Run a command of the page, and compare what it prints."""
    program, *words = command.words
    if program == "cd":
        os.chdir(*words)  # the fixture goes back
        return
    assert program == "kbot"
    run(words)
    printed = capsys.readouterr()
    assert matches(command.output, printed.out + printed.err), f"{command}\n{printed.out}{printed.err}"


def codes(file):
    return [finding.code for finding in check_file(str(file))]


def pose(name, link, **joints):
    return kbot.load(step(name)).pose(link, in_frame="base_footprint", joints=joints)


def test_step_2_the_base_is_behind_the_axle_and_above_the_ground():
    assert pose("02_base", "base_link").translation == pytest.approx([-0.02, 0.0, 0.04])


def test_step_3_the_macro_gives_the_inertia_of_the_plate():
    inertial = kbot.load(step("03_inertia")).links["base_link"].inertial
    side, height, mass = 0.16, 0.01, 0.5
    flat, upright = mass * (side**2 + height**2) / 12, mass * 2 * side**2 / 12
    assert inertial.mass == mass
    assert np.diag(inertial.tensor) == pytest.approx([flat, flat, upright])


def test_step_4_the_wheels_stand_on_the_ground_beside_the_base():
    for link, y in (("left_wheel", 0.087), ("right_wheel", -0.087)):
        assert pose("04_wheels", link).translation == pytest.approx([0.0, y, 0.035])
    assert "D116" in codes(step("04_wheels"))  # "The robot would fall over on two wheels"


def test_step_5_the_caster_touches_the_ground_at_any_wheel_radius():
    assert "D116" not in codes(step("05_caster"))
    for radius in (0.035, 0.05):
        robot = kbot.load(step("05_caster"), properties={"wheel_radius": radius})
        caster = robot.pose("caster", in_frame="base_footprint")
        assert caster.translation == pytest.approx([-0.08, 0.0, radius / 2])


def test_step_6_the_slider_turns_the_wheel_about_y():
    turned = pose("05_caster", "left_wheel", left_wheel_joint=math.pi / 2)
    assert turned.translation == pytest.approx([0.0, 0.087, 0.035])
    assert turned.rotation @ [0.0, 1.0, 0.0] == pytest.approx([0.0, 1.0, 0.0])
    assert turned.rotation @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 0.0, -1.0])
    assert pose("05_caster", "caster", left_wheel_joint=1.0) == pose("05_caster", "caster")


def test_step_6_the_picture_is_written(package):
    shutil.copy(step("05_caster"), package / "urdf" / "my_robot.xacro")
    [line] = [
        line for line in BUILD["6. Look at it and move its joints"].splitlines() if "kbot export" in line
    ]
    assert run([*line.split()[1:], "--size", "64x48"]) == 0  # a large picture takes seconds
    assert (package / "my_robot.png").read_bytes().startswith(b"\x89PNG")


def test_step_7_each_link_has_its_colour():
    robot = kbot.load(step("07_colours"))
    colours = {name: link.visuals[0].material for name, link in robot.links.items() if link.visuals}
    assert {name: material.name for name, material in colours.items()} == {
        "base_link": "blue",
        "left_wheel": "black",
        "right_wheel": "black",
        "caster": "red",
    }


def test_step_8_the_fixes_give_the_file(package):
    target = package / "urdf" / "my_robot.xacro"
    shutil.copy(step("07_colours"), target)
    assert run(["check", str(target), "--unsafe-fixes"]) == 0
    assert target.read_text() == step("08_fixed").read_text()
    assert codes(target) == []


def test_step_8_the_caster_no_longer_drags():
    """If every shape collides as it is written, the first caster drags in a turn. The fixed ball slides."""

    def off(name):
        sim = kbot.Simulation(step(name), contacts="as-written")
        sim.cmd_vel(0.0, 1.0)
        sim.run(2 * math.pi)
        return abs(sim.odometry.pose.yaw - sim.ground_truth.pose.yaw)

    assert off("08_fixed") < 0.5 * off("07_colours")


@pytest.mark.parametrize("name", ["08_fixed", "09_drive"])
def test_step_9_the_robot_drives_as_far_as_the_page_claims(name):
    """0.2 m/s with an acceleration of 1 m/s^2: the first 0.2 s are worth half, so 5.2 s give 1.02 m. The page
    rounds what KBot prints; the control period delays it."""
    sim = kbot.Simulation(step(name))
    sim.cmd_vel(0.2, 0.0)
    sim.run(5.2)
    assert sim.ground_truth.pose.x == pytest.approx(0.2 * (5.2 - 0.1), abs=0.01)
    assert sim.odometry.pose.x == pytest.approx(sim.ground_truth.pose.x, abs=1e-5)


def test_step_9_a_size_that_does_not_match_is_reported(tmp_path):
    wrong = tmp_path / "robot.xacro"
    wrong.write_text(step("09_drive").read_text().replace("${2*wheel_y}", "0.15"))
    assert codes(wrong) == ["D105"]


def test_step_10_the_launch_file_has_the_lines_that_the_page_shows(finished):
    launch = (finished / "launch" / "simulate.launch").read_text()
    shown = blocks(BUILD["10. A package with a launch file"], "xml")
    assert len(shown) == 2
    assert all(block in launch for block in shown)


@pytest.fixture
def finished(package):
    """The reader's folder at the end of step 10."""
    shutil.copy(step("09_drive"), package / "urdf" / "my_robot.xacro")
    os.chdir(package.parent)
    assert run(["new", "my_robot"]) == 0
    os.chdir(package)
    for name in ("drive.py", "avoid.py", "test_my_robot.py"):
        shutil.copy(STEPS / name, package)
    (package / "scripts").mkdir()
    shutil.copy(STEPS / "metre.py", package / "scripts")
    shutil.copy(STEPS / "metre.launch", package / "launch")
    return package


@pytest.mark.parametrize(
    ("heading", "language", "names"),
    [
        ("11. Drive by a program", "python", ["drive.py"]),
        ("12. Avoid a wall", "python", ["avoid.py"]),
        ("13. Test it", "python", ["test_my_robot.py"]),
        ("14. Launch it on ROS", "python", ["metre.py"]),
        ("14. Launch it on ROS", "xml", ["metre.launch"]),
    ],
)
def test_the_page_shows_the_programs(heading, language, names):
    assert blocks(PROGRAM[heading], language) == [(STEPS / name).read_text() for name in names]


@pytest.mark.parametrize("heading", ["11. Drive by a program", "12. Avoid a wall"])
def test_each_program_prints_what_the_page_shows(heading, finished, capsys):
    capsys.readouterr()
    for command in commands(PROGRAM[heading]):
        type_in(command, capsys)


def test_step_12_the_robot_touches_no_wall():
    sim = kbot.Simulation(step("09_drive"), world="rooms:columns=1,rows=1,size=2")
    Script(str(STEPS / "avoid.py")).run(sim)
    assert not sim.collided


def pytest_of(folder):
    """The outcome of the reader's tests, by name."""
    words = [sys.executable, "-m", "pytest", "-q", "-rA", "-p", "no:cacheprovider", "--color=no"]
    ran = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    return {name: result for result, name in re.findall(r"^(PASSED|FAILED) \S+::(\w+)", ran.stdout, re.M)}


def test_step_13_the_tests_pass_and_find_the_fault_that_the_page_suggests(finished):
    names = re.findall(r"def (test_\w+)", (STEPS / "test_my_robot.py").read_text())
    assert pytest_of(finished) == dict.fromkeys(names, "PASSED")
    robot = finished / "urdf" / "my_robot.xacro"
    robot.write_text(robot.read_text().replace("${2*wheel_y}", "0.2"))
    assert pytest_of(finished) == dict(zip(names, ["FAILED", "FAILED", "PASSED"], strict=True))


def test_step_14_the_node_drives_a_metre_and_ends_the_launch(finished, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    words = ["launch", "my_robot", "metre.launch", "--no-browser", "--port", "0", "--record", "run.mcap"]
    ran = subprocess.run(
        [sys.executable, "-m", "kbot", *words],
        cwd=finished,
        env=os.environ | {"ROS_MASTER_URI": f"http://127.0.0.1:{port}/", "XDG_RUNTIME_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert "stopped at x = 1." in ran.stdout
    entries = Recording(str(finished / "run.mcap")).entries()
    *_, last = (entry for entry in entries if entry.topic == "/odom")
    x = last.message().pose.pose.position.x
    assert 1.0 <= x < 1.1  # it brakes for 2 cm; messages arrive later on a busy machine
