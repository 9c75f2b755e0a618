"""Tests the command `kbot compare`: files, packages, revisions, recordings, exit status and JSON."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from mcap.writer import Writer

from kbot.cli import main
from kbot.cli.compare import command as compare_command
from kbot.model.load import SHIPPED_PACKAGE, load_robot
from kbot.text import KbotError
from kbot.trials import Command, RobotSource, Scenario, Step, run_trial

NOTHING = {
    "schema": 1,
    "changed": False,
    "measures": [],
    "declared": [],
    "causes": [],
    "without_effect": [],
}
DRIVE = """\
duration: 3
steps:
  - command: {linear: 0.2, angular: 0.5}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with two copies of the shipped package and a short scenario."""
    monkeypatch.chdir(tmp_path)
    for name in ("before", "after"):
        shutil.copytree(SHIPPED_PACKAGE, tmp_path / name, copy_function=shutil.copyfile)
    (tmp_path / "drive.scenario.yaml").write_text(DRIVE)
    return tmp_path


def run(*words: str) -> Result:
    return CliRunner().invoke(compare_command, list(words), catch_exceptions=False, standalone_mode=False)


def compare(*words: str) -> dict[str, Any]:
    result = run(*words, "--scenario", "drive.scenario.yaml", "-j", "1", "--json")
    found: dict[str, Any] = json.loads(result.stdout)
    assert result.return_value == int(found["changed"])
    return found


def edit(path: Path, old: str, new: str) -> int:
    """Replace a text that occurs once. Returns its line."""
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return text[: text.index(old)].count("\n") + 1


def test_the_edited_line_is_the_cause(folder: Path) -> None:
    robot = folder / "after" / "urdf" / "kbot.xacro"
    line = edit(robot, "${base_width + 2*base_wheel_gap}", "${1.1*base_width + 2*base_wheel_gap}")
    edit(robot, '<xacro:property name="wheel_width"', '<!-- as built -->\n<xacro:property name="wheel_width"')
    result = compare("before", "after")
    assert result["changed"]
    (cause,) = result["causes"]
    assert cause["file"] == "after/urdf/kbot.xacro"
    assert cause["line"] == line + (line > robot.read_text().split("as built")[0].count("\n"))
    assert "wheel_separation" in cause["before"]
    assert "1.1*base_width" in cause["after"]
    assert cause["measures"]
    assert any(m["significant"] for m in result["measures"])


def test_a_comment_changes_nothing(folder: Path) -> None:
    edit(folder / "after" / "urdf" / "kbot.xacro", "</robot>", "<!-- the end --></robot>")
    assert compare("before", "after") == NOTHING


def test_values_apply_to_both(folder: Path) -> None:
    assert not compare("kbot", "kbot", "wheel_radius:=0.04")["changed"]


def test_a_change_that_is_below_every_floor_is_no_change(folder: Path) -> None:
    # a thousandth of the mass
    line = edit(folder / "after" / "urdf" / "kbot.xacro", "${4000*base_len", "${4004*base_len")
    result = compare("before", "after")
    assert not result["changed"]
    assert result["measures"]
    assert result["causes"] == []
    assert [each["line"] for each in result["without_effect"]] == [line]


CORRIDOR = """\
world: corridor
duration: 1
"""


@pytest.mark.parametrize("world", ["corridor", "empty"])
def test_a_turned_lidar_is_a_change_at_its_line(folder: Path, world: str) -> None:
    """In the corridor, a scan that is turned by 90 degrees differs. In the empty world there is none."""
    (folder / "drive.scenario.yaml").write_text(CORRIDOR.replace("corridor", world))
    line = edit(
        folder / "after" / "urdf" / "kbot_lidar.xacro", '${lidar_height}" rpy="0 0 0"',
        '${lidar_height}" rpy="0 0 ${pi/2}"',
    )  # fmt: skip
    result = compare("before", "after", "lidar:=true")
    assert result["changed"]
    yaw = next(d for d in result["declared"] if d["part"] == "sensor lidar")
    assert (yaw["setting"], yaw["unit"], yaw["before"]) == ("yaw", "rad", 0.0)
    assert yaw["after"] == pytest.approx(math.pi / 2.0)
    (cause,) = result["causes"]
    assert (cause["file"], cause["line"]) == ("after/urdf/kbot_lidar.xacro", line)
    assert cause["declared"] == ["sensor lidar yaw", "frame lidar_link yaw"]
    found = {m["measure"]: m for m in result["measures"]}
    is_seen = world == "corridor"
    assert found["scan_share/lidar"]["significant"] is is_seen
    assert set(cause["measures"]) == ({"scan_share/lidar", "scan_difference/lidar"} if is_seen else set())
    # the robot itself behaves as before
    assert not any(m["significant"] for name, m in found.items() if not name.startswith("scan_"))
    words = ("before", "after", "lidar:=true", "--scenario", "drive.scenario.yaml", "-j", "1")
    for report in (run(*words).stdout, _markdown(*words)):
        assert "sensor lidar" in report
        assert "1.571 rad" in report
        assert f"after/urdf/kbot_lidar.xacro:{line}:" in report
        assert ("not measured: the scans of 'lidar'" in report) is not is_seen


def _markdown(*words: str) -> str:
    run(*words, "--markdown", "change.md")
    return Path("change.md").read_text()


def test_a_revision_is_compared_with_the_working_tree(folder: Path) -> None:
    repository = folder / "after"
    for words in (("init", "-q"), ("add", "."), ("commit", "-qm", "first")):
        subprocess.run(
            ["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], cwd=repository, check=True
        )
    line = edit(repository / "urdf" / "kbot.xacro", "${-0.375*base_len}", "${-0.2*base_len}")
    (folder / "drive.scenario.yaml").rename(repository / "drive.scenario.yaml")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(repository)
        (cause,) = compare("HEAD:urdf/kbot.xacro", "urdf/kbot.xacro")["causes"]
        assert (cause["file"], cause["line"]) == ("urdf/kbot.xacro", line)
        (cause,) = compare("HEAD:", ".")["causes"]
        assert (cause["file"], cause["line"]) == ("urdf/kbot.xacro", line)


def test_recordings_are_compared_by_what_they_show(folder: Path) -> None:
    for name, speed in (("slow", 0.1), ("fast", 0.2)):
        scenario = Scenario(name, 3.0, [Step(Command(speed))], robot=RobotSource("kbot"))
        assert not run_trial(scenario, record=f"{name}.mcap").error
    result = json.loads(run("slow.mcap", "fast.mcap", "--json").stdout)
    forward = next(m for m in result["measures"] if m["measure"] == "final_forward")
    # 3 s at each speed, without half the time of the acceleration at 1 m/s^2, and the last 0.1 s at most:
    # the first and the last odometry of 50 Hz need not be at the ends
    assert 0.1 * (3.0 - 0.05) - 0.1 * 0.1 < forward["before"] < 0.1 * 3.0
    assert 0.2 * (3.0 - 0.1) - 0.2 * 0.1 < forward["after"] < 0.2 * 3.0
    assert result["changed"]
    assert run("slow.mcap", "slow.mcap").return_value == 0


def test_recordings_of_a_turned_or_slower_lidar_differ(folder: Path) -> None:
    turned = folder / "after" / "urdf" / "kbot_lidar.xacro"
    edit(turned, '${lidar_height}" rpy="0 0 0"', '${lidar_height}" rpy="0 0 ${pi/2}"')
    shutil.copytree(folder / "before", folder / "slow")
    slow = folder / "slow" / "urdf" / "kbot_lidar.xacro"
    slow.write_text(slow.read_text().replace("<update_rate>20<", "<update_rate>10<"))
    for name in ("before", "after", "slow"):
        source = RobotSource(str(folder / name / "urdf" / "kbot.xacro"), {"lidar": "true"})
        scenario = Scenario(name, 2.0, [Step(Command(0.1))], robot=source, world="corridor")
        assert not run_trial(scenario, record=f"{name}.mcap").error
    result = json.loads(run("before.mcap", "after.mcap", "--json").stdout)
    # the lidar's link is turned on /tf_static, and the scans show it
    assert [(d["part"], d["setting"]) for d in result["declared"]] == [("frame lidar_link", "yaw")]
    assert {m["measure"] for m in result["measures"] if m["significant"]} == {
        "scan_difference/scan",
        "scan_share/scan",
    }
    result = json.loads(run("before.mcap", "slow.mcap", "--json").stdout)
    (rate,) = (m for m in result["measures"] if m["significant"])
    assert rate["measure"] == "rate/scan"
    assert (rate["before"], rate["after"]) == (pytest.approx(20.0, rel=0.1), pytest.approx(10.0, rel=0.1))


def test_markdown_is_written_for_a_pull_request(folder: Path) -> None:
    edit(folder / "after" / "urdf" / "kbot.xacro", "${-0.375*base_len}", "${-0.2*base_len}")
    words = ("before", "after", "--scenario", "drive.scenario.yaml", "--markdown", "change.md")
    result = run(*words)
    assert result.return_value == 1
    assert "cause 1" in result.stdout
    assert "```diff" in Path("change.md").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("before",), "expected two robots"),
        (("before", "afte"), "afte"),
        (("before", "nowhere:urdf/kbot.xacro"), "git"),
        (("before", "after", "nonsense:=1"), "nonsense"),
        (("before", "after", "--battery", "strait"), "straight"),
    ],
)
def test_unusable_input_is_one_error(
    words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(KbotError, match=message):
        run(*words)
    assert main.run(["compare", *words, "--json"]) == 2
    printed = capsys.readouterr()
    assert json.loads(printed.out) == NOTHING
    assert message in printed.err


def test_ctrl_c_prints_an_object(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kbot.cli.compare._compare", interrupted)
    assert main.run(["compare", "before", "after", "--json"]) == 130
    assert json.loads(capsys.readouterr().out) == NOTHING


def test_a_scenario_that_does_not_run_with_a_is_an_error() -> None:
    Path("bad.scenario.yaml").write_text(
        "duration: 0.5\nsteps: [push: {link: gone, force: [1, 0, 0], duration: 0.1}]\n"
    )
    edit(Path("after", "urdf", "kbot.xacro"), "${-0.375*base_len}", "${-0.2*base_len}")
    with pytest.raises(
        KbotError, match=r"before did not complete the scenario 'bad': bad\.scenario\.yaml:2:"
    ):
        run("before", "after", "--scenario", "bad.scenario.yaml")


def test_two_scenarios_with_one_name_are_an_error() -> None:
    with pytest.raises(KbotError, match="two scenarios are named 'drive'"):
        run("before", "after", "--scenario", "drive.scenario.yaml", "--scenario", "drive.scenario.yaml")


def test_robots_that_cannot_be_mixed_are_compared(folder: Path) -> None:
    """A cannot include the file that B has beside it."""
    (folder / "alone").mkdir()
    expanded = load_robot(str(folder / "after" / "urdf" / "kbot.xacro")).expansion.text
    (folder / "alone" / "robot.urdf").write_text(expanded.replace("0.035", "0.036"))
    result = compare("alone/robot.urdf", "after")
    assert result["changed"]
    assert {m["after"] for m in result["measures"] if m["measure"] == "completed"} <= {1.0}


def test_a_recording_whose_time_jumps_is_an_error() -> None:
    # two messages without frames, 30 years apart: stamp, two empty strings, and 85 numbers
    data = bytes([0, 1, 0, 0]) + bytes(8) + 2 * bytes([1, 0, 0, 0, 0, 0, 0, 0]) + bytes(85 * 8)
    with Path("jump.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("nav_msgs/msg/Odometry", "ros2msg", b"")
        channel = writer.register_channel("/odom", "cdr", schema)
        for time in (0, 10**18):
            writer.add_message(channel, time, data, time)
        writer.finish()
    with pytest.raises(KbotError, match=r"spans 1000000000 s, more than a day"):
        run("jump.mcap", "jump.mcap")


def test_the_scenarios_of_a_folder_and_of_a_python_file_run_in_other_processes(folder: Path) -> None:
    """A function of a scenario cannot be sent to another process, so each process reads the file again."""
    scenarios = folder / "scenarios"
    scenarios.mkdir()
    (folder / "drive.scenario.yaml").rename(scenarios / "drive.scenario.yaml")
    (scenarios / "own.scenario.py").write_text(
        "import os\n"
        "from kbot.trials import *\n"
        f"assert os.getpid() != {os.getpid()}, 'it is the process of the command'\n"
        "turn = Scenario('turn', 1.0, [Step(RunScript(lambda sim: sim.cmd_vel(0.0, 0.5)))])\n"
    )
    edit(folder / "after" / "urdf" / "kbot.xacro", "${base_width + 2*base_wheel_gap}", "${2*base_width}")
    result = run("before", "after", "--scenario", "scenarios", "-j", "1", "--json")
    measures = json.loads(result.stdout)["measures"]
    assert {each["scenario"] for each in measures} == {"drive", "turn"}
