"""Tests `kbot sim --headless`: what it prints and how it ends."""

import json
import math
import re
import threading

import numpy as np
import pytest
from PIL import Image

from kbot.cli.main import run
from kbot.cli.sim import still_time
from kbot.kinematics.planar_pose import PlanarPose
from kbot.render.path_plot import END, START
from kbot.sim.report import RunReport
from kbot.text import KbotError
from kbot.text.crash import report_thread_error


def simulate(capsys, *words):
    status = run(["sim", *words])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def report_of(capsys, *words):
    status, out, err = simulate(capsys, *words, "--headless", "--json")
    assert status == 0, err
    return json.loads(out)


def test_the_report_has_the_documented_keys(capsys):
    report = report_of(capsys, "kbot", "--duration", "2", "--cmd-vel", "0.2,0")
    promised = "pose odometry distance_m turned_rad steps simulated_s wall_s real_time_factor state_sha256"
    assert set(report) == {*promised.split(), "findings"}
    assert set(report["pose"]) == set(report["odometry"]) == {"x", "y", "yaw"}
    assert report["steps"] == 1000
    assert report["simulated_s"] == 2.0
    assert report["pose"]["x"] == pytest.approx(report["odometry"]["x"], abs=1e-5)
    assert report["distance_m"] == pytest.approx(report["pose"]["x"], abs=1e-6)


def test_the_turn_counts_full_turns(capsys):
    words = ("kbot", "--pose", "0,0,1", "--duration", "5", "--cmd-vel", "0,-2")
    report = report_of(capsys, *words)
    rest = (report["pose"]["yaw"] - 1.0 - report["turned_rad"]) / (2.0 * math.pi)
    assert rest == pytest.approx(round(rest), abs=1e-9)
    assert report["turned_rad"] == pytest.approx(-10.0, abs=0.5)  # commanded, less the start


def test_equal_runs_have_equal_digests_and_others_do_not(capsys):
    words = ("kbot", "--duration", "1", "--cmd-vel", "0.2,0.5")
    first, second = (report_of(capsys, *words)["state_sha256"] for _ in range(2))
    other = report_of(capsys, "kbot", "--duration", "1", "--cmd-vel", "0.2,0.4")["state_sha256"]
    assert first == second != other


def test_values_that_round_to_zero_have_no_sign():
    odometry = PlanarPose(-1e-9, 1e-9, -1e-9)
    report = RunReport(
        PlanarPose(-1e-9, -0.1, 0.0), odometry, 0.0, 0.0, 0, 0.0, 0.0, "", PlanarPose(0.0, 0.0, 0.0)
    )
    assert "-0.0000" not in report.to_text()
    assert "-0.000 deg" not in report.to_text()
    assert "-0.1000 m" in report.to_text()


def test_arguments_change_the_robot(capsys):
    """With twice the wheel radius, the same command gives the same distance and half as many wheel turns."""
    large = report_of(capsys, "kbot", "wheel_radius:=0.07", "--duration", "2", "--cmd-vel", "0.2,0")
    assert large["pose"]["x"] == pytest.approx(0.2 * 2 - 0.2**2 / 2, abs=0.01)


def test_a_fault_in_a_macro_is_reported_once_with_its_calls(capsys, tmp_path):
    file = tmp_path / "rover.xacro"
    file.write_text(
        '<robot name="rover" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base"/>\n'
        '<xacro:macro name="ball" params="name">\n<link name="${name}"><inertial><mass value="1"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><sphere radius="0.1"/></geometry></collision></link>'
        '<joint name="${name}_joint" type="fixed"><parent link="base"/><child link="${name}"/></joint>\n'
        '<gazebo reference="${name}"><mu1>1</mu1><mu2>0.5</mu2></gazebo>\n</xacro:macro>\n'
        '<xacro:ball name="one"/>\n<xacro:ball name="two"/>\n<xacro:ball name="three"/>\n</robot>\n'
    )
    status, _, err = simulate(capsys, str(file), "--headless", "--duration", "0.1")
    assert status == 0
    assert err.count("[W136]") == 1
    assert err.count("also: friction by direction is not simulated") == 2
    assert f"{file}:4:1: info: friction by direction" in err


def test_missing_parts_of_ros2_control_are_reported_and_the_rest_is_simulated(capsys, tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(
        '<robot name="arm"><link name="world"/><link name="bar"><inertial><mass value="1"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>\n'
        '<joint name="lift" type="revolute"><parent link="world"/><child link="bar"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="50" velocity="1"/></joint>\n'
        '<ros2_control name="c" type="system">'
        "<hardware>\n<plugin>gz_ros2_control/GazeboSimSystm</plugin></hardware>\n"
        '<joint name="lift"><command_interface name="pos"/></joint></ros2_control></robot>'
    )
    status, _, err = simulate(capsys, str(file), "--headless", "--duration", "0.1")
    assert status == 0
    assert f"{file}:4:1: warning: on ROS: there is no hardware plugin 'gz_ros2_control/GazeboSimSystm'" in err
    assert "did you mean 'gz_ros2_control/GazeboSimSystem'" in err
    assert "lift: its hardware has no interface 'pos'" in err
    assert "did you mean 'position'?" in err


def test_a_report_for_people(capsys):
    status, out, err = simulate(capsys, "kbot", "--headless", "--duration", "1", "--cmd-vel", "0.2,0.5")
    assert status == 0
    assert "times real time" in out
    assert "odometry" in out
    assert err == ""


def test_a_script_drives(capsys, tmp_path):
    script = tmp_path / "drive.py"
    script.write_text("def drive(sim):\n    sim.cmd_vel(0.2, 0)\n    sim.run(3)\n    assert sim.time == 3\n")
    report = report_of(capsys, "kbot", "--script", str(script))
    assert report["simulated_s"] == 3.0


def test_a_failed_assertion_of_a_script_exits_with_1_and_prints_the_values(capsys, tmp_path):
    script = tmp_path / "drive.py"
    script.write_text(
        "LIMIT = 2.5\n\ndef drive(sim):\n    sim.cmd_vel(0.2, 0)\n    sim.run(1)\n"
        "    pose = sim.ground_truth.pose\n    assert pose.x > LIMIT, 'too short'\n"
    )
    status, out, err = simulate(capsys, "kbot", "--headless", "--script", str(script), "--json")
    assert status == 1
    failure = json.loads(out)["failure"]
    assert (failure["line"], failure["time_s"], failure["message"]) == (7, 1.0, "too short")
    assert failure["values"]["LIMIT"] == "2.5"
    assert f"{script}:7: assertion failed at 1.000 s: pose.x > LIMIT: too short" in err
    assert "pose.x = 0.1" in err


@pytest.mark.parametrize(
    ("body", "status", "message"),
    [
        (
            "sim.cmd_vel(0.3, 0)",
            0,
            "ended at 0 s: it never called sim.run(seconds), so no time passed\n",
        ),
        ("sim.run(1); sim.reset()", 0, ""),
        ("sim.run(1); sys.exit(3)", 1, "drive.py:3: drive.py ended with sys.exit(3)\n"),
        ("sim.run(1); sys.exit(0)", 0, ""),
        (
            "t = threading.Thread(target=lambda: 1 / 0); t.start(); t.join(); sim.run(1)",
            1,
            "error in a thread: drive.py:3: ZeroDivisionError",
        ),
    ],
)
def test_the_report_follows_however_a_script_ends(capsys, tmp_path, monkeypatch, body, status, message):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(threading, "excepthook", report_thread_error)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    (tmp_path / "drive.py").write_text(f"import sys, threading\ndef drive(sim):\n    {body}\n")
    ended, out, err = simulate(capsys, "kbot", "--headless", "--script", "drive.py")
    assert (ended, "simulated" in out) == (status, True)
    assert message in err if message else err == ""
    assert not (tmp_path / "kbot").exists()  # no crash file


def test_a_script_that_computes_for_long_is_reported_once(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(still_time, "PATIENCE_SECONDS", 1.0)
    (tmp_path / "drive.py").write_text(
        "import time\ndef drive(sim):\n    sim.run(1)\n    time.sleep(2.5)\n    sim.run(1)\n"
    )
    status, _, err = simulate(capsys, "kbot", "--headless", "--script", "drive.py")
    assert status == 0
    still = "drive.py:4 is running, but has not called sim.run for 1 s: simulated time stands still\n"
    assert err == still


def test_a_script_that_runs_for_0_steps_is_reported(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(still_time, "PATIENCE_SECONDS", 1.0)
    (tmp_path / "drive.py").write_text(
        "import time\ndef drive(sim):\n    end = time.monotonic() + 2.5\n"
        "    while time.monotonic() < end:\n        sim.run(0.0)\n    sim.run(1)\n"
    )
    status, _, err = simulate(capsys, "kbot", "--headless", "--script", "drive.py")
    assert status == 0
    assert re.fullmatch(
        r"drive\.py:[45] calls sim\.run for 0 steps: simulated time has stood still for 1 s\n", err
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def drve(sim): pass\n", "has no function drive(sim)"),
        ("def drive(sim:\n", "not valid Python"),
        ("def drive(sim):\n    sim.cmd_vel(0.1, 0)\n    1 / 0\n", ":3: ZeroDivisionError"),
        ("def drive(sim):\n    sim.run(-1)\n", "time to run"),
        ("def drive(sim):\n    while True: sim.run(0.001)\n", "rounds to no step"),
    ],
)
def test_an_unusable_script_exits_with_2(capsys, tmp_path, text, message):
    script = tmp_path / "drive.py"
    script.write_text(text)
    status, out, err = simulate(capsys, "kbot", "--headless", "--script", str(script))
    assert status == 2
    assert message in err
    assert out == ""
    assert "Traceback" not in err


@pytest.fixture
def sliding_box(tmp_path):
    """The file of a box that planar_move moves."""
    path = tmp_path / "box.urdf"
    path.write_text(
        '<robot name="box"><link name="base_link"><inertial><mass value="1"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
        '<geometry><box size="0.3 0.2 0.1"/></geometry></collision></link><gazebo>'
        '<plugin name="move" filename="libgazebo_ros_planar_move.so"/></gazebo></robot>'
    )
    return str(path)


def test_a_holonomic_robot_drives_sideways(capsys, sliding_box):
    report = report_of(capsys, sliding_box, "--duration", "2", "--cmd-vel", "0.1,-0.2,0")
    # v (t - v / 2a), with the default limit of 1 m/s^2
    assert report["pose"]["x"] == pytest.approx(0.1 * (2.0 - 0.05), abs=1e-3)
    assert report["pose"]["y"] == pytest.approx(-0.2 * (2.0 - 0.1), abs=1e-3)
    assert report["odometry"] == pytest.approx(report["pose"], abs=1e-9)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("nowhere.xacro", "--headless"), "nowhere.xacro does not exist"),
        (("kbot", "--headless", "--cmd-vel", "0.2"), "--cmd-vel takes V,W in m/s and rad/s"),
        (("kbot", "--headless", "--cmd-vel", "0.2,0.1,0"), "robot 'kbot' cannot drive sideways"),
        (("kbot", "--headless", "--cmd-vel", "0.2,0,0,1"), "or VX,VY,W for a robot that drives sideways"),
        (("kbot", "--headless", "--cmd-vel", "0.2,fast"), "--cmd-vel takes V,W in m/s and rad/s"),
        (("kbot", "--headless", "--cmd-vel", "nan,0"), "--cmd-vel takes finite numbers"),
        (("kbot", "--headless", "--cmd-vel", "0,inf"), "--cmd-vel takes finite numbers"),
        (("kbot", "--headless", "--duration", "nan"), "--duration takes a finite number"),
        (("kbot", "--headless", "--duration", "-1"), "--duration takes a finite number"),
        (("kbot", "--headless", "--duration", "soon"), "not a valid float"),
        (("kbot", "--headless", "--world", "boxs"), "did you mean 'boxes'"),
        (("kbot", "--headless", "--world", "maze:size=x"), "whole number"),
        (("kbot", "--headless", "--seed", "-1"), "--seed"),
        (("kbot", "--headless", "--contacts", "magic"), "--contacts"),
        (("kbot", "--headless", "--port", "8301"), "--port is for the page"),
        (
            ("kbot", "--headless", "--host", "0.0.0.0"),
            "--host is for the page",
        ),
        (("kbot", "--duration", "1"), "--duration needs --headless"),
        (("kbot", "--cmd-vel", "1,0"), "--cmd-vel needs --headless"),
        (("kbot", "--headless", "--script", "none.py"), "none.py does not exist"),
        (("kbot", "wheel_radius=0.04", "--headless"), "Write wheel_radius:=0.04"),
    ],
)
def test_bad_input_is_one_clear_message_and_status_two(capsys, words, message):
    status, out, err = simulate(capsys, *words)
    assert status == 2
    assert message in err
    assert out == ""
    assert "Traceback" not in err


def test_a_robot_without_wheels_reports_why_it_cannot_drive(capsys, tmp_path):
    file = tmp_path / "ball.urdf"
    inertia = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
    file.write_text(
        f'<robot name="ball"><link name="ball"><inertial><mass value="1"/>{inertia}</inertial>'
        '<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>'
    )
    assert report_of(capsys, str(file), "--duration", "1")["steps"] == 500
    status, _, err = simulate(capsys, str(file), "--headless", "--cmd-vel", "0.1,0")
    assert status == 2
    assert "robot 'ball' cannot drive: the robot has no movable joint" in err


def test_a_picture_is_drawn_even_of_a_drive_that_fails(capsys, tmp_path):
    """KBot's path, straight along x, ends to the right of its start."""
    script, picture = tmp_path / "drive.py", tmp_path / "drive.png"
    script.write_text("def drive(sim):\n    sim.cmd_vel(0.2, 0)\n    sim.run(3)\n    assert False\n")
    status, _, _ = simulate(
        capsys, "kbot", "--headless", "--world", "boxes", "--script", str(script), "--plot", str(picture)
    )
    assert status == 1
    drawn = np.asarray(Image.open(picture))
    (_, began), (_, ended) = (
        np.argwhere((drawn == colour).all(axis=-1)).mean(axis=0) for colour in (START, END)
    )
    assert ended > began + 100


def test_an_unwritable_picture_is_an_error(capsys, tmp_path):
    target = tmp_path / "nowhere" / "drive.png"
    status, _, err = simulate(capsys, "kbot", "--headless", "--duration", "1", "--plot", str(target))
    assert status == 2
    assert "cannot write" in err


@pytest.mark.parametrize("option", ["--plot", "--shot"])
def test_a_picture_overwrites_nothing_but_pictures(capsys, tmp_path, option):
    robot = tmp_path / "robot.xacro"
    robot.write_text("<robot name='r'/>")
    status, _, err = simulate(capsys, "kbot", "--headless", "--duration", "0", option, str(robot))
    assert (status, robot.read_text()) == (2, "<robot name='r'/>")
    assert "does not end in .png" in err
    status, _, err = simulate(capsys, "kbot", "--headless", "--plot", "a.png", "--shot", "a.png")
    assert status == 2
    assert "Choose two different files" in err


def test_a_picture_that_cannot_be_drawn_is_rejected_before_the_run(capsys, tmp_path, monkeypatch):
    def nothing(width, height):
        raise KbotError("no OpenGL")

    monkeypatch.setattr("kbot.render.offscreen._context", nothing)
    target = tmp_path / "end.png"
    status, out, err = simulate(capsys, "kbot", "--headless", "--duration", "1", "--shot", str(target))
    assert (status, out) == (2, "")
    assert "no OpenGL" in err


def test_the_report_is_printed_even_if_its_picture_cannot_be_written(capsys, tmp_path):
    taken = tmp_path / "drive.png"
    taken.mkdir()
    status, out, err = simulate(capsys, "kbot", "--headless", "--duration", "1", "--plot", str(taken))
    assert status == 2
    assert "simulated   1.000 s" in out
    assert "drive.png cannot be written" in err


def test_the_example_holds_for_kbot(capsys):
    from pathlib import Path

    script = Path(__file__).parents[2] / "examples" / "drive_test" / "drive_straight.py"
    assert report_of(capsys, "kbot", "--script", str(script))["distance_m"] == pytest.approx(2.0, abs=0.01)


def test_a_world_from_a_file(capsys, tmp_path):
    world = tmp_path / "yard.world"
    world.write_text(
        "<sdf version='1.7'><world name='yard'><include><uri>model://ground_plane</uri></include>"
        "<include><uri>model://wall</uri><pose>0.6 0 0 0 0 1.5707963</pose></include></world></sdf>"
    )
    report = report_of(capsys, "kbot", "--world", str(world), "--duration", "6", "--cmd-vel", "0.2,0")
    assert report["pose"]["x"] == pytest.approx(0.6 - 0.025 - 0.06, abs=0.02)
    status, _, err = simulate(capsys, "kbot", "--headless", "--world", str(tmp_path / "none.world"))
    assert status == 2
    assert "none.world does not exist" in err


def test_pose_sets_the_start(capsys):
    pose = report_of(capsys, "kbot", "--pose", "1,2,0.5", "--duration", "0.1")["pose"]
    assert (pose["x"], pose["y"], pose["yaw"]) == pytest.approx((1.0, 2.0, 0.5), abs=1e-6)
    for text, message in (("1,2", "takes X,Y,YAW"), ("1,2,nan", "takes finite numbers")):
        status, _, err = simulate(capsys, "kbot", "--headless", "--pose", text)
        assert status == 2
        assert message in err
