"""The actions of ROS 2 launch files. Each stores its arguments and the line that created it.

Names and arguments are those of `launch.actions`, `launch_ros.actions` and related modules.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from kbot.ros.launch.ros2.conditions import Condition
from kbot.ros.launch.ros2.places import here
from kbot.ros.launch.ros2.substitutions import Substitution
from kbot.text import Origin

Value = Any
"""A value that can be a substitution. It is not `object`, because actions pass keywords to their base
classes."""


class Action:
    """An action, which runs if it has no condition or its condition is true."""

    def __init__(self, *, condition: Condition | None = None, **_: object) -> None:
        self.condition = condition
        self.origin = here()


class LaunchDescription:
    """The actions of a launch file, in order."""

    def __init__(self, initial_entities: Iterable[object] | None = None) -> None:
        self.entities: list[object] = list(initial_entities or ())

    def add_action(self, action: object) -> None:
        self.entities.append(action)

    add_entity = add_action


class DeclareLaunchArgument(Action):
    def __init__(
        self,
        name: str,
        *,
        default_value: Value = None,
        description: str | None = None,
        choices: Iterable[str] | None = None,
        **more: Value,
    ) -> None:
        super().__init__(**more)
        if not isinstance(name, str):
            raise TypeError(f"the name of a launch argument must be a str, not {type(name).__name__}")
        self.name, self.default, self.description = name, default_value, description
        self.choices = None if choices is None else [str(choice) for choice in choices]


class SetLaunchConfiguration(Action):
    def __init__(self, name: Value, value: Value, **more: Value) -> None:
        super().__init__(**more)
        self.name, self.value = name, value


class UnsetLaunchConfiguration(Action):
    def __init__(self, name: Value, **more: Value) -> None:
        super().__init__(**more)
        self.name = name


class SetEnvironmentVariable(Action):
    def __init__(self, name: Value, value: Value, **more: Value) -> None:
        super().__init__(**more)
        self.name, self.value = name, value


class AppendEnvironmentVariable(Action):
    def __init__(
        self,
        name: Value,
        value: Value,
        prepend: Value = False,
        *,
        separator: Value = os.pathsep,
        **more: Value,
    ) -> None:
        super().__init__(**more)
        self.name, self.value, self.prepend, self.separator = name, value, prepend, separator


class PushLaunchConfigurations(Action):
    pass


class PopLaunchConfigurations(Action):
    pass


class ResetLaunchConfigurations(Action):
    def __init__(self, launch_configurations: Mapping[Value, Value] | None = None, **more: Value) -> None:
        super().__init__(**more)
        self.launch_configurations = dict(launch_configurations or {})


class UnsetEnvironmentVariable(Action):
    def __init__(self, name: Value, **more: Value) -> None:
        super().__init__(**more)
        self.name = name


class LaunchDescriptionSource:
    """The location of an included launch file."""

    def __init__(self, location: Value = "", *_: Value, **more: Value) -> None:
        self.location = more.get("launch_file_path", location)


class IncludeLaunchDescription(Action):
    def __init__(
        self, launch_description_source: Value, *, launch_arguments: Value = None, **more: Value
    ) -> None:
        super().__init__(**more)
        source = launch_description_source
        self.location = source.location if isinstance(source, LaunchDescriptionSource) else source
        pairs = launch_arguments.items() if isinstance(launch_arguments, Mapping) else launch_arguments
        self.launch_arguments: list[tuple[Value, Value]] = list(pairs or ())


class GroupAction(Action):
    def __init__(
        self,
        actions: Iterable[object],
        *,
        scoped: Value = True,
        forwarding: Value = True,
        launch_configurations: Mapping[Value, Value] | None = None,
        **more: Value,
    ) -> None:
        super().__init__(**more)
        self.actions, self.scoped, self.forwarding = list(actions), scoped, forwarding
        self.launch_configurations = dict(launch_configurations or {})


class PushRosNamespace(Action):
    def __init__(self, namespace: Value, **more: Value) -> None:
        super().__init__(**more)
        self.namespace = namespace


class SetRemap(Action):
    def __init__(self, src: Value, dst: Value, **more: Value) -> None:
        super().__init__(**more)
        self.pair = (src, dst)


class SetParameter(Action):
    def __init__(self, name: Value, value: Value, **more: Value) -> None:
        super().__init__(**more)
        self.name, self.value = name, value


class SetParametersFromFile(Action):
    def __init__(self, filename: Value, *, node_name: Value = None, **more: Value) -> None:
        super().__init__(**more)
        self.filename = filename


class SetUseSimTime(SetParameter):
    def __init__(self, value: Value, **more: Value) -> None:
        super().__init__("use_sim_time", value, **more)


class Node(Action):
    def __init__(
        self,
        *,
        executable: Value,
        package: Value = None,
        name: Value = None,
        namespace: Value = None,
        parameters: Iterable[object] | None = None,
        remappings: Iterable[tuple[Value, Value]] | None = None,
        arguments: Iterable[Value] | None = None,
        ros_arguments: Iterable[Value] | None = None,
        output: Value = "log",
        respawn: Value = False,
        respawn_delay: Value = None,
        prefix: Value = None,
        on_exit: Value = None,
        additional_env: Mapping[Value, Value] | None = None,
        **more: Value,
    ) -> None:
        super().__init__(**more)
        self.package, self.executable = package, executable
        self.name, self.namespace = name, namespace
        self.parameters = list(parameters or ())
        self.remappings = list(remappings or ())
        self.arguments = [*(arguments or ()), *(ros_arguments or ())]
        self.output, self.respawn, self.respawn_delay = output, respawn, respawn_delay
        self.prefix, self.on_exit = prefix, on_exit
        self.environment = dict(additional_env or {})


class LifecycleNode(Node):
    pass


class ComposableNodeContainer(Node):
    def __init__(
        self, *, composable_node_descriptions: Iterable[object] | None = None, **more: Value
    ) -> None:
        super().__init__(**more)


class ExecuteProcess(Action):
    def __init__(
        self,
        *,
        cmd: Iterable[Value],
        name: Value = None,
        on_exit: Value = None,
        shell: Value = False,
        **more: Value,
    ) -> None:
        super().__init__(**more)
        self.command, self.name, self.on_exit, self.shell = list(cmd), name, on_exit, shell


class ExecuteLocal(ExecuteProcess):
    pass


class TimerAction(Action):
    def __init__(self, *, period: Value, actions: Iterable[object], **more: Value) -> None:
        super().__init__(**more)
        self.period, self.actions = period, list(actions)


class OpaqueFunction(Action):
    def __init__(
        self,
        *,
        function: Callable[..., Iterable[object] | None],
        args: Iterable[object] | None = None,
        kwargs: Mapping[str, object] | None = None,
        **more: Value,
    ) -> None:
        super().__init__(**more)
        self.function, self.args, self.kwargs = function, list(args or ()), dict(kwargs or {})


class LogInfo(Action):
    def __init__(self, *, msg: Value = "", **more: Value) -> None:
        super().__init__(**more)


class Silent(Action):
    """An action that has no effect on what KBot runs."""

    def __init__(self, *_: object, **more: Value) -> None:
        super().__init__(condition=more.get("condition"))


class Shutdown(Silent):
    """Ends the launch. As `on_exit` of a node it makes the node required."""


class EmitEvent(Action):
    def __init__(self, *, event: object = None, **more: Value) -> None:
        super().__init__(**more)
        self.event = event


class ParameterValue:
    def __init__(self, value: Value, *, value_type: Value = None) -> None:
        self.value, self.type = value, value_type


class PlacedParameter:
    """The parameters of a `<param>`, by name, with its origin."""

    def __init__(self, values: dict[str, object], origin: Origin) -> None:
        self.values, self.origin = values, origin


class ParameterFile:
    def __init__(self, param_file: Value, *, allow_substs: Value = False) -> None:
        self.file, self.allow_substs = param_file, allow_substs
        self.origin = here()


def is_value(value: object) -> bool:
    """Whether a value is a text, a substitution or a sequence of those."""
    return isinstance(value, str | Substitution) or (
        isinstance(value, list | tuple) and all(isinstance(v, str | Substitution) for v in value)
    )
