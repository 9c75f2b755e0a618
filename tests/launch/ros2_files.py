"""Helpers that write and read ROS 2 launch files."""

from pathlib import Path

from kbot.ros.launch import Plan, read_launch_2
from kbot.xacro import Packages

ROBOT = '<robot name="r"><link name="base"/></robot>'
HEAD = """import os
from launch import LaunchDescription
from launch.actions import *
from launch.conditions import *
from launch.event_handlers import OnProcessExit
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import *
from launch_ros.actions import Node, PushRosNamespace, SetParameter
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import *
"""


def read(file: Path, text: str, **arguments: str) -> Plan:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return read_launch_2(str(file), arguments, Packages(around=str(file)), trusted=True)


def python(folder: Path, *actions: str, before: str = "", **arguments: str) -> Plan:
    body = ",\n        ".join(actions)
    generate = f"def generate_launch_description():\n    return LaunchDescription([\n        {body}])\n"
    return read(folder / "a.launch.py", f"{HEAD}{before}\n{generate}", **arguments)


def clean(plan: Plan) -> Plan:
    assert [str(d) for d in plan.diagnostics] == []
    return plan


def arguments_of(plan: Plan, name: str = "probe") -> str:
    """The arguments of a node."""
    return next(node.args for node in clean(plan).nodes if node.name == name)


def node(*arguments: str) -> str:
    return f"Node(package='p', executable='e', name='probe', arguments=[{', '.join(arguments)}])"
