"""What to type instead of a command of ROS, Gazebo or a shell, for users who type it after `kbot`."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Sequence

from kbot.cli.arguments import HOW_TO_RECORD

_RUN = "start your Python node with python FILE while KBot runs, or from a launch file"
_NO_BUILD = "it is not needed. KBot finds packages in the source folder and in --package-path"
_VIEW = "use kbot view FILE for a robot, or kbot launch PACKAGE FILE for a launch file"
_SIMULATE = "use kbot sim FILE, with --world W for a world or an SDF file"
_GRAPH = "use kbot node list and kbot topic list while KBot runs"
_PLOT = "plot topics in the page of kbot sim: open Plots"
_MASTER = "KBot needs no master. To connect ROS 1 nodes, use kbot sim FILE --ros1"
_TRY = "use kbot try FILE with a scenario file, which states what happens and what is expected"
_SLIDERS = "use kbot view FILE: the page has a slider for each joint"

OF_ROS_2 = {
    "record": HOW_TO_RECORD,
    "play": "use kbot bag play FILE",
    "run": _RUN,
    "action": "KBot's actions are topics, as in ROS 1. List them with kbot topic list",
    "interface": "use kbot topic type NAME or kbot service type NAME",
    "pkg": "use kbot new NAME to create a package",
}
"""Verbs of `ros2` that KBot does not have, and what to use instead."""

_ADVICE = {
    "rviz": _VIEW,
    "rviz2": _VIEW,
    "gazebo": _SIMULATE,
    "gzserver": _SIMULATE,
    "gz": _SIMULATE,
    "ign": _SIMULATE,
    "roslaunch": "use kbot launch PACKAGE FILE [arg:=value ...]",
    "ros2": "use the verb alone, for example kbot launch, kbot topic or kbot bag",
    "rosrun": _RUN,
    "xacro": "use kbot expand FILE [name:=value ...]",
    "check_urdf": "use kbot check FILE",
    "urdf_to_graphiz": "use kbot export FILE --to tree -o tree.svg",
    "urdf_to_graphviz": "use kbot export FILE --to tree -o tree.svg",
    "catkin_make": _NO_BUILD,
    "catkin": _NO_BUILD,
    "colcon": _NO_BUILD,
    "source": _NO_BUILD,
    "catkin_create_pkg": "use kbot new NAME",
    "rosdep": "KBot needs no ROS packages",
    "roscore": _MASTER,
    "rosmaster": _MASTER,
    "rostopic": "use kbot topic",
    "rosnode": "use kbot node",
    "rosservice": "use kbot service",
    "rosparam": "use kbot param",
    "rosbag": f"use kbot bag; {HOW_TO_RECORD}",
    "rosmsg": OF_ROS_2["interface"],
    "rossrv": OF_ROS_2["interface"],
    "rospack": "use kbot check PACKAGE; name the folder of the package with --package-path",
    "roscd": "name the folder of the package with --package-path",
    "rostest": _TRY,
    "launch_test": _TRY,
    "rqt": f"{_PLOT}; {_GRAPH}",
    "rqt_graph": _GRAPH,
    "rqt_plot": _PLOT,
    "tf_echo": "use kbot tf echo FRAME CHILD",
    "tf2_echo": "use kbot tf echo FRAME CHILD",
    "view_frames": "use kbot tf tree",
    "teleop_twist_keyboard": "hold W, A, S or D in the page of kbot sim",
    "joint_state_publisher_gui": _SLIDERS,
}

_SAME = {"rostopic": "topic", "rosnode": "node", "rosservice": "service", "rosparam": "param"}
"""Commands of ROS 1 whose subcommands are those of a KBot verb."""
_SUBCOMMANDS = {
    "topic": ("list", "echo", "hz", "info", "type", "pub"),
    "node": ("list", "info"),
    "service": ("list", "type", "call"),
    "param": ("list", "get", "set"),
    "bag": ("info", "play"),
}
"""Subcommands of KBot's verbs that take the same words as in ROS."""


def instead_of(words: Sequence[str], verbs: Collection[str]) -> str:
    """What to type instead of a command of another tool, or an empty string for an unknown one.

    The user's own words are translated if they mean the same to KBot; options never are. `verbs` are those
    that are installed.
    """
    command, *rest = words
    if command not in _ADVICE:
        return ""
    program = rest[2:] if [command, *rest[:1]] == ["ros2", "run"] else rest[1:] if command == "rosrun" else []
    if program and program[0] in _ADVICE:
        return instead_of(program, verbs)
    if rest[:1] == ["record"] or [command, *rest[:2]] == ["ros2", "bag", "record"]:
        return HOW_TO_RECORD
    translated = _translated(command, rest)
    if translated and translated[0] in verbs:
        return f"type kbot {shlex.join(translated)}"
    if command == "ros2" and rest and rest[0] in OF_ROS_2:
        return OF_ROS_2[rest[0]]
    if command == "ros2" and rest and rest[0] in verbs:
        return f"use kbot {rest[0]}"
    return _ADVICE[command]


def _translated(command: str, rest: Sequence[str]) -> list[str]:
    """The words after `kbot` that mean the same, or an empty list if that is not certain."""
    if command == "ros2" and rest:
        return _translated_verb(rest[0], rest[1:])
    if command == "roslaunch":
        return _translated_verb("launch", rest)
    if command in _SAME:
        return _translated_verb(_SAME[command], rest)
    if command == "rosbag":
        return _translated_verb("bag", rest)
    if command == "xacro" and _has_no_options([word for word in rest if word not in ("-o", "--inorder")]):
        return ["expand", *(word for word in rest if word != "--inorder")] if rest else []
    if command == "check_urdf" and len(rest) == 1 and _has_no_options(rest):
        return ["check", *rest]
    if command in ("tf_echo", "tf2_echo") and len(rest) == 2 and _has_no_options(rest):
        return ["tf", "echo", *rest]
    return []


def _translated_verb(verb: str, rest: Sequence[str]) -> list[str]:
    if not rest or not _has_no_options(rest):
        return []
    if verb == "launch" or rest[0] in _SUBCOMMANDS.get(verb, ()):
        return [verb, *rest]
    return []


def _has_no_options(words: Sequence[str]) -> bool:
    return not any(word.startswith("-") for word in words)
