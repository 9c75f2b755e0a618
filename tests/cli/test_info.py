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


def test_a_robot_with_errors_prints_no_figures(capsys, tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text("<robot name='r'><link name='a'/><link name='b'/></robot>")
    assert run(["info", str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "U008" in captured.err
    assert "Traceback" not in captured.err
