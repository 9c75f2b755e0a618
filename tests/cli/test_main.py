"""Tests the command line as a whole: verbs, help, errors and exit statuses."""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click
import pytest

from kbot.cli.main import VERBS, group, run
from kbot.cli.other_tools import _ADVICE, _SUBCOMMANDS, OF_ROS_2
from kbot.xacro.packages import SHIPPED

KBOT = str(Path(SHIPPED) / "kbot_description" / "urdf" / "kbot.xacro")


def kbot(*words: str, **more: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "kbot", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, **more)


def test_the_version_is_the_package_s(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"kbot {version('kbot')}\n"


@pytest.mark.parametrize("word", ["-h", "--help"])
def test_help_names_every_verb(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([word]) == 0
    out = capsys.readouterr().out
    assert all(f"\n  {verb} " in out for verb in VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help_with_an_example(verb: str, run_kbot: Callable[..., Any]) -> None:
    done = run_kbot(verb, "-h")
    assert (done.status, done.err) == (0, "")
    assert f"kbot {verb} " in done.out.split("Examples:")[1]


def _commands(
    command: click.Command, context: click.Context
) -> Iterator[tuple[click.Command, click.Context]]:
    yield command, context
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            assert inner is not None
            yield from _commands(inner, click.Context(inner, context, name, terminal_width=80))


def test_every_help_page_fits_80_columns_and_explains_every_option() -> None:
    pages = list(_commands(group, click.Context(group, info_name="kbot", terminal_width=80)))
    assert len(pages) > len(VERBS)
    for command, context in pages:
        assert [line for line in command.get_help(context).splitlines() if len(line) > 80] == []
        options = [p for p in command.get_params(context) if isinstance(p, click.Option) and not p.hidden]
        assert [option.name for option in options if not option.help] == []


def test_help_loads_no_verb_and_no_heavy_library() -> None:
    code = (
        "import sys; from kbot.cli.main import run; run(['-h']);"
        "heavy = {'numpy', 'mujoco', 'yaml', 'trimesh', 'websockets', 'rich', 'kbot.cli.sim.command'};"
        "sys.exit(repr(heavy & set(sys.modules)) if heavy & set(sys.modules) else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)


def test_verbs_without_a_simulation_do_not_load_the_engine() -> None:
    code = (
        "import sys, kbot.ros.client, kbot.cli.bag.play, kbot.ros.launch.running.robot_run;"
        "import kbot.cli.ros.graph, kbot.cli.ros.launch.command, kbot.cli.view;"
        "from kbot.ros.peer_options import PeerOptions;"
        "from kbot.workbench.serve import open_session;"
        "session = open_session('kbot', simulate=False); session.advance(0.02);"
        "PeerOptions().open(print).close();"
        "sys.exit('mujoco' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(("written", "meant"), [("chek", "check"), ("siml", "sim"), ("viewx", "view")])
def test_an_unknown_verb_suggests_the_nearest(
    written: str, meant: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([written]) == 2
    assert f"unknown verb '{written}': did you mean '{meant}'?" in capsys.readouterr().err


def test_an_unknown_verb_without_a_similar_name_refers_to_the_list(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["xyz"]) == 2
    assert "unknown verb 'xyz'. `kbot --help` lists the verbs.\n" in capsys.readouterr().err


@pytest.mark.parametrize("verb", OF_ROS_2)
def test_a_missing_verb_of_ros_2_names_the_replacement(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([verb, "list"]) == 2
    assert f"unknown verb '{verb}': {OF_ROS_2[verb]}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("typed", "answer"),
    [
        ("roslaunch my_pkg x.launch gui:=false", "type kbot launch my_pkg x.launch gui:=false"),
        ("roslaunch --screen my_pkg x.launch", "use kbot launch PACKAGE FILE [arg:=value ...]"),
        ("roslaunch", "use kbot launch PACKAGE FILE [arg:=value ...]"),
        ("ros2 launch my_pkg x.launch.py", "type kbot launch my_pkg x.launch.py"),
        ("ros2 topic echo /odom", "type kbot topic echo /odom"),
        ("ros2 topic echo /odom --qos-depth 1", "use kbot topic"),
        ("ros2 run tf2_ros tf2_echo odom base_link", "type kbot tf echo odom base_link"),
        ("ros2 run my_pkg my_node", "start your Python node with python FILE while KBot runs"),
        ("ros2 bag record -a", "to record a run, use kbot sim ROBOT --record FILE"),
        ("rosbag record -a", "to record a run, use kbot sim ROBOT --record FILE"),
        ("rosbag play run.bag", "type kbot bag play run.bag"),
        ("rostopic hz /scan", "type kbot topic hz /scan"),
        ("rosrun xacro xacro r.xacro -o r.urdf", "type kbot expand r.xacro -o r.urdf"),
        ("rosrun rviz rviz -d my.rviz", "use kbot view FILE for a robot"),
        ("xacro r.xacro size:='a b'", "type kbot expand r.xacro 'size:=a b'"),
        ("xacro --check-order r.xacro", "use kbot expand FILE [name:=value ...]"),
        ("check_urdf robot.urdf", "type kbot check robot.urdf"),
        ("catkin_make", "it is not needed. KBot finds packages"),
        ("source devel/setup.bash", "it is not needed. KBot finds packages in the source folder"),
        ("gazebo my.world", "use kbot sim FILE, with --world W"),
        ("rqt_graph", "use kbot node list and kbot topic list"),
        ("rviz", "use kbot view FILE for a robot"),
        ("roscore", "KBot needs no master"),
    ],
)
def test_a_command_of_another_tool_names_the_command_of_kbot(
    typed: str, answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = shlex.split(typed)
    assert run(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"error: '{words[0]}' is not a verb of KBot: {answer}")
    assert err.count("\n") == 1


def test_every_command_that_is_suggested_for_another_tool_exists() -> None:
    texts = [*OF_ROS_2.values(), *_ADVICE.values()]
    named = {match for text in texts for match in re.findall(r"kbot ([a-z]+)", text)}
    assert named <= {*VERBS}
    assert {*_SUBCOMMANDS} <= {*VERBS}


def test_a_file_instead_of_a_verb_explains_how_to_view_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "robot.xacro"
    robot.write_text("<robot/>")
    assert run([str(robot)]) == 2
    assert f"kbot view {robot}" in capsys.readouterr().err


def test_without_a_verb_kbot_is_simulated() -> None:
    with group.make_context("kbot", ["--port", "8300"]) as context:
        assert [*context._protected_args, *context.args] == ["sim", "kbot", "--port", "8300"]


def test_an_unknown_option_is_exit_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["expand", "--hepl"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert "Try 'kbot expand --help'." in error


@pytest.mark.skipif(os.name == "nt", reason="pipes and /dev/full are POSIX")
@pytest.mark.parametrize("robot", ["kbot", KBOT])
def test_a_closed_pipe_ends_silently(robot: str) -> None:
    command = f"'{sys.executable}' -m kbot expand '{robot}' | head -c 1"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("<", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize("robot", ["kbot", KBOT])
def test_a_full_disk_is_one_message(robot: str) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "kbot", "expand", robot],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr.splitlines() == ["error: No space left on device"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize("words", ["expand nope.xacro", "sim kbot --nope", "bag info nope"])
def test_an_error_is_exit_status_2_even_if_stderr_is_full(words: str, tmp_path: Path) -> None:
    environment = os.environ | {"XDG_STATE_HOME": str(tmp_path)}
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "kbot", *words.split()]
        done = subprocess.run(command, stderr=full, check=False, env=environment)
    assert done.returncode == 2
    assert not list(tmp_path.iterdir()), "bad input needs no crash file"


def test_python_m_kbot_is_the_command() -> None:
    assert kbot("--version").stdout == f"kbot {version('kbot')}\n"
