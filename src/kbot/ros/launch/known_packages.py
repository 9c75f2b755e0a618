"""The ROS packages that KBot knows: the replacements of their nodes, options, and old names of nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from kbot.xacro.ros_variables import STAND_IN_PREFIX

_SHARE = f"{STAND_IN_PREFIX}/share"
"""The folder that `$(find …)` gives for packages that are not installed. It does not exist."""


class Role(StrEnum):
    """What replaces a node. `kbot launch` prints the text in its table of nodes."""

    ROBOT_STATE = "the workbench's transforms"
    JOINT_STATE = "the workbench's joint states"
    VIEWER = "the workbench"
    SIMULATOR = "KBot's simulation"
    SPAWNER = "the robot in KBot's simulation"
    CONTROLLER = "the controllers of KBot's simulation"
    TELEOP = "the drive keys of the workbench and of this terminal"
    GAMEPAD = "the gamepad of the page"
    TRANSFORM = "KBot's static transform"
    MAP = "KBot's map"
    RECORDER = "KBot's recorder"
    BRIDGE = "the topics of KBot's simulation"
    PLAYER = "KBot's recording player"
    RELAY = "KBot's relay"
    MUX = "KBot's twist_mux"


NODES: Mapping[str, Mapping[str, Role | None]] = {
    "robot_state_publisher": {"robot_state_publisher": Role.ROBOT_STATE},
    "joint_state_publisher": {"joint_state_publisher": Role.JOINT_STATE},
    "joint_state_publisher_gui": {"joint_state_publisher_gui": Role.JOINT_STATE},
    "rviz": {"rviz": Role.VIEWER},
    "gazebo_ros": {
        "gazebo": Role.SIMULATOR,
        "gzserver": Role.SIMULATOR,
        "gzclient": Role.VIEWER,
        "debug": Role.SIMULATOR,
        "spawn_model": Role.SPAWNER,
        "spawn_entity.py": Role.SPAWNER,
    },
    "controller_manager": {
        "spawner": Role.CONTROLLER,
        "spawner.py": Role.CONTROLLER,
        "unspawner": Role.CONTROLLER,
        "controller_manager": Role.CONTROLLER,
        "ros2_control_node": Role.CONTROLLER,
    },
    "tf": {"static_transform_publisher": Role.TRANSFORM},
    "tf2_ros": {"static_transform_publisher": Role.TRANSFORM},
    "map_server": {"map_server": Role.MAP, "map_saver": None},
    "nav2_map_server": {"map_server": Role.MAP, "map_saver_cli": None, "map_saver_server": None},
    "rosbag": {"play": Role.PLAYER, "record": Role.RECORDER},
    "rviz2": {"rviz2": Role.VIEWER},
    "ros_gz_sim": {"create": Role.SPAWNER, "gzserver": Role.SIMULATOR},
    "ros_ign_gazebo": {"create": Role.SPAWNER},
    "ros_ign_bridge": {"parameter_bridge": Role.BRIDGE},
    "ros_gz_bridge": {"parameter_bridge": Role.BRIDGE, "bridge_node": Role.BRIDGE},
    "ros_gz_image": {"image_bridge": Role.BRIDGE},
    "teleop_twist_keyboard": {
        "teleop_twist_keyboard.py": Role.TELEOP,
        "teleop_twist_keyboard": Role.TELEOP,
    },
    "joy": {"joy_node": Role.GAMEPAD, "game_controller_node": None, "joy_enumerate_devices": None},
    "joy_linux": {"joy_linux_node": Role.GAMEPAD},
    "teleop_twist_joy": {"teleop_node": Role.GAMEPAD},
    "topic_tools": {
        "relay": Role.RELAY,
        **dict.fromkeys(("mux", "demux", "throttle", "drop", "delay", "relay_field", "transform")),
    },
    "twist_mux": {"twist_mux": Role.MUX, "twist_marker": None, "joystick_relay.py": None},
}
"""The nodes of the packages that KBot knows, and the replacement of each, None if KBot does not have one."""

STAND_IN_PACKAGES = frozenset({*NODES, "xacro"})
"""Packages that `$(find …)` finds although they are not installed."""


@dataclass(frozen=True, slots=True)
class Renamed:
    """A node that ROS renamed, and the release that did it."""

    new_package: str
    new_type: str
    since: str
    missing: str
    """What a ROS user sees when roslaunch continues without the node."""


RENAMED: Mapping[tuple[str, str], Renamed] = {
    ("robot_state_publisher", "state_publisher"): Renamed(
        "robot_state_publisher",
        "robot_state_publisher",
        "robot_state_publisher 1.15 (Noetic)",
        "no transforms are published, and rviz draws all links at the origin",
    ),
    ("rviz", "rviz.sh"): Renamed("rviz", "rviz", "rviz 1.12", "no window opens"),
    ("gazebo", "spawn_model"): Renamed(
        "gazebo_ros", "spawn_model", "gazebo_ros 2.0 (Hydro)", "the robot is not added to the world"
    ),
    ("gazebo", "gazebo"): Renamed("gazebo_ros", "gazebo", "gazebo_ros 2.0 (Hydro)", "nothing is simulated"),
    ("joint_state_publisher", "joint_state_publisher_gui"): Renamed(
        "joint_state_publisher_gui",
        "joint_state_publisher_gui",
        "joint_state_publisher 1.15 (Noetic)",
        "no sliders appear, and movable joints have no transforms",
    ),
}

SPAWN_MODEL_VALUES: Mapping[str, int] = {
    "-urdf": 0,
    "-sdf": 0,
    "-stdin": 0,
    "-b": 0,
    "-unpause": 0,
    "-wait": 1,
    "-file": 1,
    "-param": 1,
    "-database": 1,
    "-model": 1,
    "-robot_namespace": 1,
    "-gazebo_namespace": 1,
    "-reference_frame": 1,
    "-x": 1,
    "-y": 1,
    "-z": 1,
    "-R": 1,
    "-P": 1,
    "-Y": 1,
    "-J": 2,
    "-package_to_model": 0,
}
"""Options of gazebo_ros' spawn_model, and the number of words after each."""

GAZEBO_ARGUMENTS: Mapping[str, str] = {
    "paused": "false",
    "use_sim_time": "true",
    "extra_gazebo_args": "",
    "gui": "true",
    "recording": "false",
    "headless": "false",
    "debug": "false",
    "physics": "ode",
    "verbose": "false",
    "output": "screen",
    "world_name": "worlds/empty.world",
    "respawn_gazebo": "false",
    "use_clock_frequency": "false",
    "pub_clock_frequency": "100",
    "enable_ros_network": "true",
    "server_required": "false",
    "gui_required": "false",
}
"""Arguments of gazebo_ros' empty_world.launch, with their defaults."""

_OTHER_WORLD_ARGUMENTS = {
    name: GAZEBO_ARGUMENTS[name] for name in ("paused", "use_sim_time", "gui", "headless", "debug")
}

LAUNCH_FILES: Mapping[tuple[str, str], Mapping[str, str]] = {
    ("gazebo_ros", "empty_world.launch"): GAZEBO_ARGUMENTS,
    **{
        ("gazebo_ros", f"{world}.launch"): _OTHER_WORLD_ARGUMENTS | {"verbose": "false"}
        for world in (
            "elevator_world",
            "mud_world",
            "range_world",
            "rubble_world",
            "shapes_world",
            "willowgarage_world",
        )
    },
}
"""ROS 1 launch files that KBot replaces, by package and name, with their arguments and defaults."""

LAUNCH_FILES_2 = frozenset(
    {
        ("ros_gz_sim", "gz_sim.launch.py"),
        ("ros_gz_sim", "gz_server.launch.py"),
        ("ros_gz_sim", "ros_gz_sim.launch.py"),
        ("ros_gz_bridge", "ros_gz_bridge.launch.py"),
        ("ros_ign_gazebo", "ign_gazebo.launch.py"),
        ("gazebo_ros", "gazebo.launch.py"),
        ("gazebo_ros", "gzserver.launch.py"),
        ("gazebo_ros", "gzclient.launch.py"),
    }
)
"""ROS 2 launch files that KBot replaces. Their arguments are not checked."""

_NOT_RUN: Mapping[str, frozenset[str] | None] = {
    "nav2_bringup": frozenset(
        {
            "bringup_launch.py",
            "localization_launch.py",
            "navigation_launch.py",
            "slam_launch.py",
            "keepout_zone_launch.py",
            "speed_zone_launch.py",
        }
    ),
    "slam_toolbox": None,
    "robot_localization": None,
}
"""Launch files whose nodes KBot does not run, by package; None means all of the package. The other files of
nav2_bringup start a simulator, a robot or rviz."""


_PROGRAMS: Mapping[str, Role] = {
    "gazebo": Role.SIMULATOR,
    "gzserver": Role.SIMULATOR,
    "gzclient": Role.VIEWER,
    "rviz2": Role.VIEWER,
    "rviz": Role.VIEWER,
}
_GZ: Mapping[tuple[str, str], Role] = {
    ("gz", "sim"): Role.SIMULATOR,
    ("ign", "gazebo"): Role.SIMULATOR,
}
"""What replaces a process that is not a node, by its program and first word."""

_COMMANDS_2: Mapping[tuple[str, ...], Role] = {
    ("bag", "record"): Role.RECORDER,
    ("bag", "play"): Role.PLAYER,
    **{
        ("control", verb): Role.CONTROLLER
        for verb in ("load_controller", "load_start_controller", "set_controller_state")
    },
}
"""What replaces the process `ros2 VERB …`, by its first two words."""


def role(package: str, type_: str, args: str = "") -> Role | None:
    """What replaces a node, also under an old name. None if KBot does not replace it.

    A process does not have a package: its program and `args` identify it.
    """
    if not package:
        words = args.split()
        if type_ == "ros2":
            return _COMMANDS_2.get(tuple(words[:2]))
        return _PROGRAMS.get(type_) or _GZ.get((type_, words[0] if words else ""))
    renamed = RENAMED.get((package, type_))
    if renamed:
        package, type_ = renamed.new_package, renamed.new_type
    return NODES.get(package, {}).get(type_)


def is_not_run(package: str, launch_file: str) -> bool:
    """Whether a launch file of a package starts only nodes that KBot does not run."""
    names = _NOT_RUN.get(package, frozenset())
    return names is None or launch_file in names


def share_of(package: str) -> str:
    """The path that `$(find …)` gives for a package that KBot replaces and that is not installed."""
    return f"{_SHARE}/{package}"


def stand_in_file(path: str) -> tuple[str, str] | None:
    """The package, and the path in it, of a file under a path of `share_of`. None for any other file."""
    path = path.replace("\\", "/")  # of Path on Windows
    if not path.startswith(_SHARE + "/"):
        return None
    package, _, inner = path[len(_SHARE) + 1 :].partition("/")
    return package, inner
