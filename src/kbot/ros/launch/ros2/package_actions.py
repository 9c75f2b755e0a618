"""Launch actions and helper functions of controller_manager and ros_gz."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from kbot.ros.launch.known_packages import share_of
from kbot.ros.launch.ros2 import actions as act
from kbot.ros.launch.ros2.conditions import Condition
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.substitutions import LaunchConfiguration, performed

_SPAWN_OPTIONS = {
    "world": "-world",
    "file": "-file",
    "model_string": "-string",
    "topic": "-topic",
    "entity_name": "-name",
    "x": "-x",
    "y": "-y",
    "z": "-z",
    "roll": "-R",
    "pitch": "-P",
    "yaw": "-Y",
}


def gz_server(*, condition: Condition | None = None, **given: object) -> act.IncludeLaunchDescription:
    """The action GzServer and the tag `<gz_server>`, which start Gazebo's server."""
    return _included("ros_gz_sim", "gz_server.launch.py", given, condition)


def ros_gz_bridge(*, condition: Condition | None = None, **given: object) -> act.IncludeLaunchDescription:
    """The action RosGzBridge and the tag `<ros_gz_bridge>`, which start the bridge."""
    return _included("ros_gz_bridge", "ros_gz_bridge.launch.py", given, condition)


def gz_spawn_model(*, condition: Condition | None = None, **given: object) -> act.OpaqueFunction:
    """The action GzSpawnModel and the tag `<gz_spawn_model>`, which run `create` with all options that are
    not empty."""

    def spawn(context: LaunchContext) -> list[act.Action]:
        texts = {name: performed(value, context) for name, value in given.items() if name in _SPAWN_OPTIONS}
        words = [word for name, text in texts.items() if text for word in (_SPAWN_OPTIONS[name], text)]
        return [act.Node(package="ros_gz_sim", executable="create", arguments=words)]

    return act.OpaqueFunction(function=spawn, condition=condition)


def _included(
    package: str, name: str, given: Mapping[str, object], condition: Condition | None
) -> act.IncludeLaunchDescription:
    path = f"{share_of(package)}/launch/{name}"
    return act.IncludeLaunchDescription(path, launch_arguments=given, condition=condition)


LAUNCH_FILES: Mapping[tuple[str, str], tuple[Callable[..., act.Action], ...]] = {
    ("ros_gz_sim", "gz_spawn_model.launch.py"): (gz_spawn_model,),
    ("ros_gz_sim", "ros_gz_spawn_model.launch.py"): (ros_gz_bridge, gz_spawn_model),
}
"""Launch files that KBot replaces by actions. The actions take the arguments of the file."""


def controllers_spawner(
    controller_names: Iterable[object],
    controller_params_files: Iterable[object] | None = None,
    extra_spawner_args: Iterable[object] = (),
) -> act.LaunchDescription:
    """`generate_controllers_spawner_launch_description` of controller_manager."""
    files = [word for file in controller_params_files or () for word in ("--param-file", file)]
    return _spawner([*controller_names, *files, *extra_spawner_args])


def controllers_spawner_from_dict(
    controller_info_dict: Mapping[str, object], extra_spawner_args: Iterable[object] = ()
) -> act.LaunchDescription:
    """`generate_controllers_spawner_launch_description_from_dict`: controllers with their parameter files."""
    files: list[object] = []
    for given in controller_info_dict.values():
        for file in given if isinstance(given, list) else [given]:
            if file is not None and file not in files:
                files.append(file)
    return controllers_spawner(controller_info_dict, files, extra_spawner_args)


def load_controller(
    controller_name: object,
    controller_params_file: object = None,
    extra_spawner_args: Iterable[object] = (),
    *,
    controller_type: object = None,
) -> act.LaunchDescription:
    """`generate_load_controller_launch_description` of controller_manager. Old releases have
    `controller_type`."""
    files = controller_params_file if isinstance(controller_params_file, list) else [controller_params_file]
    more = [*extra_spawner_args, *(("-t", controller_type) if controller_type is not None else ())]
    return controllers_spawner([controller_name], [f for f in files if f is not None], more)


def _spawner(words: list[object]) -> act.LaunchDescription:
    name = "controller_manager_name"
    declared = act.DeclareLaunchArgument(name, default_value="controller_manager")
    arguments = [*words, "--controller-manager", LaunchConfiguration(name)]
    node = act.Node(package="controller_manager", executable="spawner", arguments=arguments)
    return act.LaunchDescription([declared, node])


CONTROLLER_HELPERS: Mapping[str, Callable[..., act.LaunchDescription]] = {
    "generate_controllers_spawner_launch_description": controllers_spawner,
    "generate_controllers_spawner_launch_description_from_dict": controllers_spawner_from_dict,
    "generate_load_controller_launch_description": load_controller,
}


class Transition:
    """Constants of lifecycle_msgs, for launch files that use them. KBot's nodes do not have a lifecycle."""

    TRANSITION_CREATE, TRANSITION_CONFIGURE, TRANSITION_CLEANUP = 0, 1, 2
    TRANSITION_ACTIVATE, TRANSITION_DEACTIVATE = 3, 4
    TRANSITION_UNCONFIGURED_SHUTDOWN, TRANSITION_INACTIVE_SHUTDOWN, TRANSITION_ACTIVE_SHUTDOWN = 5, 6, 7
