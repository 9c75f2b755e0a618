"""`kbot sim --goto`: its output and its exit status."""

import json

import pytest

from kbot.cli.main import main


def _run(words):
    with pytest.raises(SystemExit) as ended:
        main(words)
    return ended.value.code or 0


def test_a_goal_that_is_reached(capsys):
    assert _run(["sim", "kbot", "--headless", "--goto", "0.5,0.2,0", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["navigation"]["state"] == "reached"
    assert result["pose"]["x"] == pytest.approx(0.5, abs=0.015)
    assert result["pose"]["y"] == pytest.approx(0.2, abs=0.015)


def test_goto_uses_a_declared_lidar(capsys):
    words = ["sim", "kbot", "lidar:=true", "--headless", "--world", "maze:size=3,seed=3"]
    assert _run([*words, "--goto", "1.2,1.2,0"]) == 0
    assert "goal        reached in" in capsys.readouterr().out


def test_an_invalid_sensor_is_reported_and_the_goal_is_reached(capsys, tmp_path):
    """Gazebo also runs without the sensor."""
    file = tmp_path / "bot.urdf"
    assert _run(["expand", "kbot", "-o", str(file)]) == 0
    imu = '<gazebo reference="imu_link"><sensor name="imu" type="imu"/></gazebo>'
    file.write_text(file.read_text().replace("</robot>", f"{imu}</robot>"))
    assert _run(["sim", str(file), "--headless", "--goto", "0.3,0,0"]) == 0
    assert "unknown link 'imu_link'" in capsys.readouterr().err


def test_a_goal_that_is_refused(capsys):
    assert _run(["sim", "kbot", "--headless", "--world", "maze:size=3,seed=3", "--goto", "0.3,0,0"]) == 1
    assert "goal        refused: the goal is inside an obstacle" in capsys.readouterr().out


def test_a_goal_that_is_not_reached_in_time_is_reported_in_metres(capsys):
    assert _run(["sim", "kbot", "--headless", "--goto", "5,0", "--duration", "1"]) == 1
    goal, driven, off, *_ = capsys.readouterr().out.splitlines()
    assert goal.startswith("goal        stuck: out of time: ")
    assert goal.endswith(" m left")
    assert driven.endswith(" m driven, 5.00 m planned")
    assert 4.0 < float(off.removesuffix(" m from the goal")) < 5.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--goto", "1"], "--goto takes X,Y in m, or X,Y,YAW"),
        (["--goto", "1,nan,2"], "finite"),
        (["--goto", "1e308,0,0"], "the goal (1e+308, 0) is further than 1e+06 m from the origin"),
        (["--goto", "0,-2e6,0"], "the goal (0, -2e+06) is further than 1e+06 m from the origin"),
        (["--goto", "1,2,3", "--cmd-vel", "0.1,0"], "Remove --cmd-vel"),
    ],
)
def test_invalid_goals_and_options_are_errors(capsys, words, message):
    assert _run(["sim", "kbot", "--headless", *words]) == 2
    assert message in capsys.readouterr().err


def test_goto_and_a_script_both_drive(capsys):
    assert _run(["sim", "kbot", "--goto", "1,2,3", "--script", "drive.py"]) == 2
    assert "--goto drives the robot. Remove --script" in capsys.readouterr().err
