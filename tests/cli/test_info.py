"""Tests the command `kbot info`."""

import json

import pytest

from kbot.cli.main import run


def test_text(capsys):
    assert run(["info", "kbot"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("kbot: 5 links, 4 joints (2 movable), 1.15 kg\n")
    assert "wheel separation  0.174 m" in out
    assert "size            (0.16, 0.179, 0.07) m" in out


def test_json(capsys):
    assert run(["info", "kbot", "wheel_radius:=0.05", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["drive"]["radius"] == 0.05
    assert data["drive"]["separation"] == pytest.approx(0.174)
    assert [j["name"] for j in data["joints"]][:2] == ["base_link_joint", "left_wheel_joint"]
    assert data["links"][2]["file"].endswith("kbot_macros.xacro")


HOLONOMIC = (
    '<robot name="box"><link name="base_link"><inertial><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
    '<geometry><box size="0.3 0.2 0.1"/></geometry></collision></link><gazebo>'
    '<plugin name="move" filename="libgazebo_ros_planar_move.so"/></gazebo></robot>'
)


def test_a_holonomic_drive_is_described(capsys, tmp_path):
    path = tmp_path / "box.urdf"
    path.write_text(HOLONOMIC)
    assert run(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert "holonomic drive: a plugin moves the base itself, forwards and sideways\n" in out
    assert run(["info", str(path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["no_drive"] is None
    drive = data["drive"]
    assert (drive["kind"], drive["joints"], drive["sideways"], drive["casters"]) == (
        "body", [], True, ["base_link"]
    )  # fmt: skip


def test_a_robot_with_errors_prints_no_figures(capsys, tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text("<robot name='r'><link name='a'/><link name='b'/></robot>")
    assert run(["info", str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "U008" in captured.err
    assert "Traceback" not in captured.err
