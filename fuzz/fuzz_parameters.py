"""Fuzzes YAML files of parameters: those of launch files, nodes, controllers and ros_gz_bridge.

Errors are diagnostics with a code, a message and a place, or a KbotError where a node is started.
"""

from contextlib import suppress
from pathlib import Path

from choices import Choices
from diagnostics import check_diagnostics
from edits import edited, real_files

from kbot.checks import check_text
from kbot.checks.config import Config
from kbot.ros.client.arguments import read_arguments
from kbot.ros.launch.ros1.reader import read_launch
from kbot.ros.launch.ros2.reader import read_launch_2
from kbot.ros.launch.staging import stage
from kbot.text import KbotError, Source
from kbot.xacro import expand_text

FILE = Path("p.yaml")
SEEDS = real_files(".yaml", ".yml", is_wanted=lambda data: b"uses:" not in data)
WORDS = [
    b"&a ", b"*a", b"<<: *a", b"? ", b"- ", b"!!int ", b"!!float ", b"!!binary ", b"!!set ", b"!degrees ",
    b"rad(pi/2)", b"/**:\n", b"ros__parameters:\n", b"  type: diff_drive_controller/DiffDriveController\n",
    b"{", b"}", b"[", b"]", b"controller_manager:\n", b"- {ros_topic_name: /a, gz_topic_name: /b}\n",
    b"direction: BIDIRECTIONAL\n", b"---\n",
]  # fmt: skip
ROS_1 = f"""<launch><rosparam file="{FILE}"/><rosparam file="{FILE}" ns="a" subst_value="true"/>
<node pkg="controller_manager" type="spawner" name="s" args="diff_drive_controller joint_state_controller"/></launch>"""
ROS_2 = f"""<launch>
<node pkg="p" exec="e" name="controller_manager"><param from="{FILE}"/></node>
<node pkg="ros_gz_bridge" exec="parameter_bridge" name="b"><param name="config_file" value="{FILE}"/></node>
<node pkg="controller_manager" exec="spawner" args="diff_drive_controller -p {FILE}"/></launch>"""
ROBOT = f"""<robot name="r"><link name="a"/><gazebo><plugin name="p" filename="libgz_ros2_control-system.so">
<parameters>{FILE}</parameters></plugin></gazebo></robot>"""
XACRO = f"""<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="y" value="${{xacro.load_yaml('{FILE}')}}"/><a b="${{y}}"/></robot>"""


def one_input(choices: Choices) -> None:
    """A file, and one of its readers."""
    FILE.write_bytes(edited(choices, SEEDS, WORDS))
    match choices.integer(0, 4):
        case 0:
            plan = read_launch("a.launch", source=Source("a.launch", ROS_1))
            check_diagnostics((*plan.diagnostics, *stage(plan).notes))
        case 1:
            plan = read_launch_2("a.launch.xml", source=Source("a.launch.xml", ROS_2))
            check_diagnostics((*plan.diagnostics, *stage(plan).notes))
        case 2:
            check_diagnostics(check_text(ROBOT, "a.urdf", config=Config()))
        case 3:
            check_diagnostics(expand_text(XACRO, "a.xacro").diagnostics)
        case _:
            with suppress(KbotError):
                read_arguments("n", ["--ros-args", "--params-file", str(FILE)], {})


TARGETS = {"parameters": one_input}
