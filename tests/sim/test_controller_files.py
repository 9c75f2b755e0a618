"""Errors in a robot's controller file are reported once, at their place in that file.

`kbot check` and the simulation report the same. The simulation continues with what it can use.
"""

from pathlib import Path

import pytest

from kbot.checks import check_file
from kbot.checks.config import Config
from kbot.model.load import load_robot
from kbot.model.spawned import SpawnedController, with_controllers
from kbot.sim import Simulation

GOOD = """controller_manager:
  ros__parameters:
    joint_state_broadcaster: {type: joint_state_broadcaster/JointStateBroadcaster}
    follow:
      type: joint_trajectory_controller/JointTrajectoryController
follow:
  ros__parameters:
    joints: [shoulder]
"""
ROBOT = (
    '<robot name="arm"><link name="world"/><link name="bar"><inertial><origin xyz="0.1 0 0"/>'
    '<mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="shoulder" type="revolute"><parent link="world"/><child link="bar"/><origin xyz="0 0 1"/>'
    '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="50" velocity="1"/></joint>'
    '<ros2_control name="c" type="system"><hardware>'
    "<plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>"
    '<joint name="shoulder"><command_interface name="position"/></joint></ros2_control>'
    '<gazebo><plugin filename="gz_ros2_control-system" name="g">\n'
    "<parameters>{}</parameters></plugin></gazebo></robot>"
)
SPAWNED = "joint_state_broadcaster", "follow"


@pytest.fixture
def described(tmp_path: Path):
    """The robot's file, with a text of controller parameters."""

    def write(yaml: str) -> Path:
        (tmp_path / "c.yaml").write_text(yaml)
        path = tmp_path / "arm.urdf"
        path.write_text(ROBOT.format(tmp_path / "c.yaml"))
        return path

    return write


def simulated(path: Path) -> Simulation:
    """The robot with both controllers spawned, as by a launch file."""
    robot = load_robot(path).require()
    return Simulation(
        with_controllers(robot, [SpawnedController(f"/{n}", {}, True, 2, robot.origin) for n in SPAWNED])
    )


@pytest.mark.parametrize(
    ("right", "wrong", "code", "place", "words"),
    [
        ("  ros__", "\tros__", "W132", (2, 1), "it is indented with a tab"),
        ("[shoulder]", "[shoulder", "W132", (9, 1), "is not valid YAML"),
        ("TrajectoryController", "TrajectoryControler", "W143", (5, 7), "'follow' is not loaded"),
        (
            "joint_state_broadcaster/J",
            "joint_state_broadcster/J",
            "W143",
            (3, 31),
            "its type 'joint_state_broadcster/JointStateBroadcaster' does not exist",
        ),
        (
            "joint_trajectory_controller/",
            "",
            "W143",
            (5, 7),
            "its type 'JointTrajectoryController' does not exist",
        ),
        (
            "  ros__parameters",
            "  ros_parameters",
            "W144",
            (2, 3),
            "the key 'ros_parameters' must be 'ros__parameters'",
        ),
        ("low:\n  ros__param", "low:\n  ros__parm", "W144", (7, 3), "rejects the whole file"),
    ],
)
def test_error_is_reported_once_at_its_place_in_the_file(described, right, wrong, code, place, words):
    assert right in GOOD
    path = described(GOOD.replace(right, wrong, 1))
    of_the_check = [d for d in check_file(str(path), config=Config()) if d.code[0] in "DW"]
    of_the_run = [d for d in simulated(path).diagnostics if d.code != "W114"]
    for found in (of_the_check, of_the_run):
        assert [(d.code, d.is_error) for d in found] == [(code, True)]
        span = found[0].origin.span
        assert (Path(span.file).name, span.line, span.column) == ("c.yaml", *place)
        assert words in found[0].message.replace("'/", "'")


def test_missing_controller_is_reported_where_it_is_named(described):
    path = described(GOOD)
    (path.parent / "c.yaml").unlink()
    for found in (check_file(str(path), config=Config()), simulated(path).diagnostics):
        (reported,) = [d for d in found if d.code == "W132"]
        assert (Path(reported.origin.span.file).name, reported.origin.span.line) == ("arm.urdf", 2)
        assert not reported.is_error


@pytest.mark.parametrize(
    "yaml",
    [
        GOOD,
        GOOD.replace("joint_trajectory_controller/JointTrajectoryController", "my_controllers/Follow"),
        GOOD.replace("follow:\n  ros__", "/**/follow:\n  ros__"),
        GOOD + "other:\n  some_parameters: {ros: 1}\n",
        "- a list\n",
        "",
    ],
)
def test_plausible_settings_are_not_reported(described, yaml):
    assert [d for d in check_file(str(described(yaml)), config=Config()) if d.code[0] in "DW"] == []


def test_misspelt_parameter_name_keeps_the_controllers_joints(described):
    sim = simulated(described(GOOD.replace("ros__", "ros_")))
    assert [c.joints for c in sim.robots.first.joints.control.controllers] == [("shoulder",)]
