"""Tests the edits that write estimates, at the lines that define them: in macros, properties and YAML."""

from pathlib import Path

import numpy as np
import pytest

from kbot.cli.main import run
from kbot.identify.agreement import Agreement, agreement
from kbot.identify.csv_file import read_csv
from kbot.identify.nominal import read_nominal

from .synthetic import DISPLACEMENTS, Truth, rows, speeds, write

# ruff: noqa: E501 - descriptions and YAML in few lines
ROBOT = """<robot name="rover" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="radius" value="0.04"/>
  <xacro:property name="track" value="0.2"/>
  <xacro:macro name="wheel" params="side sign radius">
    <link name="${side}_wheel">
      <inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision>
        <origin rpy="${pi/2} 0 0"/>
        <geometry><cylinder radius="${radius}" length="0.02"/></geometry>
      </collision>
    </link>
    <joint name="${side}_joint" type="continuous">
      <parent link="base_link"/>
      <child link="${side}_wheel"/>
      <origin xyz="0 ${sign*track/2} 0.04"/>
      <axis xyz="0 1 0"/>
    </joint>
  </xacro:macro>
  <link name="base_link">
    <inertial>
      <origin xyz="-0.03 0 0.05"/>
      <mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision><origin xyz="-0.08 0 0.01"/><geometry><sphere radius="0.01"/></geometry></collision>
  </link>
  WHEELS
  <link name="laser"/>
  <joint name="laser_joint" type="fixed">
    <parent link="base_link"/>
    <child link="laser"/>
    <origin xyz="0.1 0 0.2" rpy="0 0 0"/>
  </joint>
  CONTROLLER
</robot>
"""
SHARED = '<xacro:wheel side="left" sign="1" radius="${radius}"/><xacro:wheel side="right" sign="-1" radius="${radius}"/>'
OWN = '<xacro:wheel side="left" sign="1" radius="0.04"/><xacro:wheel side="right" sign="-1" radius="0.04"/>'
PLUGIN = (
    '<gazebo><plugin name="d" filename="libgazebo_ros_diff_drive.so"><leftJoint>left_joint</leftJoint>'
    "<rightJoint>right_joint</rightJoint><wheelSeparation>${track}</wheelSeparation>"
    "<wheelDiameter>${2*radius}</wheelDiameter></plugin></gazebo>"
)
ALL = np.zeros(300, dtype=bool)
TRUTH = Truth(0.042, 0.0425, 0.21, 0.12, 0.01, 0.05)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The working directory. Files elsewhere are not changed."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def log(tmp_path: Path) -> str:
    rng = np.random.default_rng(5)
    table = rows(TRUTH, speeds(TRUTH, 300, rng), rng, slip=0.005, noise=(0.0005, 0.001))
    return str(write(tmp_path / "drive.csv", DISPLACEMENTS, table))


def robot(tmp_path: Path, wheels: str, controller: str = "") -> Path:
    file = tmp_path / "rover.xacro"
    file.write_text(ROBOT.replace("WHEELS", wheels).replace("CONTROLLER", controller))
    return file


def fixed(log: str, file: Path):
    assert run(["identify", log, str(file), "--sensor", "laser", "--fix", "--yes"]) == 0
    return read_nominal(str(file), {}, {}, (), "laser").values


def test_each_value_is_written_where_it_is_defined(log, tmp_path, capsys):
    file = robot(tmp_path, OWN)
    values = fixed(log, file)
    for name, value in values.items():
        assert value == pytest.approx(getattr(TRUTH, name), abs=0.003), name
    assert values["right_wheel_radius"] > values["left_wheel_radius"]
    out = capsys.readouterr().out
    assert '-  <xacro:property name="track" value="0.2"/>' in out
    after = file.read_text()
    assert '<cylinder radius="${radius}"' in after  # the macro is not changed
    assert '<origin xyz="0 ${sign*track/2} 0.04"/>' in after


def test_one_radius_of_both_wheels_becomes_their_mean(log, tmp_path, capsys):
    values = fixed(log, robot(tmp_path, SHARED, PLUGIN))
    assert values["left_wheel_radius"] == values["right_wheel_radius"] == pytest.approx(0.04225, abs=1e-4)
    out = capsys.readouterr().out
    assert "to write: radius of both wheels 0.0422" in out
    assert "not written: the difference between the wheels" in out
    assert "left_wheel_radius_multiplier" in out


def test_the_simulation_agrees_better_afterwards(log, tmp_path, capsys):
    file = robot(tmp_path, OWN, PLUGIN.replace("${2*radius}", "0.08"))
    before = agreement(read_csv(log), read_nominal(str(file), {}, {}, (), "laser"), ALL)
    fixed(log, file)
    after = agreement(read_csv(log), read_nominal(str(file), {}, {}, (), "laser"), ALL)
    assert after.distance < 0.5 * before.distance
    assert f"{after.distance:.3g} m and" in capsys.readouterr().out


def test_drives_that_end_farther_from_the_log_are_reported(tmp_path, capsys):
    truth = Truth(0.0395, 0.041, 0.2, 0.1, 0.0, 0.0)  # the mean is right, but the wheels differ by 4 %
    rng = np.random.default_rng(5)
    table = rows(truth, speeds(truth, 300, rng), rng, slip=0.005, noise=(0.0005, 0.001))
    log = str(write(tmp_path / "unequal.csv", DISPLACEMENTS, table))
    fixed(log, robot(tmp_path, SHARED, PLUGIN))
    out = capsys.readouterr().out
    assert "not written: the difference between the wheels (0.981" in out
    assert "the drives end farther from the log than before: see what is not written" in out


def written_parameters(log, folder, more):
    """The parameters of a controller with these lines after `kbot identify --fix`."""
    (folder / "controllers.yaml").write_text(
        "controller_manager:\n  ros__parameters:\n    drive:\n      type: diff_drive_controller/DiffDriveController\n"
        "drive:\n  ros__parameters:\n    left_wheel_names: [left_joint]\n    right_wheel_names: [right_joint]\n"
        f"    wheel_separation: 0.2\n    wheel_radius: 0.04  # m\n{more}"
    )
    controller = (
        '<gazebo><plugin filename="libgz_ros2_control-system.so" name="gz_ros2_control::GazeboSimROS2ControlPlugin">'
        f"<parameters>{folder}/controllers.yaml</parameters></plugin></gazebo>"
        '<ros2_control name="r" type="system"><hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>'
        '<joint name="left_joint"><command_interface name="velocity"/></joint>'
        '<joint name="right_joint"><command_interface name="velocity"/></joint></ros2_control>'
    )
    fixed(log, robot(folder, SHARED, controller))
    lines = (folder / "controllers.yaml").read_text().splitlines()
    return dict(line.strip().split(": ", 1) for line in lines if ": " in line)


def test_multipliers_of_a_controller_are_written(log, tmp_path):
    more = "    left_wheel_radius_multiplier: 1.0\n    right_wheel_radius_multiplier: 1.0\n"
    written = written_parameters(log, tmp_path, more)
    assert float(written["wheel_separation"]) == pytest.approx(0.21, abs=1e-3)
    assert written["wheel_radius"].endswith("  # m")
    left, right = (float(written[f"{side}_wheel_radius_multiplier"]) for side in ("left", "right"))
    assert right / left == pytest.approx(0.0425 / 0.042, abs=5e-4)


def test_radius_is_written_for_multipliers_that_keep_their_values(log, tmp_path):
    """The controller computes with the mean of 0.9 and 1 times `wheel_radius`. Without the multiplier of the
    right side, KBot does not write the difference between the wheels."""
    written = written_parameters(log, tmp_path, "    left_wheel_radius_multiplier: 0.9\n")
    assert written["left_wheel_radius_multiplier"] == "0.9"
    assert 0.95 * float(written["wheel_radius"].split()[0]) == pytest.approx(0.04225, abs=1e-4)


def test_nothing_is_written_without_an_answer(log, tmp_path, capsys, monkeypatch):
    file = robot(tmp_path, SHARED)
    before = file.read_text()
    assert run(["identify", log, str(file), "--sensor", "laser", "--fix"]) == 2
    assert "Add --yes" in capsys.readouterr().err
    assert file.read_text() == before


def test_the_shipped_robot_is_not_changed(log, capsys):
    assert run(["identify", log, "kbot", "--fix", "--yes"]) == 2
    assert "is part of KBot" in capsys.readouterr().err


def test_a_value_that_agrees_is_not_written(log, tmp_path, capsys):
    file = robot(tmp_path, OWN)
    fixed(log, file)
    capsys.readouterr()
    before = file.read_text()
    fixed(log, file)
    assert "nothing to write" in capsys.readouterr().out
    assert file.read_text() == before


def test_a_sensor_at_the_property_of_the_wheels_does_not_move_them(log, tmp_path, capsys):
    text = ROBOT.replace("WHEELS", OWN).replace("CONTROLLER", "")
    text = text.replace('xyz="0.1 0 0.2"', 'xyz="${ahead} 0 0.2"').replace('"0 ${sign', '"${ahead} ${sign')
    text = text.replace("<xacro:macro", '<xacro:property name="ahead" value="0.05"/>\n  <xacro:macro', 1)
    file = tmp_path / "rover.xacro"
    file.write_text(text)
    before = read_nominal(str(file), {}, {}, (), "laser").drive.axle_in_base.translation[0]
    fixed(log, file)
    after = read_nominal(str(file), {}, {}, (), "laser")
    assert after.drive.axle_in_base.translation[0] == pytest.approx(before)
    assert after.values["sensor_y"] == pytest.approx(TRUTH.sensor_y, abs=0.003)
    assert "not written: xyz x of 'laser'" in capsys.readouterr().out


@pytest.mark.parametrize("origin", ['<origin xyz="0.1 0 0.2"/>', '<origin rpy="0 0 0"/>', ""])
def test_the_missing_origin_of_a_sensor_is_added(log, tmp_path, origin):
    file = robot(tmp_path, OWN)
    file.write_text(file.read_text().replace('<origin xyz="0.1 0 0.2" rpy="0 0 0"/>', origin))
    for name, value in fixed(log, file).items():
        assert value == pytest.approx(getattr(TRUTH, name), abs=0.003), name


def test_a_wheel_without_an_origin_does_not_keep_the_radii_from_being_written(log, tmp_path, capsys):
    file = robot(tmp_path, OWN)
    mount = (
        '<link name="${side}_mount"/><joint name="${side}_mount_joint" type="fixed"><parent link="base_link"/>'
        '<child link="${side}_mount"/><origin xyz="0 ${sign*track/2} 0.04"/></joint>\n    <joint name="${side}_joint"'
    )
    text = file.read_text().replace('<origin xyz="0 ${sign*track/2} 0.04"/>', "", 1)
    text = text.replace(
        'type="continuous">\n      <parent link="base_link"/>',
        'type="continuous">\n      <parent link="${side}_mount"/>',
    )
    file.write_text(text.replace('<joint name="${side}_joint"', mount, 1))
    values = fixed(log, file)
    assert values["left_wheel_radius"] == pytest.approx(TRUTH.left_wheel_radius, abs=1e-4)
    assert values["sensor_yaw"] == pytest.approx(TRUTH.sensor_yaw, abs=0.003)
    assert "not written: wheel_separation: joint 'left_joint' has no <origin xyz>" in capsys.readouterr().out


def test_a_parameter_without_a_place_in_the_description_is_reported(log, tmp_path, capsys):
    rng = np.random.default_rng(5)
    table = rows(TRUTH, speeds(TRUTH, 100, rng), rng, slip=0.005, noise=(0.0005, 0.001))
    turning = np.column_stack([table, 1.05 * table[:, 5] / table[:, 0]])
    path = write(tmp_path / "gyro.csv", DISPLACEMENTS + ",imu_wz", turning)
    fixed(str(path), robot(tmp_path, OWN))
    out = capsys.readouterr().out
    assert "not written: gyro_scale: a description has no place for it" in out
    assert "wrote rover.xacro\n" in out or f"wrote {tmp_path}/rover.xacro\n" in out


def test_drives_in_which_the_robot_stands_are_not_compared(tmp_path):
    rng = np.random.default_rng(5)
    moving = rows(TRUTH, speeds(TRUTH, 60, rng), rng)
    standing = rows(TRUTH, np.zeros((60, 2)), rng)
    log = read_csv(str(write(tmp_path / "stop.csv", DISPLACEMENTS, np.vstack([moving, standing]))))
    nominal = read_nominal(str(robot(tmp_path, OWN)), {}, {}, (), "laser")
    found = agreement(log, nominal, np.zeros(120, dtype=bool))
    assert 5 <= found.drives <= 7  # 30 s of motion and 30 s of standing


def test_a_larger_angle_is_farther():
    before = Agreement(0.01, 0.02, 5.0, 8)
    assert Agreement(0.009, 0.021, 5.0, 8).is_farther_than(before)
    assert Agreement(0.011, 0.019, 5.0, 8).is_farther_than(before)
    assert not Agreement(0.009, 0.02 + 1e-9, 5.0, 8).is_farther_than(before)


def test_a_file_of_another_package_is_not_changed(log, tmp_path, capsys, monkeypatch):
    """As one in /opt/ros that the robot includes."""
    other, own = tmp_path / "opt", tmp_path / "own"
    other.mkdir()
    own.mkdir()
    included = robot(other, OWN)
    before = included.read_text()
    file = own / "robot.xacro"
    file.write_text(
        '<robot name="robot" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        f'<xacro:include filename="{included}"/></robot>'
    )
    monkeypatch.chdir(own)
    assert run(["identify", log, str(file), "--sensor", "laser", "--fix", "--yes"]) == 2
    assert "rover.xacro is outside the working directory. Copy this file" in capsys.readouterr().err
    assert included.read_text() == before


def test_the_named_file_is_changed_wherever_it_is(log, tmp_path, monkeypatch):
    file = robot(tmp_path, OWN)
    before = file.read_text()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert run(["identify", log, str(file), "--sensor", "laser", "--fix", "--yes"]) == 0
    assert file.read_text() != before
