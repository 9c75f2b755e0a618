"""The controllers that a launch spawns: their state, their parameters, and where these were written."""

from pathlib import Path

import pytest

from kbot.model.spawned import SpawnedController
from kbot.ros.launch import read_launch, read_launch_2
from kbot.ros.launch.known_packages import Role, role
from kbot.ros.launch.node_settings.spawner import read_controllers
from kbot.text import Diagnostic
from kbot.xacro import Packages

YAML_1 = """arm:
  states: {type: joint_state_controller/JointStateController, publish_rate: 50}
  shoulder:
    type: effort_controllers/JointPositionController
    joint: shoulder
    pid: {p: 100.0, d: 10.0}
"""

YAML_2 = """controller_manager:
  ros__parameters:
    update_rate: 100
    shoulder:
      type: forward_command_controller/ForwardCommandController
/**/shoulder:
  ros__parameters:
    joints: [shoulder]
    interface_name: position
"""


def spawned(folder: Path, name: str, text: str) -> tuple[dict[str, SpawnedController], list[Diagnostic]]:
    file = folder / name
    file.write_text(text)
    packages = Packages(around=str(file))
    read = read_launch_2 if name.endswith(".launch.xml") else read_launch
    plan = read(str(file), packages=packages).require()
    spawners = [n for n in plan.nodes if role(n.package, n.type, n.args) is Role.CONTROLLER]
    found, notes = read_controllers(plan, spawners)
    return {c.name: c for c in found}, notes


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "one.yaml").write_text(YAML_1)
    (tmp_path / "two.yaml").write_text(YAML_2)
    return tmp_path


NS = 'ns="arm"'
LOAD = '<rosparam command="load" file="$(dirname)/one.yaml"/>'


def spawner(args: str, more: str = "") -> str:
    return f'<node pkg="controller_manager" type="spawner" name="s" args="{args}" {more}/>'


def test_ros1_spawner_starts_controllers_in_its_namespace(folder):
    found, notes = spawned(folder, "a.launch", f"<launch>{LOAD}{spawner('states shoulder', NS)}</launch>")
    assert list(found) == ["/arm/states", "/arm/shoulder"]
    assert notes == []
    shoulder = found["/arm/shoulder"]
    assert (shoulder.is_active, shoulder.ros) == (True, 1)
    assert {name: s.value for name, s in shoulder.settings.items()} == {
        "type": "effort_controllers/JointPositionController",
        "joint": "shoulder",
        "pid.p": 100.0,
        "pid.d": 10.0,
    }


def test_parameter_origin_is_its_yaml_line_and_the_launch_line_that_loads_it(folder):
    found, _ = spawned(folder, "a.launch", f"<launch>\n{LOAD}\n{spawner('/arm/shoulder')}</launch>")
    settings = found["/arm/shoulder"].settings
    lines = {name: (Path(s.origin.span.file).name, s.origin.span.line) for name, s in settings.items()}
    assert lines == {name: ("one.yaml", line) for name, line in
                     (("type", 4), ("joint", 5), ("pid.p", 6), ("pid.d", 6))}  # fmt: skip
    assert settings["pid.d"].origin.span.text == "d"
    (loaded,) = settings["joint"].origin.stack
    assert (Path(loaded.span.file).name, loaded.span.line) == ("a.launch", 2)


def test_controller_origin_is_its_word_in_the_arguments(folder):
    found, _ = spawned(folder, "a.launch", f"<launch>{LOAD}{spawner('shoulder states', NS)}</launch>")
    assert [c.origin.span.text for c in found.values()] == ["shoulder", "states"]


@pytest.mark.parametrize(("word", "namespace"), [("sholder", NS), ("shoulder", "")])
def test_controller_without_parameters_is_reported_at_its_word_with_a_hint(folder, word, namespace):
    launch = f"<launch>\n{LOAD}\n{spawner(f'/arm/states {word}', namespace)}</launch>"
    found, (note,) = spawned(folder, "a.launch", launch)
    assert list(found) == ["/arm/states"]
    assert (note.code, note.origin.span.line, note.origin.span.text) == ("L064", 3, word)
    assert "/arm/shoulder" in note.hint


@pytest.mark.parametrize(
    ("node", "active"),
    [
        (spawner("--stopped shoulder"), False),
        (spawner("--wait-for /up --timeout 5 shoulder"), True),
        (spawner("--namespace /arm shoulder __name:=x"), True),
        ('<node pkg="controller_manager" type="controller_manager" name="s" args="spawn shoulder"/>', True),
        ('<node pkg="controller_manager" type="controller_manager" name="s" args="load shoulder"/>', False),
    ],
)
def test_stopped_and_loaded_controllers_are_inactive(folder, node, active):
    own = "<param name='shoulder/type' value='t'/>"
    found, _ = spawned(folder, "a.launch", f"<launch>{LOAD}{own}{node}</launch>")
    assert [c.is_active for c in found.values()] == [active]
    assert next(iter(found)).rpartition("/")[2] == "shoulder"


def node_2(package: str, executable: str, inner: str = "", args: str = "") -> str:
    return f'<node pkg="{package}" exec="{executable}" args="{args}">{inner}</node>'


def test_ros2_spawner_uses_the_parameter_file_of_the_manager(folder):
    manager = node_2("controller_manager", "ros2_control_node", '<param from="$(dirname)/two.yaml"/>')
    launch = (
        f"<launch>{manager}{node_2('controller_manager', 'spawner', args='shoulder --inactive')}</launch>"
    )
    found, notes = spawned(folder, "a.launch.xml", launch)
    (shoulder,) = found.values()
    assert (shoulder.name, shoulder.is_active, shoulder.ros, notes) == ("/shoulder", False, 2, [])
    assert {name: (s.value, s.origin.span.line) for name, s in shoulder.settings.items()} == {
        "type": ("forward_command_controller/ForwardCommandController", 5),
        "joints": (["shoulder"], 8),
        "interface_name": ("position", 9),
    }


def test_ros2_spawner_can_set_parameter_file_and_type(folder):
    args = f"shoulder -c /left/controller_manager -t some/Type -p {folder}/two.yaml"
    found, _ = spawned(
        folder, "a.launch.xml", f"<launch>{node_2('controller_manager', 'spawner', args=args)}</launch>"
    )
    (shoulder,) = found.values()
    assert (shoulder.name, shoulder.is_active) == ("/left/shoulder", True)
    assert {n: s.value for n, s in shoulder.settings.items()} == {
        "type": "some/Type", "joints": ["shoulder"], "interface_name": "position",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("command", "active"),
    [
        ("load_controller --set-state active shoulder", True),
        ("load_controller --set-state inactive shoulder", False),
        ("load_controller shoulder", False),
        ("set_controller_state shoulder active", True),
    ],
)
def test_ros2_control_process_spawns_a_controller(folder, command, active):
    found, notes = spawned(
        folder, "a.launch.xml", f'<launch><executable cmd="ros2 control {command}"/></launch>'
    )
    assert {name: c.is_active for name, c in found.items()} == {"/shoulder": active}
    assert notes == []


def test_ros2_spawner_passes_its_own_parameter_file_on(folder):
    (folder / "own.yaml").write_text(YAML_2.replace("[shoulder]", "[$(var prefix)shoulder]"))
    node = (
        '<node pkg="controller_manager" exec="spawner" args="shoulder">'
        '<param from="$(dirname)/own.yaml" allow_substs="true"/></node>'
    )
    launch = f'<launch><arg name="prefix" default="left_"/>{node}</launch>'
    found, notes = spawned(folder, "a.launch.xml", launch)
    assert found["/shoulder"].settings["joints"].value == ["left_shoulder"]
    assert notes == []


def test_invalid_yaml_is_reported_at_its_place_in_the_file(folder):
    (folder / "bad.yaml").write_text("a: [1,")
    args = f"shoulder -p {folder}/bad.yaml"
    _, notes = spawned(
        folder, "a.launch.xml", f"<launch>\n{node_2('controller_manager', 'spawner', args=args)}</launch>"
    )
    (note,) = notes
    assert (note.code, Path(note.origin.span.file).name, note.origin.span.line) == ("L059", "bad.yaml", 1)
    assert note.origin.call.span.line == 2
